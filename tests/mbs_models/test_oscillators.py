"""The oscillators against closed forms, energy, statics and other integrators."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from mbs_models.oscillators.oscillators import (
    DuffingBaseMotion,
    DuffingOscillator,
    LinearOscillator,
)
from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.systems.base import State, System
from slide_fmu.systems.simulation import simulate

K, D, ALPHA = 1600.0, 8.0, 0.5
CLOSED_FORM = 1e-9
"""Of the response's RMS: what the default substeps leave (measured: 3e-10)."""
ROUNDING = 1e-11
"""Two orders of the same floating point operations, carried along a few hundred steps."""
ALL = [LinearOscillator, DuffingOscillator, DuffingBaseMotion]


def state(x: float, v: float, last: float = 0.0) -> State:
    return State(np.array([x]), np.array([v]), np.array([last]))


def inputs_of(system: System, count: int, seed: int = 0) -> FloatArray:
    signal = system.inputs[0]
    return np.random.default_rng(seed).uniform(signal.low, signal.high, (count, 1))


def deviation(found: FloatArray, expected: FloatArray) -> float:
    return float(np.max(np.abs(found - expected)) / np.sqrt(np.mean(expected**2)))


def test_linear_oscillator_is_the_exact_response_to_held_forces() -> None:
    system = LinearOscillator()
    inputs = inputs_of(system, 2000)
    found = simulate(system, inputs, state(0.3, -5.0)).outputs[:, 0]
    step = expm(np.array([[0, 1, 0], [-K, -D, 1], [0, 0, 0]]) * system.step)
    z, expected = np.array([0.3, -5.0, 0.0]), [0.3]
    for force in inputs[:, 0]:
        z[2] = force
        z = step @ z
        expected.append(z[0])
    assert deviation(found, np.array(expected)) < CLOSED_FORM


def test_base_motion_with_a_linear_spring_is_the_exact_response_to_ramps() -> None:
    system = DuffingBaseMotion(alpha=0.0)
    inputs = inputs_of(system, 500)
    found = simulate(system, inputs, state(0.3, -5.0, 0.1)).outputs[:, 0]
    rates = np.array([[0, 1, 0, 0], [-K, -D, K, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
    step = expm(rates * system.step)
    z, expected = np.array([0.3, -5.0, 0.1, 0.0]), [0.3]
    for base in inputs[:, 0]:
        z[3] = (base - z[2]) / system.step
        z = step @ z
        expected.append(z[0])
    assert deviation(found, np.array(expected)) < CLOSED_FORM


@pytest.mark.parametrize("system", [DuffingOscillator(), DuffingBaseMotion()])
def test_duffing_agrees_with_another_integrator(system: System) -> None:
    inputs = inputs_of(system, 100)
    ramp = hold_of(system.inputs) == "first_order"
    z, last, expected = np.array([0.8, -8.0]), 0.05, [0.8]
    for value in inputs[:, 0]:

        def rates(t: float, z: FloatArray, last: float = last, value: float = value) -> FloatArray:
            base = last + (value - last) * t / system.step if ramp else 0.0
            s = z[0] - base
            return np.array(
                [z[1], (0.0 if ramp else value) - K * s * (1 + ALPHA * s**2) - D * z[1]]
            )

        z = solve_ivp(rates, (0, system.step), z, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        last = value
        expected.append(z[0])
    found = simulate(system, inputs, state(0.8, -8.0, 0.05)).outputs[:, 0]
    assert deviation(found, np.array(expected)) < 1e-8


def test_substeps_converge_with_the_sixth_order() -> None:
    def run(substeps: int) -> FloatArray:
        system = DuffingOscillator(substeps=substeps)
        return simulate(system, inputs_of(system, 50), state(0.5, 0.0)).outputs

    exact = run(96)
    errors = [np.max(np.abs(run(substeps) - exact)) for substeps in (10, 20)]
    assert 2**5 < errors[0] / errors[1] < 2**7.5


def test_duffing_without_damping_keeps_its_energy() -> None:
    system = DuffingOscillator(damping=0.0)
    system.set_state(state(1.0, 4.0))
    energies = []
    for _ in range(300):
        now = system.get_state()
        x, v = now.coordinates[0], now.velocities[0]
        energies.append(v**2 / 2 + K * x**2 / 2 + ALPHA * K * x**4 / 4)
        system.advance(np.zeros(1))
    assert np.ptp(energies) < 1e-6 * energies[0]


@pytest.mark.parametrize("force", [-1000.0, -1.0, 0.0, 1e-3, 300.0, 5000.0])
def test_duffing_at_rest_solves_the_cubic_equation(force: float) -> None:
    system = DuffingOscillator(damping=80.0)
    x = system.rest_state(np.array([force])).coordinates[0]
    assert K * x + ALPHA * K * x**3 == pytest.approx(force, rel=1e-12, abs=1e-12)
    settled = simulate(system, np.full((100, 1), force), state(0.1, 0.0)).outputs[-1, 0]
    assert settled == pytest.approx(x, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("make", ALL)
def test_rest_state_stays_where_it_is(make: type[System]) -> None:
    system = make()
    held = np.array([0.5 * system.inputs[0].high])
    start = system.rest_state(held)
    outputs = simulate(system, np.tile(held, (50, 1)), start).outputs
    assert np.max(np.abs(outputs - start.coordinates)) < 1e-12


@pytest.mark.parametrize("make", ALL)
def test_linearization_is_the_analytic_one(make: type[System]) -> None:
    system = make()
    system.set_state(state(0.2, 1.0))
    found = system.linearize(state(0.7, 3.0, 0.1))
    s = 0.7 - (0.1 if hold_of(system.inputs) == "first_order" else 0.0)
    alpha = 0.0 if make is LinearOscillator else ALPHA
    assert found.mass == pytest.approx(1.0)
    assert found.damping == pytest.approx(D, rel=1e-5)
    assert found.stiffness == pytest.approx(K * (1 + 3 * alpha * s**2), rel=1e-5)
    assert found.constraints.shape == (0, 1)
    assert system.get_state().coordinates[0] == 0.2
    assert deviation(system.advance(np.zeros(1)), simulate_one(make, state(0.2, 1.0))) == 0.0


def simulate_one(make: type[System], start: State) -> FloatArray:
    system = make()
    system.set_state(start)
    return system.advance(np.zeros(1))


@pytest.mark.parametrize("make", ALL)
def test_continuing_and_pickling_equal_one_go(make: type[System]) -> None:
    system, other = make(), make()
    inputs = inputs_of(system, 60)
    start = system.random_state(np.random.default_rng(1))
    whole = simulate(system, inputs, start).outputs
    simulate(system, inputs[:20], start)
    simulate(other, inputs[::-1], start)
    copy = pickle.loads(pickle.dumps(system))
    assert np.array_equal(np.array([copy.advance(u) for u in inputs[20:]]), whole[21:])
    assert np.array_equal(np.array([system.advance(u) for u in inputs[20:]]), whole[21:])


@pytest.mark.parametrize("make", ALL)
def test_random_states_fill_their_range(make: type[System]) -> None:
    rng = np.random.default_rng(0)
    states = [make().random_state(rng) for _ in range(300)]
    reach = np.max([np.abs([s.coordinates[0], s.velocities[0]]) for s in states], axis=0)
    limits = np.array([0.5, 0.5] if make is LinearOscillator else [1.0, 10.0])
    assert np.all((0.95 * limits < reach) & (reach <= limits))
