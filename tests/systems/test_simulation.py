"""A system whose states can be set keeps them along a motion, and goes on from each of them."""

from __future__ import annotations

import numpy as np
import pytest

from mbs_models.oscillators import DuffingOscillator
from mbs_models.slider_crank import SliderCrank
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import RandomStates, State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused
from tests.systems.function_models import specifications as models

STEPS, AT = 40, 17


def turning() -> FloatArray:
    angle = 0.002 * np.arange(STEPS) ** 2
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def pushed_mass() -> FunctionSystem:
    """A mass between two positions of rest, from its equations."""
    system = load_system(models.bistable())
    assert isinstance(system, FunctionSystem)
    return system


@pytest.mark.parametrize(
    ("system", "inputs", "tolerance"),
    [
        (DuffingOscillator(), np.random.default_rng(0).uniform(-900, 900, (STEPS, 1)), 1e-12),
        # accelerations are computed anew where it goes on
        (SliderCrank(elements=4, substeps=10), turning(), 1e-3),
    ],
    ids=["duffing", "slider_crank"],
)
def test_states_of_a_motion_are_those_from_which_it_goes_on(
    system: RandomStates, inputs: FloatArray, tolerance: float
) -> None:
    initial = system.random_state(np.random.default_rng(1), inputs[0])
    whole = simulate(system, inputs, initial).outputs
    states: list[State] = []
    outputs = simulate(system, inputs, initial, states).outputs
    assert np.array_equal(outputs, whole)
    assert len(states) == STEPS + 1
    others: list[State] = []
    rest = simulate(system, inputs[AT:], states[AT], others).outputs
    np.testing.assert_allclose(rest, whole[AT:], rtol=0, atol=tolerance * np.ptp(whole))
    assert np.array_equal(rest[0], whole[AT])
    assert np.array_equal(others[0].velocities, states[AT].velocities)


def test_states_are_kept_apart_from_the_system() -> None:
    system = pushed_mass()
    inputs = np.full((5, 1), 10.0)
    states: list[State] = []
    simulate(system, inputs, system.rest_state(np.zeros(1)), states)
    assert np.ptp([state.coordinates[0] for state in states]) > 0


def test_inputs_that_are_not_finite_are_refused_before_anything_runs() -> None:
    system = pushed_mass()
    inputs = np.array([[0.0], [np.nan]])
    with refused(ValueError, "inputs in sample 1"):
        simulate(system, inputs, system.rest_state(np.zeros(1)))


def test_motion_that_is_no_number_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    system = pushed_mass()
    monkeypatch.setattr(system, "output", lambda: np.array([np.nan]))
    with refused(SimulationError, "expected finite numbers"):
        simulate(system, np.zeros((2, 1)), system.rest_state(np.zeros(1)))
