"""The libraries of all platforms that run here give the same results, in an importer written in C.

Windows runs under wine, Linux on aarch64 under qemu-user. macOS does not run here:
``test_macos.py`` looks into its libraries.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import fmpy
import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.fmi2 import guid_of
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.build import TARGETS, WARNINGS
from slide_fmu.fmu.libraries.platforms import FmiVersion, library_members
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.driver import run_compiler
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.limits import HANGS

pytestmark = pytest.mark.extended

IMPORTER = Path(__file__).parent / "c" / "importer.c"
STEPS = 60
ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")

TOLERANCE = 2e-6
"""Of single precision, as against numpy. Found is zero: with AVX2 and with NEON, sums have the
same order and fused products; another mathematical library or an older processor may differ."""

FAMILIES = {
    "layers": Shape(activation="elu", positions=3),
    "tanh layers": Shape(
        activation="tanh", n_inputs=2, n_outputs=2, hold="first_order", means=True
    ),
    "cells": Shape(
        n_inputs=2, positions=3, hold="first_order", cell=CellShape(9, 17), forecasts=True
    ),
    "chain": Shape(
        n_inputs=2,
        n_outputs=2,
        features="chain",
        positions=2,
        cell=CellShape(8, 11, "gated", turned=2, factors=2),
    ),
    "director": Shape(
        n_inputs=2, features="director", hold="first_order", cell=CellShape(5, 9, "gated")
    ),
}


def _wine() -> str | None:
    places = os.pathsep.join([os.environ.get("PATH", ""), "/usr/lib/wine"])
    return shutil.which("wine", path=places) or shutil.which("wine64", path=places)


def _qemu() -> str | None:
    return shutil.which("qemu-aarch64") if ARM_LIBRARIES.is_dir() else None


@dataclass(frozen=True)
class Platform:
    """How a platform runs here: what is typed before the program, and what is missing if nothing.

    Attributes:
        targets: compiler targets and folders below ``binaries``, by standard.
    """

    target: str
    folders: dict[FmiVersion, str]
    command: list[str]
    missing: str | None = None
    drive: str = ""  # what absolute paths begin with


def _linux() -> Platform:
    missing = None if fmpy.platform_tuple == "x86_64-linux" else "this machine is another one"
    target = TARGETS["x86_64-linux/slide.so"]
    return Platform(target, {2: "linux64", 3: "x86_64-linux"}, [], missing)


def _windows() -> Platform:
    wine = _wine()
    return Platform(
        TARGETS["x86_64-windows/slide.dll"],
        {2: "win64", 3: "x86_64-windows"},
        [wine or ""],
        "wine is not installed" if wine is None else None,
        "Z:",
    )


def _arm() -> Platform:
    qemu = _qemu()
    return Platform(
        TARGETS["aarch64-linux/slide.so"],
        {3: "aarch64-linux"},
        [qemu or "", "-L", str(ARM_LIBRARIES)],
        "qemu-aarch64 (qemu-user) or libc6-arm64-cross is not installed" if qemu is None else None,
    )


PLATFORMS = {"linux": _linux(), "windows": _windows(), "arm": _arm()}
RUNS = [(name, fmi) for name, platform in PLATFORMS.items() for fmi in platform.folders]


@pytest.fixture(scope="module")
def importers(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Platform], Path]:
    """The importer of each platform, compiled once."""
    folder, built = tmp_path_factory.mktemp("importers"), dict[str, Path]()

    def importer(platform: Platform) -> Path:
        if platform.target not in built:
            program = folder / f"importer-{platform.target}.exe"
            zig = [sys.executable, "-m", "ziglang", "cc", "-target", platform.target]
            result = run_compiler(zig, [*WARNINGS, str(IMPORTER), "-o", str(program)])
            assert result.returncode == 0, result.stderr
            built[platform.target] = program
        return built[platform.target]

    return importer


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    prefix = str(tmp_path_factory.mktemp("wine"))
    return {**os.environ, "WINEPREFIX": prefix, "WINEDEBUG": "-all"}


def _exported(surrogate: Surrogate, fmi: FmiVersion, folder: Path) -> Path:
    """An unpacked FMU, in a folder with an odd name."""
    path = export_fmu(surrogate, folder / f"sample{fmi}.fmu", fmi=fmi)
    return Path(fmpy.extract(str(path), str(folder / f"räsources {fmi}")))


def _run(
    platform: Platform,
    fmi: FmiVersion,
    importer: Path,
    surrogate: Surrogate,
    folder: Path,
    environment: dict[str, str],
) -> FloatArray:
    """All outputs after every step, shape (STEPS, n)."""
    unpacked = _exported(surrogate, fmi, folder)
    start = f"binaries/{platform.folders[fmi]}/"
    (member,) = [m for m in library_members(surrogate.name, fmi) if m.startswith(start)]
    library = folder / f"library-{fmi}{Path(member).suffix}"  # wine: a plain path
    shutil.copy(unpacked / member, library)
    resources = unpacked / "resources"
    uri = "file:///" + (platform.drive + resources.as_uri().removeprefix("file://")).lstrip("/")
    place = uri if fmi == 2 else f"{platform.drive}{quote(str(resources))}/"
    n_inputs = len(surrogate.inputs)
    read = [v.reference for v in fmu_variables(surrogate) if v.type == "Real"][n_inputs:]
    numbers = map(str, (STEPS, n_inputs, *read))
    guid = guid_of(surrogate.to_bytes())
    result = subprocess.run(
        [*platform.command, importer, library, str(fmi), place, guid, *numbers],
        capture_output=True,
        text=True,
        check=False,
        timeout=HANGS,
        env=environment,
    )
    assert result.returncode == 0, result.stderr + result.stdout
    return np.array(result.stdout.split(), dtype=float).reshape(STEPS, len(read))


def _here(
    importers: Callable[[Platform], Path],
    surrogate: Surrogate,
    folder: Path,
    environment: dict[str, str],
) -> FloatArray:
    linux = PLATFORMS["linux"]
    if linux.missing is not None:
        pytest.skip(linux.missing)
    return _run(linux, 2, importers(linux), surrogate, folder, environment)


@pytest.mark.parametrize(("name", "fmi"), RUNS, ids=str)
@pytest.mark.parametrize("family", FAMILIES)
def test_libraries_of_all_platforms_give_the_same_outputs(
    importers: Callable[[Platform], Path],
    environment: dict[str, str],
    tmp_path: Path,
    name: str,
    fmi: FmiVersion,
    family: str,
) -> None:
    platform = PLATFORMS[name]
    if platform.missing is not None:
        pytest.skip(platform.missing)
    surrogate = random_surrogate(FAMILIES[family])
    (tmp_path / "here").mkdir()
    expected = _here(importers, surrogate, tmp_path / "here", environment)
    assert np.ptp(expected[:, 0]) > 0.1
    found = _run(platform, fmi, importers(platform), surrogate, tmp_path, environment)
    print(f"largest deviation {np.abs(found - expected).max():.3g}")
    np.testing.assert_allclose(found, expected, rtol=TOLERANCE, atol=TOLERANCE)
