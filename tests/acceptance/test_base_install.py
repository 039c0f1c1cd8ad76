"""What works without torch and exudyn: load, check, run, describe."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.acceptance.conftest import Finished
from tests.limits import HANGS

pytestmark = pytest.mark.extended

TRAINING = ("torch", "exudyn")
"""The packages of the extra ``train``."""
SLOW_TO_IMPORT = ("matplotlib", "scipy", "fmpy", "pythonfmu", "jinja2", *TRAINING)

WITHOUT = """
import sys
class Hidden:
    names = sys.argv[1].split()
    def find_spec(self, name, path=None, target=None):
        if name in self.names:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
sys.argv = ["slide-fmu", *sys.argv[2:]]
from slide_fmu.cli import main
main()
"""


def call(
    *arguments: object, missing: tuple[str, ...] = TRAINING
) -> subprocess.CompletedProcess[str]:
    """Call the console script where packages are missing."""
    command = [sys.executable, "-c", WITHOUT, " ".join(missing), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=HANGS)


def test_check_and_info_and_export_need_no_training_packages(duffing: Finished) -> None:
    for subcommand in ("check", "info"):
        result = call(subcommand, duffing.fmu)
        assert result.returncode == 0, result.stderr
    again = duffing.fmu.with_name("again.fmu")
    assert call("export", duffing.fmu, "-o", again).returncode == 0
    assert again.read_bytes() == duffing.fmu.read_bytes()


@pytest.mark.parametrize("form", [("--fmi", 2), ("--fmi", 3), ("--source",)])
def test_export_of_an_fmu_imports_nothing_that_it_does_not_need(
    form: tuple[object, ...], tmp_path: Path
) -> None:
    source = Path(__file__).parents[2] / "fmus" / "linear" / "linear.fmu"
    path = tmp_path / "linear.fmu"
    result = call("export", source, "-o", path, *form, missing=SLOW_TO_IMPORT)
    assert result.returncode == 0, result.stderr
    assert path.exists()


def test_subcommands_that_need_training_packages_name_them(duffing: Finished) -> None:
    result = call("validate", duffing.fmu, "--trajectories", 1)
    assert result.returncode == 1
    assert "exudyn" in result.stderr
    assert "train" in result.stderr
    assert "Traceback" not in result.stderr
