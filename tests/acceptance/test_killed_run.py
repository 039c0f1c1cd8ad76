"""A run that is killed, or done twice at once, ends with the same surrogate and a whole FMU."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from tests.acceptance.conftest import ROOT, SMALL_LINEAR
from tests.limits import HANGS

pytestmark = pytest.mark.extended

RECIPE = SMALL_LINEAR.replace("steps = 1200", "steps = 40").replace(
    "validate_every = 300", "validate_every = 5"
)
KILLS = 24


@dataclass(frozen=True)
class Run:
    """A run of the recipe as a program of its own."""

    recipe: Path
    runs: Path

    def start(self) -> subprocess.Popen[bytes]:
        options = ["--runs", str(self.runs), "--trajectories", "1", "--workers", "1"]
        return subprocess.Popen(
            [sys.executable, "-m", "slide_fmu", "run", str(self.recipe), *options],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def finish(self) -> bytes:
        """Run to the end, and return the surrogate."""
        assert self.start().wait(HANGS) == 0
        return self.surrogate()

    def surrogate(self) -> bytes:
        """Return the surrogate of the finished run, which its FMU holds."""
        kept = (self.runs / "small_linear" / "surrogate.slide").read_bytes()
        surrogate, _ = read_fmu(self.fmu)
        assert surrogate.to_bytes() == kept
        self.require_whole()
        return kept

    @property
    def fmu(self) -> Path:
        return self.runs / "small_linear" / "small_linear.fmu"

    def require_whole(self) -> None:
        """Require that the FMU is finished: every file is whole, and its error is measured."""
        with zipfile.ZipFile(self.fmu) as archive:
            assert archive.testzip() is None
            assert "documentation/index.html" in archive.namelist()
        _, provenance = read_fmu(self.fmu)
        assert provenance is not None
        assert "measured" in provenance


@pytest.fixture
def run(tmp_path: Path) -> Run:
    recipe = tmp_path / "small.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    return Run(recipe, tmp_path / "runs")


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, float]:
    """The surrogate of an unbroken run, and its time in s."""
    folder = tmp_path_factory.mktemp("unbroken")
    recipe = folder / "small.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    begin = time.monotonic()
    return Run(recipe, folder / "runs").finish(), time.monotonic() - begin


def test_run_that_is_killed_leaves_no_half_fmu_and_ends_as_an_unbroken_one(
    run: Run, unbroken: tuple[bytes, float]
) -> None:
    surrogate, seconds = unbroken
    moments = random.Random(0)
    for _ in range(KILLS):
        process = run.start()
        time.sleep(moments.uniform(0.1, 1.0) * seconds)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(HANGS)
        if run.fmu.exists():  # begin anew, so that data and trainings are killed too
            run.require_whole()
            assert run.surrogate() == surrogate
            shutil.rmtree(run.runs)
    assert run.finish() == surrogate


def test_two_programs_in_one_run_folder_both_end_with_the_same_surrogate(
    run: Run, unbroken: tuple[bytes, float]
) -> None:
    both = [run.start(), run.start()]
    assert [process.wait(HANGS) for process in both] == [0, 0]
    assert run.surrogate() == unbroken[0]
