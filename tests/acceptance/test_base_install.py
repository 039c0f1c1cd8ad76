"""What works without torch, exudyn and zarr: load, check, run, describe."""

from __future__ import annotations

import subprocess
import sys

from .conftest import Finished

WITHOUT = """
import sys
for name in ("torch", "exudyn", "zarr"):
    sys.modules[name] = None  # importing it raises ImportError
sys.argv = ["slide-fmu", *sys.argv[1:]]
from slide_fmu.cli import main
main()
"""


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Call the console script where the packages of the extra ``train`` are missing."""
    command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def test_check_and_info_and_export_need_no_training_packages(duffing: Finished) -> None:
    for verb in ("check", "info"):
        result = call(verb, duffing.fmu)
        assert result.returncode == 0, result.stderr
    again = duffing.fmu.with_name("again.fmu")
    assert call("export", duffing.fmu, "-o", again).returncode == 0
    assert again.read_bytes() == duffing.fmu.read_bytes()


def test_verbs_that_need_more_say_what(duffing: Finished) -> None:
    result = call("validate", duffing.fmu, "--trajectories", 1)
    assert result.returncode == 1
    assert "exudyn" in result.stderr
    assert "train" in result.stderr
    assert "Traceback" not in result.stderr
