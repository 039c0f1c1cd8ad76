"""A run that is killed, or done twice at once, ends with the same surrogate and a whole FMU."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from tests.acceptance.conftest import ROOT, SMALL_BOUNDED, SMALL_LINEAR
from tests.limits import HANGS

pytestmark = pytest.mark.extended

RECIPE = SMALL_LINEAR.replace("steps = 1200", "steps = 40").replace(
    "validate_every = 300", "validate_every = 5"
)
RECIPES = {"small_linear": (RECIPE, 16), "small_bounded": (SMALL_BOUNDED, 8)}
"""Recipes by their names, with the number of kills. The companion of the bounded one is trained in
a program of its own."""


@dataclass(frozen=True)
class Run:
    """A run of the recipe as a program of its own."""

    recipe: Path
    runs: Path

    @property
    def name(self) -> str:
        return self.recipe.stem

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
        kept = (self.runs / self.name / "surrogate.slide").read_bytes()
        surrogate, _ = read_fmu(self.fmu)
        assert surrogate.to_bytes() == kept
        self.require_whole()
        return kept

    @property
    def fmu(self) -> Path:
        return self.runs / self.name / f"{self.name}.fmu"

    def require_whole(self) -> None:
        """Require that the FMU is finished: every file is whole, and its error is measured."""
        with zipfile.ZipFile(self.fmu) as archive:
            assert archive.testzip() is None
            assert "documentation/index.html" in archive.namelist()
        _, provenance = read_fmu(self.fmu)
        assert provenance is not None
        assert "measured" in provenance


@dataclass(frozen=True)
class Unbroken:
    """A recipe, what an unbroken run of it ends with, its time in s, and how often to kill it."""

    text: str
    surrogate: bytes
    seconds: float
    kills: int


def run_of(name: str, text: str, folder: Path) -> Run:
    recipe = folder / f"{name}.toml"
    recipe.write_text(text, encoding="utf-8")
    return Run(recipe, folder / "runs")


@pytest.fixture(scope="module", params=list(RECIPES))
def unbroken(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Unbroken:
    text, kills = RECIPES[request.param]
    begin = time.monotonic()
    surrogate = run_of(request.param, text, tmp_path_factory.mktemp("unbroken")).finish()
    return Unbroken(text, surrogate, time.monotonic() - begin, kills)


@pytest.fixture
def run(unbroken: Unbroken, tmp_path: Path) -> Run:
    return run_of(tomllib.loads(unbroken.text)["name"], unbroken.text, tmp_path)


def test_run_that_is_killed_leaves_no_half_fmu_and_ends_as_an_unbroken_one(
    run: Run, unbroken: Unbroken
) -> None:
    moments = random.Random(0)
    for _ in range(unbroken.kills):
        process = run.start()
        time.sleep(moments.uniform(0.1, 1.0) * unbroken.seconds)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(HANGS)
        if run.fmu.exists():  # begin anew, so that data and trainings are killed too
            run.require_whole()
            assert run.surrogate() == unbroken.surrogate
            shutil.rmtree(run.runs)
    assert run.finish() == unbroken.surrogate


def test_two_programs_in_one_run_folder_both_end_with_the_same_surrogate(
    run: Run, unbroken: Unbroken
) -> None:
    both = [run.start(), run.start()]
    assert [process.wait(HANGS) for process in both] == [0, 0]
    assert run.surrogate() == unbroken.surrogate
