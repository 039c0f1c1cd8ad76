"""Fixtures: the compiled runtime, and FMUs unpacked and loaded."""

from __future__ import annotations

import zipfile
from pathlib import Path
from types import SimpleNamespace

import fmpy
import pytest

from slide_fmu.core import files
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import ExportedFmu, Load, Native
from tests.fmu.samples import TWO_MASSES, Shape, random_surrogate, sum_surrogate
from tests.libraries import build_libraries


@pytest.fixture(scope="session", autouse=True)
def _binaries() -> None:
    build_libraries()


STORED = SimpleNamespace(**{**vars(zipfile), "ZIP_DEFLATED": zipfile.ZIP_STORED})
"""Compressing the libraries would take most of the time of a test."""


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Export and unpack a surrogate."""

    def loaded(surrogate: Surrogate) -> ExportedFmu:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(files, "zipfile", STORED)
            path = export_fmu(surrogate, tmp_path / f"{surrogate.name}.fmu")
        folder = Path(fmpy.extract(str(path), str(tmp_path / surrogate.name)))
        return ExportedFmu(surrogate, path, folder)

    return loaded


@pytest.fixture
def summing(load: Load) -> Native:
    """A window of 4, y = sum, whose window holds zeros after one step."""
    native = load(sum_surrogate()).instance().start()
    native.step(0.0)
    return native


@pytest.fixture
def rich(load: Load) -> ExportedFmu:
    shape = Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3)
    return load(random_surrogate(shape))


@pytest.fixture
def surrogate() -> Surrogate:
    """Two inputs, two outputs and an estimator, for tests of FMU files."""
    return random_surrogate(TWO_MASSES)


@pytest.fixture
def fmu(surrogate: Surrogate, tmp_path: Path) -> Path:
    """An FMU of FMI 2.0 that holds all that an archive can hold."""
    pages = {"index.html": b"<p>card</p>", "figures/error.svg": b"<svg/>"}
    provenance = {"seed": 3, "recipe": "größer"}
    return export_fmu(
        surrogate, tmp_path / "new" / "m.fmu", provenance=provenance, documentation=pages
    )
