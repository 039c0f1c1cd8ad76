"""The Windows library, run under wine, gives what the Linux library gives."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.fmu.build import WARNINGS
from slide_fmu.surrogate import Surrogate

from .driver import run_compiler
from .native import Loaded
from .samples import Shape, random_surrogate

LOADER = Path(__file__).parent / "c" / "windows_loader.c"
STEPS = 40


def _wine() -> str | None:
    places = os.pathsep.join([os.environ.get("PATH", ""), "/usr/lib/wine"])
    return shutil.which("wine", path=places) or shutil.which("wine64", path=places)


@pytest.mark.slow
@pytest.mark.skipif(_wine() is None, reason="wine is not installed")
def test_windows_library(load: Callable[[Surrogate], Loaded], tmp_path: Path) -> None:
    wine = _wine()
    assert wine is not None
    loaded = load(random_surrogate(Shape(activation="elu", positions=3)))
    program = tmp_path / "loader.exe"
    zig = [sys.executable, "-m", "ziglang", "cc"]
    arguments = ["-target", "x86_64-windows-gnu", *WARNINGS, str(LOADER), "-o", str(program)]
    built = run_compiler(zig, arguments)
    assert built.returncode == 0, built.stderr
    odd = tmp_path / "räsources 1"
    shutil.copytree(loaded.folder / "resources", odd)
    library = loaded.folder / "binaries" / "win64" / "sample.dll"
    environment = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"}
    uri = odd.as_uri().replace("file:///", "file:///Z:/")
    result = subprocess.run(
        [wine, program, library, uri, loaded.guid, str(STEPS)],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=environment,
    )
    assert result.returncode == 0, result.stderr + result.stdout
    windows = np.array(result.stdout.split(), dtype=float)
    inputs = (np.arange(STEPS) % 21 - 10)[:, None] / 10.0
    expected = loaded.surrogate.predict_newest(inputs)[:, 0]
    np.testing.assert_allclose(windows, expected, rtol=0, atol=2e-6 * 8)
