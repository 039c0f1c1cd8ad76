"""The mass chain against matrices, energy, statics and another integrator."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from mbs_models.mass_chain.mass_chain import LOADED, OBSERVED, MassChain
from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.memory.modes import spectrum
from slide_fmu.systems.base import State
from slide_fmu.systems.simulation import simulate

M, K, D, DRAG, ALPHA = 1.0, 1600.0, 1.0, 6.0, 50.0
STRETCH = np.eye(7, 6) - np.eye(7, 6, k=-1)
"""Lengths of the seven springs from the positions of the six masses."""
LIMIT = 250.0
HARMONIC_SHARE = 0.15
"""Largest amplitude of the recipe's harmonic forces, of the range."""
WINDOW = 256
"""Truncated samples of the recipe's window."""
FORGOTTEN = 1e-3
"""The recipe's remaining amplitude."""


def loads(forces: FloatArray) -> FloatArray:
    """Forces on all masses in N, shape (6,)."""
    all_forces = np.zeros(6)
    all_forces[list(LOADED)] = forces
    return all_forces


def spring_forces(x: FloatArray) -> FloatArray:
    """Elastic forces on the masses in N at positions x in m, shape (6,) each."""
    s = STRETCH @ x
    return -STRETCH.T @ (K * s * (1.0 + ALPHA * s**2))


def matrices(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Analytic tangent damping and stiffness at positions x in m."""
    s = STRETCH @ x
    tangent = K * (1.0 + 3.0 * ALPHA * s**2)
    return D * STRETCH.T @ STRETCH + DRAG * np.eye(6), STRETCH.T @ (tangent[:, None] * STRETCH)


def random_state(seed: int = 1) -> State:
    return MassChain().random_state(np.random.default_rng(seed))


def inputs_of(count: int, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).uniform(-LIMIT, LIMIT, (count, 2))


def deviation(found: FloatArray, expected: FloatArray) -> float:
    return float(np.max(np.abs(found - expected)) / np.sqrt(np.mean(expected**2)))


def rates(z: FloatArray, force: FloatArray) -> FloatArray:
    """Time derivative of positions and velocities, shape (12,)."""
    x, v = z[:6], z[6:]
    damping = D * STRETCH.T @ STRETCH + DRAG * np.eye(6)
    return np.concatenate([v, (spring_forces(x) - damping @ v + force) / M])


def test_mass_chain_agrees_with_another_integrator() -> None:
    system, start, inputs = MassChain(), random_state(), inputs_of(120)
    z = np.concatenate([start.coordinates, start.velocities])
    expected = [z[list(OBSERVED)]]
    for row in inputs:
        force = loads(row)
        run = solve_ivp(
            lambda t, z, force=force: rates(z, force),
            (0, system.step),
            z,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
        )
        z = run.y[:, -1]
        expected.append(z[list(OBSERVED)])
    assert deviation(simulate(system, inputs, start).outputs, np.array(expected)) < 3e-8


def test_linear_chain_is_the_exact_response_to_held_forces() -> None:
    system, start, inputs = MassChain(alpha=0.0), random_state(), inputs_of(500)
    damping, stiffness = matrices(np.zeros(6))
    force = np.stack([loads(row) for row in np.eye(2)], axis=1)
    rate = np.block(
        [
            [np.zeros((6, 6)), np.eye(6), np.zeros((6, 2))],
            [-stiffness, -damping, force],
            [np.zeros((2, 14))],
        ]
    )
    step = expm(rate * system.step)
    z = np.concatenate([start.coordinates, start.velocities, np.zeros(2)])
    expected = [z[list(OBSERVED)]]
    for row in inputs:
        z = step @ np.concatenate([z[:12], row])
        expected.append(z[list(OBSERVED)])
    assert deviation(simulate(system, inputs, start).outputs, np.array(expected)) < 1e-8


def test_substeps_converge_with_the_sixth_order() -> None:
    def run(substeps: int) -> FloatArray:
        return simulate(MassChain(substeps=substeps), inputs_of(400), random_state()).outputs

    exact = run(32)
    assert deviation(run(12), exact) < 3e-8  # the default
    assert deviation(run(4), exact) < 2e-5  # the recipe
    assert 2**5 < deviation(run(4), exact) / deviation(run(8), exact) < 2**7.5


def test_without_damping_the_energy_stays() -> None:
    system, force = MassChain(damping=0.0, drag=0.0, substeps=24), np.array([100.0, -200.0])
    system.set_state(random_state())
    energies = []
    for _ in range(300):
        system.advance(force)
        now = system.get_state()
        s = STRETCH @ now.coordinates
        elastic = np.sum(K * s**2 / 2 + ALPHA * K * s**4 / 4)
        kinetic = M * np.sum(now.velocities**2) / 2
        energies.append(kinetic + elastic - loads(force) @ now.coordinates)
    assert np.ptp(energies) < 1e-6 * np.mean(energies)


@pytest.mark.parametrize("forces", [(250, 250), (-250, 250), (1e-3, 0), (0, 0), (0, -5e4)])
@pytest.mark.parametrize("alpha", [ALPHA, 0.0])
def test_rest_state_balances_the_forces(forces: tuple[float, float], alpha: float) -> None:
    system, held = MassChain(alpha=alpha), np.array(forces, dtype=np.float64)
    x = system.rest_state(held).coordinates
    s = STRETCH @ x
    elastic = STRETCH.T @ (K * s * (1.0 + alpha * s**2))
    assert elastic == pytest.approx(loads(held), abs=1e-11 * max(1.0, np.max(np.abs(held))))
    if np.max(np.abs(held)) <= LIMIT:
        outputs = simulate(system, np.tile(held, (50, 1)), system.rest_state(held)).outputs
        assert np.max(np.abs(outputs - x[list(OBSERVED)])) < 1e-12


def test_linearization_is_the_analytic_one() -> None:
    system = MassChain()
    system.set_state(random_state(2))
    at = random_state(3)
    found = system.linearize(at)
    damping, stiffness = matrices(at.coordinates)
    assert found.mass == pytest.approx(M * np.eye(6))
    assert np.max(np.abs(found.damping - damping)) < 1e-5 * np.max(damping)
    assert np.max(np.abs(found.stiffness - stiffness)) < 1e-5 * np.max(stiffness)
    assert found.constraints.shape == (0, 6)
    assert np.array_equal(system.get_state().coordinates, random_state(2).coordinates)


def test_modes_are_those_in_closed_form() -> None:
    modes = spectrum(MassChain().linearize(MassChain().rest_state(np.zeros(2))), 1e-3).modes
    # the eigenvalues of STRETCH^T STRETCH are known: 4 sin^2(j pi / 14)
    share = 4.0 * np.sin(np.arange(1, 7) * np.pi / 14.0) ** 2
    frequencies = np.array([mode.natural_frequency for mode in modes])
    assert frequencies == pytest.approx(np.sqrt(K * share / M), rel=1e-5)
    decay = np.array([mode.decay_time for mode in modes])
    assert decay == pytest.approx(2.0 * M * np.log(1e3) / (DRAG + D * share), rel=1e-5)
    assert frequencies[-1] * MassChain().step < 2.0 * np.pi / 5.0
    assert decay[0] < WINDOW * MassChain().step


def test_all_states_show_in_the_outputs_and_answer_the_forces() -> None:
    damping, stiffness = matrices(np.zeros(6))
    step = expm(
        np.block([[np.zeros((6, 6)), np.eye(6)], [-stiffness, -damping]]) * MassChain().step
    )
    scale = np.repeat([1.0, 40.0], 6)  # velocities against positions
    step = step * scale / scale[:, None]
    seen, driven = np.zeros((3, 12)), np.zeros((12, 2))
    seen[range(3), OBSERVED] = 1.0
    driven[[6 + index for index in LOADED], range(2)] = 1.0
    powers = [np.linalg.matrix_power(step, k) for k in range(50)]
    for shown in (np.vstack([seen @ p for p in powers]), np.hstack([p @ driven for p in powers])):
        assert np.linalg.cond(shown) < 50.0


def remaining_difference(inputs: FloatArray, seed: int, after: int) -> float:
    """RMS of the difference of two motions after a number of samples, of the one before it."""
    system, rng = MassChain(substeps=4), np.random.default_rng(seed)
    one, other = (simulate(system, inputs, system.random_state(rng)).outputs for _ in range(2))
    ahead = np.sqrt(np.sum((one - other) ** 2, axis=1))
    return float(np.linalg.norm(ahead[after:]) / np.linalg.norm(ahead[: after + 1]))


@pytest.mark.parametrize("seed", range(4))
def test_random_forces_have_one_response(seed: int) -> None:
    assert remaining_difference(inputs_of(2 * WINDOW, seed), seed, WINDOW) < FORGOTTEN


def harmonic(share: float, frequency: float, phase: float, count: int) -> FloatArray:
    """Harmonic forces of a share of the range, shifted against each other, shape (count, 2)."""
    time = MassChain().step * np.arange(count)
    return share * LIMIT * np.sin(frequency * time[:, None] + np.array([0.0, phase]))


@pytest.mark.parametrize(("frequency", "phase"), [(18.0, 0.0), (38.0, np.pi), (54.0, np.pi)])
def test_harmonic_forces_of_the_recipe_have_one_response(frequency: float, phase: float) -> None:
    inputs = harmonic(HARMONIC_SHARE, frequency, phase, 2 * WINDOW)
    assert remaining_difference(inputs, 0, WINDOW) < FORGOTTEN


@pytest.mark.extended
def test_stronger_harmonic_forces_have_several_responses() -> None:
    inputs = harmonic(1.0, 54.0, np.pi, 1600)
    assert max(remaining_difference(inputs, seed, 1200) for seed in range(4)) > 0.1


def test_the_cubic_share_matters() -> None:
    inputs, rest = inputs_of(2000), MassChain().rest_state(np.zeros(2))
    cubic, linear = (
        simulate(MassChain(alpha=alpha, substeps=4), inputs, rest).outputs[WINDOW:]
        for alpha in (ALPHA, 0.0)
    )
    assert np.std(cubic - linear) > 0.5 * np.std(cubic)
    assert np.std(cubic) < 0.92 * np.std(linear)
    assert np.all(np.max(np.abs(cubic), axis=0) < [s.high for s in MassChain().outputs])


def test_continuing_and_pickling_equal_one_go() -> None:
    system, other = MassChain(), MassChain()
    inputs, start = inputs_of(60), random_state()
    whole = simulate(system, inputs, start).outputs
    simulate(system, inputs[:20], start)
    simulate(other, inputs[::-1], start)
    copy = pickle.loads(pickle.dumps(system))
    assert np.array_equal(np.array([copy.advance(u) for u in inputs[20:]]), whole[21:])
    assert np.array_equal(np.array([system.advance(u) for u in inputs[20:]]), whole[21:])


def test_random_states_fill_their_range() -> None:
    states = [random_state(seed) for seed in range(300)]
    positions = np.max(np.abs([s.coordinates for s in states]), axis=0)
    speeds = np.max(np.abs([s.velocities for s in states]), axis=0)
    assert np.all((positions > 0.0475) & (positions <= 0.05))
    assert np.all((speeds > 1.9) & (speeds <= 2.0))


def test_signals_are_those_of_the_mass_chain() -> None:
    system = MassChain(force_limit=10.0, alpha=0.0, step=0.02)
    assert [s.name for s in system.inputs] == ["force_1", "force_4"]
    assert [s.name for s in system.outputs] == ["position_2", "position_4", "position_6"]
    assert {(s.low, s.high, s.unit) for s in system.inputs} == {(-10.0, 10.0, "N")}
    # linear: under 10 N on masses 1 and 4 the springs carry 90, 20, 20, 20, -50, ... N / 7
    reach = 1.5 * 150.0 / 7.0 / K
    assert [s.high for s in system.outputs] == pytest.approx([reach] * 3)
    assert [s.low for s in system.outputs] == pytest.approx([-reach] * 3)
    assert {s.unit for s in system.outputs} == {"m"}
    assert (system.step, hold_of(system.inputs)) == (0.02, "zero_order")
