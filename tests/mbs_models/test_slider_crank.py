"""The flexible slider-crank against geometry, rigid kinematics, energy and known poles."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

from mbs_models.slider_crank.slider_crank import SliderCrank, director
from mbs_models.slider_crank.slider_crank_plant import AXIAL_STIFFNESS, CRANK_LENGTH, ROD_LENGTH
from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.memory.modes import spectrum
from slide_fmu.systems.base import State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused

STEP = 1.0 / 32.0
INTERRUPTED = 1e-5
"""Of the deflection's standard deviation: after ``set_state`` the accelerations are computed anew,
with other rounding and Newton residuals than those that the integration carries on."""
STRETCH = 5e-4
"""In m: what 200 N, from slider and rod at 40 m/s^2, stretch a rod of 1 m and 414 kN."""


def fast(**parameters: Any) -> SliderCrank:
    """The settings for much data, within half a percent."""
    return SliderCrank(**{"elements": 6, "substeps": 4, **parameters})


def directors(angles: FloatArray) -> FloatArray:
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def swing(count: int, seed: int = 0) -> FloatArray:
    """Desired angles in rad: pieces of constant acceleration, up to 8 rad/s, from rest at 0."""
    accelerations = np.repeat(np.random.default_rng(seed).uniform(-20, 20, count // 16 + 1), 16)
    speed = 0.0
    speeds = [speed := float(np.clip(speed + STEP * a, -8, 8)) for a in accelerations[:count]]
    return STEP * np.cumsum(speeds)


def crank_angle(state: State) -> float:
    return float(state.coordinates[2])


def slider_position(angle: float) -> float:
    """With a rigid rod, in m."""
    return CRANK_LENGTH * math.cos(angle) + math.sqrt(
        ROD_LENGTH**2 - (CRANK_LENGTH * math.sin(angle)) ** 2
    )


def states(system: SliderCrank, angles: FloatArray) -> list[State]:
    """The states after each step from rest at angle 0."""
    system.set_state(system.rest_state(director(0.0)))
    found = []
    for row in directors(angles):
        system.advance(row)
        found.append(system.get_state())
    return found


def test_deflection_is_the_distance_of_the_middle_from_the_line_between_the_ends() -> None:
    system = SliderCrank()
    for state in states(system, swing(100))[::7]:
        points = system.points(state)
        rod = points[2:]
        start, end, middle = rod[0], rod[-1], rod[len(rod) // 2]
        left = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
        system.set_state(state)
        assert system.output()[0] == pytest.approx(left @ (middle - start), abs=1e-12)
        assert left @ (middle - start) == pytest.approx(left @ (middle - end), abs=1e-12)
    assert abs(system.output()[0]) > 1e-3


def test_points_are_joined_and_the_slider_stays_on_its_line() -> None:
    system = SliderCrank()
    for state in states(system, swing(200)):
        points = system.points(state)
        assert points.shape == (13, 2)
        assert points[0] == pytest.approx(np.zeros(2))
        assert points[1] == pytest.approx(CRANK_LENGTH * director(crank_angle(state)))
        assert points[2] == pytest.approx(points[1], abs=1e-8)
        assert points[-1, 1] == pytest.approx(0.0, abs=1e-8)
        stretched = np.sum(np.linalg.norm(np.diff(points[2:], axis=0), axis=1))
        assert stretched == pytest.approx(ROD_LENGTH, abs=2e-3)


def test_a_stiff_rod_moves_like_a_rigid_one() -> None:
    system = SliderCrank(bending_stiffness=13.8e3)
    for state in states(system, swing(150)):
        system.set_state(state)
        assert abs(system.output()[0]) < 2e-4
        slider = system.points(state)[-1, 0]
        assert slider == pytest.approx(slider_position(crank_angle(state)), abs=STRETCH)


def test_heavier_slider_bends_the_rod_more() -> None:
    """Its inertia presses along the rod, which the rod's own inertia has bent."""
    found = []
    for mass in (1.0, 2.0):
        system = fast(slider_mass=mass)
        start = system.rest_state(director(0.0))
        found.append(np.std(simulate(system, directors(swing(150)), start).outputs))
    assert found[1] > 1.1 * found[0]


def test_bending_shortens_the_rod_by_what_a_bow_does() -> None:
    system = SliderCrank()
    for state in states(system, swing(150)):
        system.set_state(state)
        # a half sine of height d is shorter by (pi d / 2)^2 / L; the slider sees it at an angle
        shorter = (0.5 * math.pi * system.output()[0]) ** 2 / ROD_LENGTH
        away = abs(system.points(state)[-1, 0] - slider_position(crank_angle(state)))
        assert away <= 1.5 * shorter + 5e-4


def bending_and_stretching(system: SliderCrank, coordinates: FloatArray) -> float:
    """Elastic energy of the rod in J, from its cubic elements, ten Gauss points in each."""
    place, weight = np.polynomial.legendre.leggauss(10)
    x, weight = 0.5 * (place + 1.0), 0.5 * weight
    elements = (len(coordinates) - 9) // 4
    length = ROD_LENGTH / elements
    nodes = coordinates[3:-2].reshape(-1, 4).copy()
    nodes[:, 0] += CRANK_LENGTH + length * np.arange(elements + 1)
    nodes[:, 2] += 1.0
    first = [6 * x * x - 6 * x, 1 - 4 * x + 3 * x * x, 6 * x - 6 * x * x, 3 * x * x - 2 * x]
    second = [12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2]
    scale = np.array([1.0, length, 1.0, length])
    energy = 0.0
    for k in range(elements):
        corner = np.vstack([nodes[k].reshape(2, 2), nodes[k + 1].reshape(2, 2)]) * scale[:, None]
        slope = np.stack(first, axis=1) @ corner / length
        bend = np.stack(second, axis=1) @ corner / length**2
        stretch = np.linalg.norm(slope, axis=1)
        curvature = (slope[:, 0] * bend[:, 1] - slope[:, 1] * bend[:, 0]) / stretch**2
        density = AXIAL_STIFFNESS * (stretch - 1.0) ** 2 + 13.8 * curvature**2
        energy += 0.5 * length * float(weight @ density)
    return energy


def test_without_a_drive_the_energy_only_decays() -> None:
    system = SliderCrank(proportional=0.0, differential=0.0)
    state = system.straight_state(0.4, 6.0)
    mass = system.linearize(state).mass
    system.set_state(state)
    energies = []
    for _ in range(64):
        speeds = state.velocities[:-1]
        elastic = bending_and_stretching(system, state.coordinates)
        energies.append(0.5 * float(speeds @ mass @ speeds) + elastic)
        system.advance(director(0.0))
        state = system.get_state()
    assert np.all(np.diff(energies) < 1e-5 * energies[0])
    assert 0.2 * energies[0] < energies[-1] < 0.9 * energies[0]


def test_the_drive_follows_its_set_points() -> None:
    system, angles = SliderCrank(), swing(300)
    found = states(system, angles)
    lagging = 0.5 * (angles[1:] + angles[:-1])  # half a step behind
    assert [s.coordinates[-1] for s in found[1:]] == pytest.approx(lagging.tolist(), abs=1e-9)
    wanted = np.array([[s.coordinates[-1], s.velocities[-1]] for s in found])
    moved = np.array([[crank_angle(s), s.velocities[2]] for s in found])
    assert np.max(np.abs(wanted - moved)[:, 0]) < 0.05
    assert np.max(np.abs(wanted - moved)[:, 1]) < 1.0
    assert np.max(np.abs(angles)) > 2.0 * math.pi  # so it has counted turns


def test_the_length_of_the_director_does_not_matter() -> None:
    inputs = directors(swing(40))
    start = fast().rest_state(director(0.0))
    same = simulate(fast(), 0.3 * inputs, start).outputs
    assert np.max(np.abs(same - simulate(fast(), inputs, start).outputs)) < 1e-12


def test_soft_drive_has_a_slow_pole() -> None:
    system = fast(proportional=10.0, differential=100.0)
    rest = system.rest_state(director(0.5))
    rates = [m.eigenvalue for m in spectrum(system.linearize(rest), 0.01).modes]
    assert rates[0] == pytest.approx(-0.1, rel=2e-3)
    assert -2.95 < rates[1].real < -2.5
    # the motion has it, too: the crank creeps towards a set point beside it
    offset = State(rest.coordinates.copy(), rest.velocities, director(0.51))
    offset.coordinates[-1] += 0.01
    system.set_state(offset)
    behind = []
    for _ in range(11 * 32):
        system.advance(director(0.51))
        behind.append(0.51 - crank_angle(system.get_state()))
    rate = math.log(behind[-1] / behind[31]) / 10.0
    assert rate == pytest.approx(rates[0].real, rel=5e-3)


def test_poles_of_the_free_crank_are_those_of_the_paper() -> None:
    system = SliderCrank(proportional=0.0, differential=0.0)
    slowest, next_ones = [], []
    for angle in np.linspace(0.0, math.pi, 9):
        found = spectrum(system.linearize(system.straight_state(angle, 0.0)), 0.01)
        assert len(found.rigid) == 2
        slowest.append(found.modes[0].decay_time)
        next_ones.append(-found.modes[1].eigenvalue.real)
    # from the paper: 1.1 to 1.83 s over the crank's angle
    assert (min(slowest), max(slowest)) == pytest.approx((1.1, 1.825), abs=0.01)
    assert min(next_ones) > 39.0


def test_linearization_leaves_the_motion_and_shows_the_drive() -> None:
    system = SliderCrank()
    simulate(system, directors(swing(20)), system.rest_state(director(0.0)))
    expected = [system.advance(row)[0] for row in directors(swing(40)[20:])]
    simulate(system, directors(swing(20)), system.rest_state(director(0.0)))
    found = system.linearize(system.random_state(np.random.default_rng(0)))
    assert [system.advance(row)[0] for row in directors(swing(40)[20:])] == expected
    free = SliderCrank(proportional=0.0, differential=0.0).linearize(
        system.random_state(np.random.default_rng(0))
    )
    drive = np.zeros_like(found.mass)
    drive[2, 2] = 1.0
    assert found.stiffness - free.stiffness == pytest.approx(1000.0 * drive, abs=1e-4)
    assert found.damping - free.damping == pytest.approx(100.0 * drive, abs=1e-4)
    assert found.constraints.shape == (6, 48)
    assert np.linalg.matrix_rank(found.constraints) == 6
    assert found.mass.shape == (48, 48)


def test_consistent_states_satisfy_the_constraints_of_velocities() -> None:
    system = SliderCrank()
    for seed in range(5):
        state = system.random_state(np.random.default_rng(seed))
        constraints = system.linearize(state).constraints
        assert constraints @ state.velocities[:-1] == pytest.approx(np.zeros(6), abs=1e-12)
        assert system.points(state)[-1, 1] == pytest.approx(0.0, abs=1e-15)


def test_rest_is_an_equilibrium() -> None:
    system = SliderCrank()
    held = director(2.5)
    outputs = simulate(system, np.tile(held, (32, 1)), system.rest_state(held)).outputs
    assert np.max(np.abs(outputs)) < 1e-10
    assert crank_angle(system.get_state()) == pytest.approx(2.5, abs=1e-10)


def test_random_states_fill_their_range() -> None:
    system = SliderCrank(speed_limit=5.0)
    found = [system.random_state(np.random.default_rng(seed)) for seed in range(300)]
    speeds = np.array([s.velocities[2] for s in found])
    assert 0.35 < np.mean(speeds == 0.0) < 0.65
    assert 4.5 < np.max(np.abs(speeds)) <= 5.0
    assert np.ptp([crank_angle(s) for s in found]) > 6.0
    for state in found:
        assert math.hypot(*state.last_input) == pytest.approx(1.0)


def test_interrupted_and_pickled_motions_go_on() -> None:
    system, inputs = SliderCrank(), directors(swing(60))
    start = system.random_state(np.random.default_rng(1))
    whole = simulate(system, inputs, start).outputs
    assert np.array_equal(simulate(system, inputs, start).outputs, whole)
    simulate(system, inputs[:20], start)
    copy = pickle.loads(pickle.dumps(system))
    other = SliderCrank()
    other.set_state(system.get_state())
    for one in (copy, other):
        rest = np.array([one.advance(row) for row in inputs[20:]])
        assert np.std(rest - whole[21:]) < INTERRUPTED * np.std(whole)


def test_substeps_converge_with_the_second_order() -> None:
    def run(substeps: int) -> FloatArray:
        system = SliderCrank(elements=4, substeps=substeps)
        inputs = directors(swing(96))
        return simulate(system, inputs, system.rest_state(director(0.0))).outputs[32:, 0]

    exact = run(160)
    coarse, fine = (float(np.std(run(n) - exact) / np.std(exact)) for n in (10, 20))
    assert fine < 3e-4
    assert 3.0 < coarse / fine < 5.0


@pytest.mark.extended
@pytest.mark.parametrize(
    ("elements", "substeps", "bound"), [(10, 20, 3e-4), (6, 10, 1e-3), (6, 4, 5e-3)]
)
def test_settings_keep_their_error(elements: int, substeps: int, bound: float) -> None:
    inputs = directors(swing(128))
    exact, found = (
        simulate(system, inputs, system.rest_state(director(0.0))).outputs[32:, 0]
        for system in (
            SliderCrank(elements=16, substeps=60),
            SliderCrank(elements=elements, substeps=substeps),
        )
    )
    assert np.std(found - exact) < bound * np.std(exact)


def test_signals_are_those_of_the_slider_crank() -> None:
    system = SliderCrank(deflection_limit=0.2)
    assert [(s.name, s.unit, s.low, s.high) for s in system.inputs] == [
        ("director_x", "1", -1.0, 1.0),
        ("director_y", "1", -1.0, 1.0),
    ]
    assert [signal.angle for signal in system.inputs] == ["cosine", "sine"]
    (deflection,) = system.outputs
    assert (deflection.name, deflection.unit) == ("deflection", "m")
    assert (deflection.low, deflection.high) == (-0.2, 0.2)
    assert (system.step, hold_of(system.inputs)) == (STEP, "first_order")


def test_a_failure_is_an_error_and_not_the_end() -> None:
    system = SliderCrank(elements=4, substeps=1)
    wild = director(0.0), director(3.0)
    with refused(SimulationError, "substeps"):
        simulate(system, np.array(wild * 200), system.rest_state(director(0.0)))
    before = system.get_state()
    assert np.isfinite(before.coordinates).all()
    outputs = simulate(system, directors(swing(5)), system.rest_state(director(0.0))).outputs
    assert np.max(np.abs(outputs)) < 0.1
