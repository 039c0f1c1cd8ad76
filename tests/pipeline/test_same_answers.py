"""A run writes no FMU whose library gives something else than its surrogate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.cosim import check
from slide_fmu.cosim.whole_run import Run, run_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.pipeline.run import require_same_answers
from tests.fmu.samples import random_surrogate
from tests.fmu.small_shapes import CELLS
from tests.refusals import refused


@pytest.fixture
def fmu(tmp_path: Path) -> Path:
    """An FMU with a small network."""
    return export_fmu(random_surrogate(CELLS), tmp_path / "cells.fmu")


def let_libraries_be_off(monkeypatch: pytest.MonkeyPatch, deviation: float) -> None:
    """The library gives something else, by so much of each output's largest value."""

    def off(*arguments: Any) -> Run:
        run = run_fmu(*arguments)
        return replace(run, values=run.values + deviation * np.abs(run.values).max(axis=0))

    monkeypatch.setattr(check, "run_fmu", off)


def test_library_that_is_off_by_rounding_passes(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By somewhat more than ``check`` allows, too: rounding is another on each processor."""
    require_same_answers(fmu)
    let_libraries_be_off(monkeypatch, 1e-5)
    require_same_answers(fmu)


def test_library_that_gives_something_else_is_refused(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    let_libraries_be_off(monkeypatch, 0.05)
    with refused(CoSimulationError, "cells", "differ by", "No FMU is written."):
        require_same_answers(fmu)


def test_library_that_fails_is_told(fmu: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object) -> Run:
        raise CoSimulationError("cannot be loaded")

    monkeypatch.setattr(check, "run_fmu", fail)
    with refused(CoSimulationError, "library failed"):
        require_same_answers(fmu)
