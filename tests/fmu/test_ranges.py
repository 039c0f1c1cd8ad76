"""The output ``inputs_in_range``: the FMU's, that of the stream, and that of whole records."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.description.variables import IN_RANGE
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import forecasting
from tests.fmu.native import OK, ExportedFmu, Load
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate

WIDE = Affine.of_channels([0.5], [3.0])
"""Of one input: its range is -2.5 to 3.5."""


def reference(surrogate: Surrogate) -> int:
    return [variable.name for variable in fmu_variables(surrogate)].index(IN_RANGE)


def wide_surrogate(shape: Shape) -> Surrogate:
    return dataclasses.replace(random_surrogate(shape), input_scaling=WIDE)


def flags(loaded: ExportedFmu, rows: np.ndarray, length: float = 1.0) -> list[float]:
    native, place, found = loaded.instance().start(), reference(loaded.surrogate), []
    for row in rows:
        assert native.set(*np.atleast_1d(row)) == OK
        assert native.do_step(native.time(), length * STEP) == OK
        found += native.get(place)
    return found


@pytest.mark.parametrize("cell", [None, CellShape()])
def test_one_input_out_of_range_counts_until_the_memory_has_lost_it(
    load: Load, cell: CellShape | None
) -> None:
    loaded = load(wide_surrogate(Shape(n_in=6, n_out=2, cell=cell)))
    count = loaded.surrogate.network.memory_length
    rows = np.full(30, 3.5)
    rows[[8, 9]] = [3.501, -2.499]
    expected = [not 8 <= k < 8 + count for k in range(30)]
    assert flags(loaded, rows) == expected
    assert flags(loaded, -rows + 1) == expected
    assert loaded.surrogate.inputs_in_range(rows[:, None]).tolist() == expected


@pytest.mark.parametrize("length", [0.3, 0.7])
def test_curve_through_points_at_the_limit_does_not_leave_the_range(
    load: Load, length: float
) -> None:
    """Samples lie between communication points: an input that saturates has a kink there."""
    shape = Shape(n_in=6, n_out=2, cell=CellShape(), hold="first_order")
    rows = np.clip(0.5 + 3.3 * np.sin(0.05 * length * np.arange(300)), -2.5, 3.5)
    assert all(flags(load(forecasting(wide_surrogate(shape))), rows, length))


def test_first_input_out_of_range_counts_as_held_before(load: Load) -> None:
    loaded = load(wide_surrogate(Shape(n_in=6, n_out=2, block=False)))
    native, place = loaded.instance().start(), reference(loaded.surrogate)
    assert native.get(place) == [1.0]
    native.set(9.0)
    assert native.get(place) == [0.0]
    assert flags(loaded, np.array([9.0, *[1.0] * 7])) == [0, 0, 0, 0, 0, 1, 1, 1]


def test_features_unknown_to_the_estimator_do_not_count(load: Load) -> None:
    """They make the estimate the largest one; what lies in its range is in range."""
    surrogate = wide_surrogate(Shape(n_in=6, n_out=2, positions=1, estimator_samples=4))
    assert surrogate.estimator is not None
    known = np.array([[-0.5], [0.5]], np.float32)  # inputs -1 to 2; the FMU's range is wider
    narrow = dataclasses.replace(surrogate.estimator, ranges=known)
    surrogate, rows = dataclasses.replace(surrogate, estimator=narrow), np.full(40, 1.0)
    rows[20] = 2.001
    largest = 10**narrow.log_error.high * surrogate.output_scaling.scale[0]
    assert surrogate.estimate_error(rows[:, None])[20] == pytest.approx([largest])
    assert flags(load(surrogate), rows) == [1.0] * 40
    assert surrogate.inputs_in_range(rows[:, None]).all()


@pytest.mark.parametrize("length", [2.0, 0.5, 2.5])
def test_flag_after_steps_of_other_lengths_is_that_of_the_resampled_inputs(
    load: Load, length: float
) -> None:
    """Samples end with the step, one h apart; each takes the mean of the input."""
    loaded = load(wide_surrogate(Shape(n_in=6, n_out=2, block=False)))
    outside, before = max(1, int(2 / length)), 8
    rows = np.array([*[1.0] * before, *[4.0] * outside, *[1.0] * 20])
    ends = length * np.arange(1 - before, len(rows) - before + 1)
    begins = ends[:, None] - np.arange(1, 6)
    share = np.clip(np.minimum(begins + 1, outside * length) - np.maximum(begins, 0), 0, 1)
    expected = ~(1.0 + 3.0 * share > 3.5).any(axis=1)
    assert flags(loaded, rows, length) == expected.tolist()
    assert not expected.all()


def test_director_of_another_length_than_one_is_out_of_range(load: Load) -> None:
    shape = Shape(n_in=4, n_out=2, n_inputs=2, features="director", block=False)
    unit = Affine.of_channels([0.0, 0.0], [1.0, 1.0])
    signals = tuple(
        dataclasses.replace(signal, low=-1.0, high=1.0, start=float(start))
        for signal, start in zip(random_surrogate(shape).inputs, (1, 0), strict=True)
    )
    surrogate = dataclasses.replace(random_surrogate(shape), inputs=signals, input_scaling=unit)
    angles, lengths = 0.3 * np.arange(30), np.ones(30)
    lengths[[5, 15, 25]] = [1.009, 1.02, 0.95]
    rows = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=1)
    expected = [not (15 <= k < 18 or 25 <= k < 28) for k in range(30)]
    assert flags(load(surrogate), rows) == expected
    assert surrogate.inputs_in_range(rows).tolist() == expected


def test_flag_after_a_restored_state_is_that_of_the_state(load: Load) -> None:
    loaded = load(wide_surrogate(Shape(n_in=6, n_out=2, cell=CellShape())))
    native, place = loaded.instance().start(), reference(loaded.surrogate)
    native.step(1.0)
    inside = native.save()
    native.step(9.0)
    outside = native.save()
    assert native.restore(inside) == OK
    assert native.get(place) == [1.0]
    assert native.restore(outside) == OK
    assert native.get(place) == [0.0]
    native.call("fmi2Reset")
    native.start()
    assert native.get(place) == [1.0]
