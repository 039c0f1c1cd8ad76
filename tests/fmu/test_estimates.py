"""Error estimates are found when they are read: the same whenever and however often that is."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import ERROR_TOLERANCE
from tests.fmu.any_step import outputs_and_some
from tests.fmu.native import ERROR, OK, Load, Native
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate

LONG = Shape(n_inputs=2, n_outputs=2, positions=31, estimator_samples=5, differences=2)
"""Averages over more samples than the window has."""

SHAPES = {
    "long_span": LONG,
    "short_span": Shape(n_inputs=2, n_outputs=2, positions=3, means=True, hold="first_order"),
    "ages": dataclasses.replace(LONG, estimator_samples=12, ages=4),
    "one_position": dataclasses.replace(LONG, positions=1, hold="first_order"),
    "cell": dataclasses.replace(LONG, cell=CellShape(contraction=0.9), hold="first_order"),
    "chain": dataclasses.replace(LONG, features="chain", positions=7),
    "forecast": dataclasses.replace(
        LONG, positions=4, narrow=True, hold="first_order", forecasts=True
    ),
}
PATTERNS: dict[str, list[float]] = {
    "single": [1] * 120,
    "several": [1, 2, 3, 12, 1, 1, 5] * 17,
    "odd": [1, 1, 0.6, 1, 1, 1, 2, 0.25, 40, 1] * 12,
    "first_is_odd": [0.6, *[1] * 119],
    "first_is_long": [30.5, *[1] * 119],
}


def go(
    native: Native, lengths: Iterable[float], reads: Callable[[int], bool]
) -> tuple[FloatArray, dict[int, list[float]]]:
    """Steps under made-up inputs: all outputs, and the estimates where they are read."""
    return outputs_and_some(native, lengths, reads, lambda: native.get(4, 2))


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_estimates_are_the_same_whenever_they_are_read(
    load: Load, shape: Shape, pattern: str
) -> None:
    loaded, lengths = load(random_surrogate(shape)), PATTERNS[pattern]
    last = len(lengths) - 1
    expected, eager = go(loaded.instance().start(), lengths, lambda k: True)
    assert len({tuple(row) for row in eager.values()}) > 1
    for reads in (
        lambda k: k == last,
        lambda k: k % 7 == 0,
        lambda k: k % 45 == 3,
        lambda k: 40 <= k < 70,
        lambda k: False,
    ):
        outputs, estimates = go(loaded.instance().start(), lengths, reads)
        assert np.array_equal(outputs, expected)
        assert estimates == {k: eager[k] for k in estimates}


def test_estimates_read_one_by_one_and_twice_are_those_read_at_once(load: Load) -> None:
    native = load(random_surrogate(LONG)).instance().start()
    _, read = go(native, [1, 0.6, 1], lambda k: k > 1)
    assert [native.get(5), native.get(4), native.get(4)] == [[read[2][1]], *[[read[2][0]]] * 2]
    saved = native.save()
    native.get(4, 2)
    assert native.save() == saved


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("read_before", [False, True])
def test_estimates_due_when_a_state_is_saved_are_due_after_it_is_restored(
    load: Load, shape: Shape, read_before: bool
) -> None:
    """Estimates that are due when a state is saved are due after it is restored."""
    loaded = load(random_surrogate(shape))
    one, other = loaded.instance().start(), loaded.instance().start()
    go(other, [1, 0.3, 7, 1], lambda k: k == 2)  # whatever it remembers must not matter
    for lengths in ([1.0] * 9, [0.6] * 3, [1.0] * 40, [2, 1.5, 1], [100.0]):
        go(one, lengths, lambda k: read_before and k == 0)
        saved = one.save()
        found = one.get(4, 2)
        assert other.restore(saved) == OK
        assert other.get(4, 2) == found
        assert one.restore(saved) == OK
        assert one.get(4, 2) == found
        assert other.restore(saved) == OK
        ahead = [go(native, [1, 1, 0.7, 1], lambda k: k == 3) for native in (one, other)]
        assert np.array_equal(ahead[0][0], ahead[1][0])
        assert ahead[0][1] == ahead[1][1]


def test_reset_forgets_estimates_that_are_due(load: Load) -> None:
    loaded = load(random_surrogate(LONG))
    native, fresh = loaded.instance().start(), loaded.instance().start()
    go(native, [1.0] * 20, lambda k: k == 10)
    assert native.call("fmi2Reset") == OK
    native.start()
    assert native.get(4, 2) == fresh.get(4, 2)
    assert go(native, [1.0] * 40, lambda k: k == 39)[1] == go(fresh, [1.0] * 40, lambda k: True)[
        1
    ].fromkeys([39], native.get(4, 2))


@pytest.mark.parametrize("shape", [LONG, SHAPES["ages"], SHAPES["cell"]])
def test_estimates_before_the_first_step_are_those_of_held_inputs(
    load: Load, shape: Shape
) -> None:
    """Before the first step the inputs count as held for ever, whatever was read before."""
    surrogate = random_surrogate(shape)
    native = load(surrogate).instance().start()
    for inputs in ([0.5, 1.0], [-1.0, 2.0]):
        native.set(*inputs)
        expected = surrogate.estimate_error(np.array([inputs]))[0]
        assert native.get(4, 2) == pytest.approx(expected, rel=ERROR_TOLERANCE)


@pytest.mark.parametrize("length", [1.0, 2.0, 1.5])
def test_failed_step_keeps_estimates_that_are_due(load: Load, length: float) -> None:
    """Features overflow where the inputs do not."""
    shape = dataclasses.replace(LONG, features="chain", activation="tanh", hold="first_order")
    loaded = load(random_surrogate(shape))
    native, other = loaded.instance().start(), loaded.instance().start()
    for each in (native, other):
        go(each, [1.0] * 50, lambda k: k == 12)
    native.set(3e38, 0.2)
    assert native.do_step(native.time(), length * STEP) == ERROR
    assert native.get(4, 2) == other.get(4, 2)
    assert go(native, [1.0] * 3, lambda k: True)[1] == go(other, [1.0] * 3, lambda k: True)[1]


def test_estimate_of_features_that_are_not_finite_is_the_largest_error(load: Load) -> None:
    """Of the estimator alone; units that saturate must not hide them."""
    base = random_surrogate(Shape(activation="tanh"))
    shape = Shape(activation="tanh", positions=2, estimator_samples=3, features="chain")
    surrogate = dataclasses.replace(base, estimator=random_surrogate(shape).estimator)
    loaded = load(surrogate)
    native, fine = loaded.instance().start(), loaded.instance().start()
    assert surrogate.estimator is not None
    largest = 10**surrogate.estimator.log_error.high * surrogate.output_scaling.scale[0]
    for value in (1.0, 1.0, 3e38, -3e38):
        native.step(value)
    assert native.get(2) == pytest.approx([largest], rel=1e-12)
    for _ in range(12):
        native.step(1.0)
        fine.step(1.0)
    assert native.get(2) == pytest.approx(fine.get(2), rel=1e-12)
    assert native.get(2)[0] < largest


def test_a_surrogate_without_an_estimator_has_no_estimates(load: Load) -> None:
    native = load(sum_surrogate()).instance().start()
    native.step(1.0)
    assert native.get(2) == [0.25]  # window_filled
    assert native.get(3) == [1.0]  # inputs_in_range
