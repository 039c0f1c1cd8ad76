"""An FMU with a bound is run next to a known truth: bounds, domain, first trusted sample."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.importer.run import run_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Comparison, compare_with_truth
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape
from tests.libraries import build_libraries

ROUNDED = 1e-3
"""Relative: the head sees logarithms of differences in single precision."""
ERROR = 0.25
"""The truth is the surrogate's output minus this."""

HELD = Shape(
    n_in=9, n_out=4, n_inputs=2, n_outputs=2, differences=1, cell=CellShape(contraction=0.9)
)
MOVING = replace(HELD, hold="first_order", forecasts=True)


def known_inputs() -> FloatArray:
    return np.random.default_rng(4).uniform(-1, 1, (120, 2))


def compared(surrogate: Surrogate, fmu: Path, burn_in: int) -> Comparison:
    """Compare an FMU with a truth from which its outputs differ by ``ERROR`` everywhere."""
    build_libraries()
    inputs = known_inputs()
    outputs = surrogate.predict_newest(inputs) - ERROR
    truth = np.concatenate([outputs[:1], outputs])
    drawn = Draw(kind=3, factor=1.0, initial=None, inputs=inputs, burn_in=burn_in)
    with unpacked(export_fmu(surrogate, fmu)) as opened:
        return compare_with_truth(opened, surrogate, drawn, truth, np.zeros(0))


@pytest.mark.parametrize("burn_in", [0, 30, 100])
def test_bounds_count_from_the_sample_on_that_fills_them(burn_in: int, tmp_path: Path) -> None:
    surrogate, inputs = bounded_surrogate(HELD), known_inputs()
    found = compared(surrogate, tmp_path / "bounded.fmu", burn_in)
    assert surrogate.bound is not None
    first = max(burn_in + 1, surrogate.network.memory_length)
    assert found.first_trusted == max(0, surrogate.bound.filling_length - first)
    assert (found.first_trusted == 0) == (burn_in == 100)
    assert found.trust is not None
    trust = surrogate.trust(inputs)
    bounds = trust.bounds(0.95)[first - 1 :]
    np.testing.assert_allclose(found.trust.bounds, bounds, rtol=ROUNDED)
    novelty = trust.novelty[first - 1 :]
    np.testing.assert_allclose(found.trust.novelty, novelty, rtol=ROUNDED)
    np.testing.assert_allclose(found.error, ERROR, rtol=ROUNDED)
    assert found.plain is None  # held inputs have one way to be set


def test_moving_inputs_are_set_to_both_ends_of_a_step(tmp_path: Path) -> None:
    surrogate, inputs = bounded_surrogate(MOVING), known_inputs()
    found = compared(surrogate, tmp_path / "moving.fmu", 30)
    np.testing.assert_allclose(found.error, ERROR, rtol=ROUNDED)
    names = [signal.name for signal in surrogate.outputs]
    now = np.concatenate([inputs[:1], inputs[:-1]])
    values = {signal.name: now[:, i] for i, signal in enumerate(surrogate.inputs)}
    with unpacked(tmp_path / "moving.fmu") as opened:
        expected = run_fmu(opened, values, names, {}, surrogate.window.step).values[31:]
    assert found.plain is not None
    np.testing.assert_array_equal(found.plain.surrogate, expected)
    assert np.abs(found.plain.surrogate - found.surrogate).max() > ROUNDED
    assert found.plain.trust is not None
