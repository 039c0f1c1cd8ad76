"""Directional derivatives of the FMU: outputs after a step by the inputs that it took in."""

from __future__ import annotations

import ctypes
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE
from slide_fmu.fmu.description.fmi2 import fmu_variables
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.gradient import jacobian
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import n_phases
from tests.fmu.derivatives import (
    FAMILIES,
    ROUNDED,
    SHAPE,
    derivative,
    derivative_of,
    derivatives,
    inputs_for,
    surrogate_of,
)
from tests.fmu.native import DISCARD, ERROR, OK, ExportedFmu, Load, Native
from tests.fmu.plain import five_point_slope, plain_features, plain_layers, plain_pair
from tests.fmu.samples import SEEN, STEP, CellShape, Shape, random_surrogate
from tests.marks import every

SINGLE = 2e-5
"""Of single precision, relative to the largest derivative of an input sample."""

OF_WINDOW = 0.01
"""What random networks, which forget slowly, know of inputs before their window."""

CASES = list(itertools.product(SEEN, FAMILIES))
NAMES = [" ".join(case) for case in CASES]
LENGTHS = [1, 1, 3, 0.02, 0.01, 1, 0.6, 1, 5, 1, 2.3, 1, 0.5, 0.5, 0.5, 1, 8, 1.5, 1, 7.7, 1, 1]
"""Steps in units of h; shorter ones than 1/32 are joined to the next."""


def plain_newest(surrogate: Surrogate, record: FloatArray) -> FloatArray:
    """The newest output after a record, in double precision as the FMU runs its networks."""
    network, n = surrogate.network, surrogate.network.n_samples
    scaled = surrogate.input_scaling.apply(record)
    if isinstance(network, StateSpace):
        held = np.repeat(scaled[:1], 2 * n - 1, axis=0)
        features = plain_features(network.features, np.concatenate([held, scaled]))
        values = plain_pair(network, features)[0][-1]
    else:
        assert isinstance(network, FeedForward)
        held = np.repeat(scaled[:1], n + BEFORE, axis=0)
        features = plain_features(network.features, np.concatenate([held, scaled])[-n - BEFORE :])
        values = plain_layers(network, features[-n:])[-len(surrogate.outputs) :]
    return np.asarray(surrogate.output_scaling.invert(values))


@pytest.mark.parametrize(("seen", "family"), every(3, CASES), ids=NAMES)
def test_derivatives_are_those_of_plain_loops(load: Load, seen: str, family: str) -> None:
    """After single steps, at all ages of the younger state."""
    surrogate = surrogate_of(seen, family)
    native, inputs = load(surrogate).instance().start(), inputs_for(surrogate, 21)
    for k, row in enumerate(inputs):
        native.step(*row)
        if k not in (0, 1, 4, 7, 8, 9, 20):
            continue
        direction = np.linspace(-1, 0.6, len(row))
        moved = np.zeros(inputs[: k + 1].shape)
        moved[k] = direction
        expected = five_point_slope(
            lambda amount, k=k, d=moved: plain_newest(surrogate, inputs[: k + 1] + amount * d)
        )
        found = derivative(native, 2, direction)
        allowed = SINGLE * max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(found, expected, rtol=SINGLE, atol=allowed)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
@pytest.mark.parametrize(("seen", "family"), every(3, CASES), ids=NAMES)
def test_derivatives_are_those_of_the_fmu(load: Load, seen: str, family: str, hold: str) -> None:
    """Finite differences by rollback, over steps of all lengths; inputs set later do not count."""
    surrogate = surrogate_of(seen, family, hold=hold, n_in=24)
    native, count = load(surrogate).instance().start(), len(surrogate.inputs)
    distance = 2e-4 if seen == "chain" else 2e-3
    rows = inputs_for(surrogate, len(LENGTHS))
    rows[6] = rows[5]  # held inputs that stay: the steps are joined
    for row, length in zip(rows, LENGTHS, strict=True):
        before, direction = native.save(), np.linspace(0.7, -1, count)

        def output(amount: float, row: FloatArray = row, length: float = length) -> FloatArray:
            assert native.restore(before) == OK  # noqa: B023 (called within this turn)
            assert native.set(*(row + amount * direction)) == OK  # noqa: B023
            assert native.do_step(native.time(), length * STEP) == OK, native.messages
            return np.array(native.get(count, 2))

        expected = five_point_slope(output, distance)
        values = output(0.0)
        native.set(*(0.5 * row))
        found = derivative(native, 2, direction)
        allowed = 20 * ROUNDED * (1 + np.abs(values).max()) / distance
        if "cell" in family and n_phases(length) == 0:
            allowed += OF_WINDOW  # between phases, derivatives are those of the window
        np.testing.assert_allclose(found, expected, rtol=2e-2, atol=allowed)
        assert native.get(count, 2) == list(values)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
@pytest.mark.parametrize("family", ["tanh cell", "elu, skip"])
def test_derivatives_of_diagnostics_are_those_of_the_fmu(
    load: Load, family: str, hold: str
) -> None:
    """Estimates and truncation errors by rollback; what tells about the window is constant."""
    surrogate = surrogate_of("differences", family, hold=hold)
    native, count = load(surrogate).instance().start(), len(surrogate.inputs)
    variables = list(enumerate(fmu_variables(surrogate)))[count + len(surrogate.outputs) :]
    names = {
        index: variable.name for index, variable in variables if variable.causality == "output"
    }
    unknowns = list(names)
    seen, distance, direction = np.zeros(len(unknowns)), 2e-3, np.linspace(0.7, -1, count)
    for row, length in zip(inputs_for(surrogate, len(LENGTHS)), LENGTHS, strict=True):
        before = native.save()

        def values(amount: float, row: FloatArray = row, length: float = length) -> FloatArray:
            assert native.restore(before) == OK  # noqa: B023 (called within this turn)
            assert native.set(*(row + amount * direction)) == OK
            assert native.do_step(native.time(), length * STEP) == OK, native.messages
            return np.array([native.get(reference)[0] for reference in unknowns])

        expected = five_point_slope(values, distance)
        present = values(0.0)
        found = derivative_of(native, unknowns, direction)
        allowed = 20 * ROUNDED * (1 + np.abs(present).max()) / distance
        np.testing.assert_allclose(found, expected, rtol=2e-2, atol=allowed)
        seen = np.maximum(seen, np.abs(found))
    ends = ("_error_estimate", "_truncation_error")
    assert list(seen > 0) == [name.endswith(ends) for name in names.values()]


def test_derivative_after_one_step_is_the_newest_column_of_the_gradient(load: Load) -> None:
    """Layers that see the inputs alone: their gradient by the newest input."""
    surrogate = surrogate_of("inputs", "elu block")
    native, rows = load(surrogate).instance().start(), inputs_for(surrogate, 21)
    for row in rows:
        native.step(*row)
    expected = jacobian(surrogate, rows[None, -surrogate.window.n_in :])[0, -1, :, -1]
    found = derivatives(native, 2, 2)
    np.testing.assert_allclose(found, expected, rtol=SINGLE, atol=SINGLE)


@pytest.mark.parametrize("family", ["elu block", "gated cell"])
def test_derivatives_before_the_first_step_are_those_of_held_inputs(
    load: Load, family: str
) -> None:
    """Outputs as if the start inputs had been held for ever; so are those after the first step."""
    surrogate = surrogate_of("inputs", family)
    native, row = load(surrogate).instance().start(), inputs_for(surrogate, 1)[0]
    native.set(*row)
    start = derivatives(native, 2, 2)
    for i in range(2):
        expected = five_point_slope(
            lambda amount, i=i: plain_newest(surrogate, row[None] + amount * np.eye(2)[i])
        )
        np.testing.assert_allclose(start[:, i], expected, rtol=SINGLE, atol=SINGLE)
    native.step()
    assert np.array_equal(derivatives(native, 2, 2), start)


def test_derivatives_are_linear_and_belong_to_the_state(load: Load) -> None:
    surrogate = surrogate_of("chain", "gated cell", hold="first_order")
    loaded = load(surrogate)
    native, other = loaded.instance().start(), loaded.instance()
    for row in inputs_for(surrogate, 12):
        native.step(*row)
    native.set(*inputs_for(surrogate, 1)[0])
    assert native.do_step(native.time(), 2 * STEP) == OK
    saved, found = native.save(), derivatives(native, 3, 2)
    assert native.save() == saved
    direction = np.array([0.3, -2.0, 1.1])
    together = derivative(native, 2, direction)
    np.testing.assert_allclose(together, found @ direction, rtol=1e-6, atol=1e-7)
    assert other.restore(saved) == OK
    assert np.array_equal(derivatives(other, 3, 2), found)


def test_failed_step_leaves_the_derivatives(load: Load) -> None:
    """To the bit, whether the phase of the present went on or another one."""
    surrogate = surrogate_of("inputs", "cubic cell")
    native = load(surrogate).instance().start()
    for row in inputs_for(surrogate, 5):
        native.step(*row)
    found = derivatives(native, 2, 2)
    native.set(1e30, -1e30)
    for length in (STEP, 2 * STEP, 1.7 * STEP):
        assert native.do_step(native.time(), length) == ERROR
        assert np.array_equal(derivatives(native, 2, 2), found)


def test_newton_finds_the_input_for_a_wanted_output(load: Load) -> None:
    surrogate = random_surrogate(
        replace(SHAPE, n_outputs=1, cell=CellShape(4, 9, contraction=0.8, roles=True), seed=5)
    )
    native = load(surrogate).instance().start()
    native.step(0.4)
    before, u = native.save(), 0.4
    native.step(1.2)
    wanted = native.get(1)[0]
    for _ in range(6):
        assert native.restore(before) == OK
        native.set(u)
        assert native.do_step(STEP) == OK
        u -= (native.get(1)[0] - wanted) / derivative(native, 1, np.ones(1))[0]
    assert u == pytest.approx(1.2, abs=1e-4)


def test_derivatives_that_are_not_finite_are_refused(rich: ExportedFmu) -> None:
    native = rich.instance().start()
    native.step(0.3, 0.4)
    one, references = ctypes.c_size_t(1), [native.places.references([k]) for k in (2, 0)]
    arguments = references[0], one, references[1], one
    for seed, status in ((1e3, OK), (1e308, DISCARD)):
        numbers = (ctypes.c_double * 1)(seed), (ctypes.c_double * 1)()
        assert native.call("fmi2GetDirectionalDerivative", *arguments, *numbers) == status
    assert "a derivative is not finite; expected smaller seeds" in native.messages[-1]


def test_derivatives_of_unknown_variables_or_without_values_are_refused(load: Load) -> None:
    surrogate = surrogate_of("inputs", "gated cell")
    native = load(surrogate).instance()
    one, number = ctypes.c_size_t(1), (ctypes.c_double * 1)(1.0)

    def ask(unknown: int, known: int, seed: object = number, result: object = number) -> int:
        references = [native.places.references([place]) for place in (unknown, known)]
        return native.call(
            "fmi2GetDirectionalDerivative", references[0], one, references[1], one, seed, result
        )

    assert ask(2, 0) == ERROR
    assert "instantiated" in native.messages[-1]
    native.start().step(0.3, 0.4)
    assert ask(2, 2) == ERROR
    (output,) = native.places.references([2])
    assert f"known with value reference {output}; expected inputs, 0 to 1" in native.messages[-1]
    for unknown in (0, 1, 4_000_000_000):
        assert ask(unknown, 0) == ERROR
        (reference,) = native.places.references([unknown])
        assert (
            f"unknown with value reference {reference}; expected a scalar output"
            in native.messages[-1]
        )
    assert ask(2, 0, (ctypes.c_double * 1)(math.nan)) == ERROR
    assert "not finite" in native.messages[-1]
    assert ask(2, 0, None) == ERROR
    assert ask(2, 0, number, None) == ERROR
    none, unknown = ctypes.c_size_t(0), native.places.references([2])
    for reference, result in ((unknown, None), (None, number)):
        arguments = (reference, one, None, none, None, result)
        assert native.call("fmi2GetDirectionalDerivative", *arguments) == ERROR
    assert ask(2, 0) == OK
    native.call("fmi2Terminate")
    assert ask(2, 0) == OK


def test_derivatives_after_a_first_step_longer_than_a_short_window(load: Load) -> None:
    """All samples were taken in anew, also those that the next ones may change."""
    shape = Shape(n_in=2, n_out=1, n_inputs=2, n_outputs=2, cell=CellShape(4, 9, contraction=0.6))
    loaded, inputs = load(random_surrogate(shape)), np.array([0.4, 0.7])

    def after(moved: FloatArray) -> Native:
        native = loaded.instance().start()
        assert native.set(*moved) == OK
        assert native.do_step(0.0, 40 * STEP) == OK
        return native

    found = derivatives(after(inputs), 2, 2)
    for i, direction in enumerate(3e-3 * np.eye(2)):
        change = [np.array(after(inputs + sign * direction).get(2, 2)) for sign in (1, -1)]
        np.testing.assert_allclose(found[:, i], (change[0] - change[1]) / 6e-3, atol=1e-3)
