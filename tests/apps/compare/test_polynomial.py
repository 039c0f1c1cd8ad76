"""ARX and NARX models by sysidentpy, in free simulation."""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest

from slide_fmu.apps.compare.baselines.base import Budget
from slide_fmu.apps.compare.baselines.polynomial import (
    MissingPackageError,
    count_terms,
    fit_arx,
    fit_narx,
    require_sysidentpy,
)
from tests.apps.compare.lessons import (
    cubic,
    error,
    lesson,
    linear,
    needs_sysidentpy,
    record,
    silent,
)
from tests.refusals import refused

LONG = 60.0


@needs_sysidentpy
def test_arx_of_a_linear_system_simulates_it_exactly() -> None:
    learnt = fit_arx(lesson(linear), Budget(LONG), silent)
    (inputs,), (outputs,) = record(linear, 1, 5)
    values = learnt.baseline.simulate(inputs, outputs[: learnt.baseline.start_length])
    assert values.shape == (200, 1)
    # the trajectories start at other places, but no row of the fit crosses from one to the next
    assert error(values, outputs[1:]) < 1e-9
    assert not learnt.cut


@needs_sysidentpy
def test_narx_finds_the_cubic_spring_that_arx_cannot_have() -> None:
    (inputs,), (outputs,) = record(cubic, 1, 5)
    errors = {}
    for fit in (fit_arx, fit_narx):
        model = fit(lesson(cubic), Budget(LONG), silent).baseline
        errors[fit] = error(model.simulate(inputs, outputs[: model.start_length]), outputs[1:])
    assert errors[fit_narx] < 1e-6
    assert errors[fit_arx] > 0.01


@needs_sysidentpy
def test_simulation_depends_on_inputs_and_the_start_alone() -> None:
    model = fit_arx(lesson(linear), Budget(LONG), silent).baseline
    (inputs,), (outputs,) = record(linear, 1, 5)
    start = outputs[: model.start_length]
    assert model.start_length <= 24
    other = model.simulate(inputs, start + 0.1)
    same = model.simulate(inputs, start)
    assert not np.allclose(other[model.start_length], same[model.start_length])
    np.testing.assert_allclose(other[-20:], same[-20:], atol=1e-6)  # the start is forgotten


@needs_sysidentpy
def test_first_outputs_of_a_simulation_are_the_start_that_was_given() -> None:
    model = fit_arx(lesson(linear), Budget(LONG), silent).baseline
    (inputs,), (outputs,) = record(linear, 1, 6)
    start = outputs[: model.start_length]
    np.testing.assert_array_equal(model.simulate(inputs, start)[: len(start) - 1], start[1:])


@pytest.mark.parametrize(("lags", "degree", "inputs", "terms"), [(1, 1, 1, 3), (2, 2, 1, 15)])
def test_terms_of_a_shape_are_counted_with_the_constant(
    lags: int, degree: int, inputs: int, terms: int
) -> None:
    assert count_terms(lags, degree, inputs) == terms


def test_missing_sysidentpy_is_told_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sysidentpy", None)
    with refused(MissingPackageError, "pip install 'slide-fmu[compare]'"):
        require_sysidentpy()


@needs_sysidentpy
def test_system_of_two_inputs_and_outputs_has_a_model_for_each_output() -> None:
    """Each output answers an input of its own, and the other one half as much."""
    inputs, first = record(linear, 4, 1)
    others, second = record(linear, 4, 7)
    u = np.concatenate([inputs, others], axis=2)
    y = np.concatenate([first + 0.5 * second, second + 0.5 * first], axis=2)
    two = dataclasses.replace(lesson(linear), training=(u, y), validation=(u[:2], y[:2]))
    model = fit_arx(two, Budget(LONG), silent).baseline
    values = model.simulate(u[3], y[3, : model.start_length])
    assert values.shape == (200, 2)
    for output in (0, 1):
        assert error(values[:, output], y[3, 1:, output]) < 1e-9, output
    # of an output's past, of both inputs' past, and a constant
    assert model.parameters == 2 * (3 * model.start_length + 1)
