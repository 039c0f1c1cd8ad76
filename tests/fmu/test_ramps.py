"""Held inputs that move again after a rest: a ramp is told from stairs four points late."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from tests.bounded import bounded_surrogate
from tests.fmu.any_step import FORGETFUL, go
from tests.fmu.derivatives import derivative
from tests.fmu.native import OK, Load, Native
from tests.fmu.samples import STEP, Shape, random_surrogate

SHAPE = Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL)
CUBIC = dataclasses.replace(SHAPE, cell=dataclasses.replace(FORGETFUL, activation="cubic"))


def of_first(surrogate_shape: Shape, values: list[float]) -> FloatArray:
    """Inputs of which the second rests, (n, 2)."""
    scaled = np.stack([values, np.zeros(len(values))], axis=1)
    return np.asarray(random_surrogate(surrogate_shape).input_scaling.invert(scaled))


def goes(native: Native, rows: FloatArray, parts: int, count: int) -> list[list[float]]:
    """Values of so many variables after steps of a part of h."""
    values: list[list[float]] = go(native, [1 / parts] * len(rows), rows, count).tolist()
    return values


@pytest.mark.parametrize("rest", [6.0, 12.0])
def test_ramp_after_a_rest_is_right_where_short_steps_are_joined(load: Load, rest: float) -> None:
    """From h/32 on, several steps make one of the history; the rest is one in any case."""

    def value(time: float) -> float:  # in h
        before = 0.5 * np.sin(0.5 * (time - 20 + rest))
        return float(before if time < 20 - rest else max(0.1 * (time - 20), 0.0))

    loaded, found = load(random_surrogate(SHAPE)), []
    for parts in (20, 100):
        rows = of_first(SHAPE, [value(k / parts) for k in range(30 * parts)])
        native = loaded.instance(held=False).start()
        found.append(np.array(goes(native, rows, parts, 2))[parts - 1 :: parts])
    assert np.ptp(found[0]) > 0.5
    # in the first sample, nothing tells yet that the input moves
    np.testing.assert_allclose(found[1][1:], found[0][1:], rtol=0, atol=0.02)


@pytest.mark.parametrize("parts", [1, 4])
def test_derivatives_that_are_read_change_nothing(load: Load, parts: int) -> None:
    """Under inputs that were moved, one more change may make a ramp of stairs."""
    loaded = load(random_surrogate(SHAPE))
    rng, most = np.random.default_rng(3), 0.0
    for changes in itertools.product([0.0, 0.1, 0.2], repeat=3):
        course = np.cumsum([*changes, 0.3, 0.1])
        values = [0.0] * 14 + course.tolist() + [float(course[-1])] * 4
        rows = of_first(SHAPE, values + rng.uniform(-1, 1, 6 * parts).tolist())
        plain, reads = (loaded.instance(held=False).start() for _ in range(2))
        expected = goes(plain, rows, parts, 2)
        for row, outputs in zip(rows, expected, strict=True):
            assert goes(reads, row[None], parts, 2) == [outputs]
            most = max(most, np.abs(derivative(reads, 2, np.array([1.0, 0.0]))).max())
    assert most > 0


@pytest.mark.parametrize("parts", [2, 5, 10])
def test_refused_step_that_would_have_told_of_a_ramp_changes_nothing(
    load: Load, parts: int
) -> None:
    surrogate = bounded_surrogate(CUBIC, (2, 5))
    loaded = load(surrogate)
    rows = of_first(CUBIC, [0.0] * 12 * parts + [0.1, 0.2, 0.3])
    after = of_first(CUBIC, [-0.5, 0.4, -0.3, 0.2, 0.9, -0.9] * parts)
    wrong, (first, _) = 1e30, of_first(CUBIC, [0.4])[0]
    kinds = [variable.kind.key for variable in fmu_variables(surrogate, 2)]
    bounds = kinds.index("ERROR_BOUND"), kinds.count("ERROR_BOUND")
    found: list[list[list[float]]] = []
    for refused in (False, True):
        native = loaded.instance(held=False).start()
        goes(native, rows, parts, 2)
        if refused:
            assert native.set(first, wrong) == OK
            assert native.do_step(native.time(), STEP / parts) != OK
        found.append([])
        for row in after:
            goes(native, row[None], parts, 2)
            found[-1].append(native.get(*bounds))
    assert np.ptp(found[0]) > 0
    assert found[1] == found[0]
