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
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.pipeline.run import require_same_answers
from tests.fmu.samples import CellShape, random_surrogate
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


def test_network_that_magnifies_rounding_is_told_as_the_cause(tmp_path: Path) -> None:
    """Its states are large, and all but cancel each other in the output."""
    surrogate = random_surrogate(replace(CELLS, positions=0, cell=CellShape(2, 3)))
    network = surrogate.network
    assert isinstance(network, StateSpace)
    cell = network.cell
    alike = replace(
        cell,
        a=np.array([[0.9, 0.0], [0.0, 0.9000002]], np.float32),
        b=np.repeat(cell.b[:1], 2, axis=0),
        e=np.zeros_like(cell.e),
        c=np.array([[1.0, -1.0]], np.float32) * np.float32(1e7),
    )
    other = StateSpace(alike, network.n_samples, network.n_out, network.features, network.roles)
    fmu = export_fmu(replace(surrogate, network=other), tmp_path / "alike.fmu")
    with refused(CoSimulationError, "since the network magnifies rounding", "fewer states"):
        require_same_answers(fmu)
