"""What an FMU thinks of held inputs whose values come at its own step."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape
from tests.libraries import build_libraries

COUNT, FIRST = 2000, 100
"""Samples, and the first of them whose past is known."""


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    """Its bound knows all that bounded inputs do."""
    found = bounded_surrogate(Shape(n_in=6, n_out=2, n_outputs=2, cell=CellShape()))
    assert found.bound is not None
    bound = dataclasses.replace(found.bound, limits=1e6 * found.bound.limits)
    return dataclasses.replace(found, bound=bound)


def inside(surrogate: Surrogate, values: FloatArray, held: float, folder: Path) -> FloatArray:
    """Where the FMU is in its domain, (N,), whose scaled input is half of these values."""
    build_libraries()
    inputs = surrogate.input_scaling.invert(0.5 * values[:, None])[:, 0]
    given = {surrogate.inputs[0].name: inputs}
    with unpacked(export_fmu(surrogate, folder / "one.fmu")) as fmu:
        run = run_fmu(fmu, given, ["in_domain"], {"inputs_held": held})
    return run.values[FIRST:, 0]


def test_independent_values_are_held(surrogate: Surrogate, tmp_path: Path) -> None:
    """A doubt by chance would stay for the whole memory."""
    values = np.random.default_rng(5).uniform(-1, 1, COUNT)
    assert np.mean(inside(surrogate, values, 0.0, tmp_path)) > 0.99


@pytest.mark.parametrize("period", [2.3, 2.9, 3.7])
def test_samples_of_a_fast_signal_are_in_doubt_unless_they_are_said_to_be_held(
    surrogate: Surrogate, tmp_path: Path, period: float
) -> None:
    """Between samples that are so few, it does what no forecast tells."""
    values = np.sin(2 * np.pi / period * np.arange(COUNT))
    assert not inside(surrogate, values, 0.0, tmp_path).any()
    assert inside(surrogate, values, 1.0, tmp_path).all()
