"""Inputs before the start that are known: the parameters prehistory_known and initial_<input>."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import Hold
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.description.variables import PREHISTORY_KNOWN
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import outputs_of_steps
from tests.fmu.derivatives import derivatives
from tests.fmu.native import DISCARD, ERROR, OK, Load, Native
from tests.fmu.samples import CellShape, Shape, random_surrogate

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, differences=2, positions=3),
    "cell": Shape(n_inputs=2, n_outputs=2, differences=1, cell=CellShape(), positions=3),
    "director": Shape(n_inputs=2, n_outputs=2, features="director"),
}
BEFORE_START = (0.7, -0.4)


def reference(surrogate: Surrogate) -> int:
    return [variable.name for variable in fmu_variables(surrogate)].index(PREHISTORY_KNOWN)


def know(native: Native, surrogate: Surrogate, *inputs: float) -> int:
    return native.set(1.0, *inputs, first=reference(surrogate))


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
@pytest.mark.parametrize("length", [1.0, 3.0, 0.6])
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_start_with_initial_inputs_is_as_if_the_fmu_had_run_on_them(
    load: Load, shape: Shape, length: float, hold: Hold
) -> None:
    surrogate = random_surrogate(replace(shape, hold=hold))
    loaded, rows = load(surrogate), np.random.default_rng(3).uniform(0.2, 1, (12, 2))
    knowing, earlier = loaded.instance(), loaded.instance().start()
    assert know(knowing, surrogate, *BEFORE_START) == OK
    found = outputs_of_steps(knowing.start(), rows, length)
    outputs_of_steps(earlier, np.array([BEFORE_START]), 1.0)
    expected = outputs_of_steps(earlier, rows, length)
    assert np.array_equal(found, expected)
    same = pytest.approx(derivatives(earlier, 2, 2), rel=1e-7, abs=1e-9)
    assert derivatives(knowing, 2, 2) == same
    without = outputs_of_steps(loaded.instance().start(), rows, length)
    assert not np.allclose(found[0], without[0])


def test_outputs_at_the_start_are_those_of_the_initial_inputs(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["layers"])
    loaded = load(surrogate)
    knowing, held, filled = loaded.instance(), loaded.instance().start(), 6
    assert fmu_variables(surrogate)[filled].name == "window_filled"
    assert know(knowing, surrogate, *BEFORE_START) == OK
    knowing.start().set(0.1, 0.2)
    held.set(*BEFORE_START)
    assert knowing.get(2, 4) == held.get(2, 4)
    assert knowing.get(filled, 2) == [1.0, 1.0]
    assert held.get(filled, 2) == [0.0, 0.0]
    assert knowing.get(reference(surrogate), 3) == [1.0, *BEFORE_START]
    assert np.array_equal(derivatives(knowing, 2, 2), np.zeros((2, 2)))


def test_initial_inputs_that_are_not_switched_on_change_nothing(load: Load) -> None:
    """Tools that set every parameter to its start value do no harm."""
    surrogate = random_surrogate(SHAPES["cell"])
    loaded, rows = load(surrogate), np.random.default_rng(3).uniform(0.2, 1, (5, 2))
    native = loaded.instance()
    variables = fmu_variables(surrogate)[reference(surrogate) :]
    starts = [float(variable.start or 0.0) for variable in variables]
    assert native.set(*starts, first=reference(surrogate)) == OK
    assert native.set(*BEFORE_START, first=reference(surrogate) + 1) == OK
    expected = outputs_of_steps(loaded.instance().start(), rows, 1.0)
    assert np.array_equal(outputs_of_steps(native.start(), rows, 1.0), expected)


def test_initial_inputs_with_impossible_values_or_after_the_start_are_refused(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["layers"])
    first, native = reference(surrogate), load(surrogate).instance()
    for value in (0.5, 2.0, math.nan):
        assert native.set(value, first=first) == DISCARD
        assert "expected 0 or 1" in native.messages[-1]
    assert native.set(math.inf, first=first + 1) == DISCARD
    behind = len(fmu_variables(surrogate))
    assert native.set(0.0, *BEFORE_START, 1.0, 1.0, first=behind - 4) == ERROR
    assert native.set(0.0, *BEFORE_START, first=first) == OK
    native.start()
    assert native.set(1.0, first=first) == ERROR
    assert "is a parameter; set it before the end of initialization mode" in native.messages[-1]
    native.call("fmi2Reset")
    know(native, surrogate, *BEFORE_START)
    native.call("fmi2Reset")
    starts = [signal.start_value for signal in surrogate.inputs]
    native.start()
    assert native.get(first, 3) == [0.0, *starts]


def test_failed_first_step_after_initial_inputs_is_undone(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["director"])
    native = load(surrogate).instance()
    know(native, surrogate, 0.0, 0.0)
    native.start().set(0.6, 0.8)
    before = native.save()
    assert native.do_step(0.0) == ERROR
    assert "gives no direction" in native.messages[-1]
    assert native.save() == before
