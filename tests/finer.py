"""Fixtures: an FMU against the finer model, measured once for all tests of a process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from slide_fmu.core.window import Window
from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.results import Validation
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.validation.tiny_validation import FINER, PLAIN, measured


@pytest.fixture(scope="session")
def surrogate() -> Surrogate:
    """The sum of eight inputs: what it says does not matter here."""
    system = case_of(PLAIN).system
    return replace(
        sum_surrogate(8),
        name="tiny",
        window=Window(PLAIN.window.step, 8, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )


@pytest.fixture(scope="session")
def fmu(surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    build_libraries()
    return export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")


@pytest.fixture(scope="session")
def finer(fmu: Path, surrogate: Surrogate) -> Validation:
    return measured(fmu, surrogate, FINER)
