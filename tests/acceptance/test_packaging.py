"""The wheel: the package, the compiled runtime and the templates, and no models."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

from slide_fmu.fmu.libraries.build import LIBRARIES, STAMP

ROOT = Path(__file__).parents[2]


def test_wheel_holds_the_compiled_runtime(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {
        "slide_fmu/fmu/runtime/source/resource.c",
        "slide_fmu/report/templates/report.html",
        "slide_fmu/report/web/report.js",
        "slide_fmu/core/web/modules/chart.js",
        "slide_fmu/report/templates/card.md",
        "slide_fmu/py.typed",
    } <= names
    folder = "slide_fmu/fmu/binaries/"
    binaries = {name.removeprefix(folder) for name in names if name.startswith(folder)}
    assert binaries == {*LIBRARIES, STAMP}
    tops = {name.split("/")[0] for name in names}
    assert tops == {"slide_fmu", *(t for t in tops if t.endswith(".dist-info"))}
