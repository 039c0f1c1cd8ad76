"""The explicit methods take the steps of scipy's, and reach the same states."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.integration import EXPLICIT, MOST_STEPS, Rates, Solver
from tests.refusals import refused

DURATION = 0.02


def oscillator(stiffness: float) -> tuple[list[float], Rates]:
    """Give a list that gets the times of all calls, and the rates of a Duffing oscillator."""
    times: list[float] = []

    def rates(time: float, x: FloatArray) -> FloatArray:
        times.append(time)
        return np.array([x[1], np.sin(3 * time) - stiffness * x[0] - 5 * x[0] ** 3 - 2 * x[1]])

    return times, rates


@pytest.mark.parametrize("method", EXPLICIT)
@pytest.mark.parametrize("stiffness", [1.0, 1e4, 4e6])
def test_explicit_method_takes_the_steps_of_scipy(method: str, stiffness: float) -> None:
    start = np.array([0.3, -0.7])
    times, rates = oscillator(stiffness)
    found = Solver(method, 1e-6, 1e-9).integrate(rates, start, DURATION)
    expected_times, rates = oscillator(stiffness)
    options = {"rtol": 1e-6, "atol": 1e-9, "first_step": DURATION}
    solver = getattr(scipy.integrate, method)(rates, 0.0, start, DURATION, **options)
    while solver.status == "running":
        solver.step()
    assert found == pytest.approx(solver.y, rel=1e-12, abs=1e-14)
    if method == "DOP853":  # rates at the end of the interval, which no error needs, are left out
        times, expected_times = ([t for t in of if t < DURATION] for of in (times, expected_times))
    assert times == pytest.approx(expected_times, rel=1e-9)


@pytest.mark.parametrize("method", EXPLICIT)
def test_step_into_what_is_not_finite_is_shortened(method: str) -> None:
    def rates(time: float, x: FloatArray) -> FloatArray:
        return np.where(x < 1.5, 1.0, np.nan)

    found = Solver(method).integrate(rates, np.array([0.0]), 1.0)
    assert found == pytest.approx([1.0])


def test_number_of_steps_is_limited() -> None:
    calls = 0

    def rates(time: float, x: FloatArray) -> FloatArray:
        nonlocal calls
        calls += 1
        return np.array([np.sin(1e9 * time)])

    with refused(SimulationError, "RK45 gives up", f"more than {MOST_STEPS} steps"):
        Solver("RK45").integrate(rates, np.array([0.0]), 1.0)
    assert calls > 6 * MOST_STEPS
