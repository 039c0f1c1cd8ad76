"""Models of exudyn that a user's file builds: against closed forms and other integrators."""

from __future__ import annotations

import pickle
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearizable, Linearization, RandomStates, Restorable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.exudyn.model import describe
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused
from tests.systems.exudyn_models import (
    LOAD,
    OSCILLATOR,
    SPRING,
    STEP,
    model,
    noise,
    specification,
    system_of,
)

QUARTER_CAR = str(Path(__file__).parents[2] / "docs" / "tutorials" / "quarter_car_exudyn.py")


def oscillator_motion(inputs: FloatArray, ramps: bool) -> FloatArray:
    """Closed form from rest under the first input: position and acceleration."""
    m, k, d = 2.0, 50.0, 3.0
    z = np.array([inputs[0, 0] / k, 0.0, inputs[0, 0], 0.0])
    rates = np.array([[0, 1, 0, 0], [-k / m, -d / m, 1 / m, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
    step, found = expm(rates * STEP), [[z[0], 0.0]]
    for force in inputs[:, 0]:
        z[2:] = (z[2], (force - z[2]) / STEP) if ramps else (force, 0.0)
        z = step @ z
        found.append([z[0], (z[2] - k * z[0] - d * z[1]) / m])
    return np.array(found)


def deviation(found: FloatArray, expected: FloatArray) -> float:
    """Largest difference of any output, over that output's standard deviation."""
    return float(np.max(np.max(np.abs(found - expected), axis=0) / np.std(expected, axis=0)))


def rates_of_the_car(z: FloatArray, road: float, road_rate: float) -> FloatArray:
    """The quarter car once more: wheel, body and their speeds; gives the rates of these."""
    wheel, body, wheel_speed, body_speed = z
    travel, speed = body - wheel, body_speed - wheel_speed
    force = 2e4 * travel + 8e6 * travel**3 + (1800.0 if speed > 0 else 900.0) * speed
    tyre = 1.8e5 * (wheel - road) + 100.0 * (wheel_speed - road_rate)
    return np.array([wheel_speed, body_speed, (force - tyre) / 40.0, -force / 300.0])


def test_quarter_car_agrees_with_another_integrator() -> None:
    inputs = np.cumsum(noise(200, size=0.01), axis=0)
    z, last = np.array([inputs[0, 0], inputs[0, 0], 0.0, 0.0]), inputs[0, 0]
    expected = [[0.0, 0.0, 0.0]]
    for value in inputs[:, 0]:
        rate = (value - last) / STEP

        def rates(t: float, z: FloatArray, last: float = last, rate: float = rate) -> FloatArray:
            return rates_of_the_car(z, last + rate * t, rate)

        z = solve_ivp(rates, (0, STEP), z, method="LSODA", rtol=1e-10, atol=1e-12).y[:, -1]
        last = value
        expected.append([rates_of_the_car(z, value, rate)[3], z[1] - z[0], z[0] - value])
    found = simulate(system_of(QUARTER_CAR), inputs).outputs
    assert deviation(found, np.array(expected)) < 1e-3  # the damper's kink, met between substeps


def test_quarter_car_is_linearized_where_it_is() -> None:
    system = system_of(QUARTER_CAR)
    simulate(system, noise(50, size=0.03))
    state = system.get_state()
    found = system.linearize(state)
    travel = state.coordinates[1] - state.coordinates[0]
    speed = state.velocities[1] - state.velocities[0]
    k, d = 2e4 + 24e6 * travel**2, 1800.0 if speed > 0 else 900.0
    assert found.mass == pytest.approx(np.diag([40.0, 300.0]))
    between, tyre = np.array([[1, -1], [-1, 1]]), np.diag([1.0, 0.0])
    assert found.damping == pytest.approx(d * between + 100.0 * tyre, rel=1e-4)
    expected = k * between + 1.8e5 * tyre
    assert found.stiffness == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("integrator", ["explicit", "generalized_alpha", "trapezoidal"])
@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_load_follows_the_hold_of_its_input(tmp_path: Path, integrator: str, hold: str) -> None:
    inputs = noise(150)
    system = system_of(model(tmp_path, OSCILLATOR), hold, integrator=integrator)
    expected = oscillator_motion(inputs, hold == "first_order")
    limit = 1e-9 if integrator == "explicit" else 3e-3
    assert deviation(simulate(system, inputs).outputs, expected) < limit


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_parameter_of_an_item_follows_its_input(tmp_path: Path, hold: str) -> None:
    """A force moved to the spring's far end: F / k is where the end is."""
    declared = '{"force": {"unit": "m", "parameter": "spring.offset"}}'
    path = model(tmp_path, OSCILLATOR, ('{"force": "N"}', declared), (LOAD, "pass"))
    system, inputs = system_of(path, hold), noise(150)
    assert system.acts == {"force": "parameter"}
    expected = oscillator_motion(50.0 * inputs, hold == "first_order")
    assert deviation(simulate(system, inputs).outputs, expected) < 3e-3


@pytest.mark.parametrize("integrator", ["explicit", "generalized_alpha"])
def test_user_function_reads_the_input_of_its_time(tmp_path: Path, integrator: str) -> None:
    function = (
        "mbs.AddLoad(item.LoadCoordinate(markerNumber=mark,"
        " loadUserFunction=lambda mbs, t, load: mbs.variables['force']))"
    )
    system = system_of(
        model(tmp_path, OSCILLATOR, (LOAD, function)), "first_order", integrator=integrator
    )
    inputs = noise(150)
    limit = 1e-9 if integrator == "explicit" else 3e-3
    assert deviation(simulate(system, inputs).outputs, oscillator_motion(inputs, True)) < limit


POINT = """
import exudyn as exu
import exudyn.itemInterface as item

inputs = {"push": "N"}
outputs = {"height": {"unit": "m", "sensor": "place[2]"}}
OF = exu.OutputVariableType


def build(mbs, p):
    point = mbs.CreateMassPoint(mass=3.0, gravity=[0, 0, -9.81])
    ends = [mbs.CreateGround(), point]
    mbs.CreateCartesianSpringDamper(itemNumbers=ends, stiffness=[40] * 3, damping=[5] * 3)
    marker = mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=point))
    mbs.AddLoad(item.LoadForceVector("push", marker, [0, 3, 4]))
    mbs.AddSensor(item.SensorBody("place", point, outputVariableType=OF.Displacement))
"""


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_vector_load_acts_along_its_direction(tmp_path: Path, hold: str) -> None:
    system = system_of(model(tmp_path, POINT), hold)
    found = system.rest_state(np.array([10.0])).coordinates
    assert found == pytest.approx([0.0, 10 * 0.6 / 40, (10 * 0.8 - 3 * 9.81) / 40])
    outputs = simulate(system, np.full((5, 1), 10.0)).outputs
    assert outputs[:, 0] == pytest.approx(found[2])


def test_outputs_that_the_recipe_names_are_those_of_the_system(tmp_path: Path) -> None:
    whole = specification(model(tmp_path, OSCILLATOR))
    named = {"acceleration": whole.outputs["acceleration"]}
    both, one = load_system(whole), load_system(replace(whole, outputs=named))
    assert [signal.name for signal in one.outputs] == ["acceleration"]
    inputs = noise(20)
    assert one.simulate(inputs)[:, 0] == pytest.approx(both.simulate(inputs)[:, 1])


def test_start_is_the_static_equilibrium_and_stays(tmp_path: Path) -> None:
    system = system_of(model(tmp_path, OSCILLATOR))
    outputs = simulate(system, np.full((20, 1), 5.0)).outputs
    assert outputs[:, 0] == pytest.approx(np.full(21, 0.1), rel=1e-9)
    assert np.abs(outputs[:, 1]).max() < 1e-9


def test_model_without_an_equilibrium_says_that_it_begins_elsewhere(tmp_path: Path) -> None:
    path = model(tmp_path, OSCILLATOR, ("p.stiffness, p.damping", "0.0, p.damping"))
    system, asked = system_of(path), system_of(path, start="initial")
    for made in (system, asked):
        assert simulate(made, np.ones((3, 1))).outputs[0] == pytest.approx([0.0, 0.5])
    (remark,) = system.remarks
    assert "initial configuration, since under the input force = 1 N exudyn found no" in remark
    assert "Springs or supports must hold every body" in remark
    assert "substeps" not in remark
    assert asked.remarks == ()
    found = describe(path)
    assert {p.name: p.value for p in found.parameters}["start"] == "initial"
    assert "initial configuration" in found.remarks[-1]


def test_system_offers_states_but_none_at_random(tmp_path: Path) -> None:
    system = system_of(model(tmp_path, OSCILLATOR))
    assert isinstance(system, Linearizable)
    assert not isinstance(system, RandomStates)
    inputs = noise(40)
    whole = simulate(system, inputs).outputs
    simulate(system, inputs[:15])
    state, copy = system.get_state(), pickle.loads(pickle.dumps(system))
    assert np.array_equal([copy.advance(row) for row in inputs[15:]], whole[16:])
    system.advance(np.ones(1))
    system.linearize(state)
    system.set_state(state)
    assert system.output() == pytest.approx(whole[15], rel=1e-12)
    assert np.array_equal([system.advance(row) for row in inputs[15:]], whole[16:])


def test_linearization_leaves_motion_and_outputs(tmp_path: Path) -> None:
    system, same = (
        system_of(model(tmp_path, OSCILLATOR), "first_order", integrator="generalized_alpha")
        for _ in range(2)
    )
    start = system.rest_state(np.ones(1))
    for row in noise(10):
        expected = same.advance(row)
        assert np.array_equal(system.advance(row), expected)
        assert system.linearize(start).stiffness == pytest.approx(50.0)
        assert np.array_equal(system.output(), expected)


def test_linearization_is_taken_at_the_input_of_its_state(tmp_path: Path) -> None:
    """A spring that stiffens with the input, which a user function reads."""
    function = "lambda mbs, t, n, u, v, k, d, o: (k + mbs.variables['force']) * u + d * v"
    spring = SPRING.replace("p.damping)", f"p.damping, springForceUserFunction={function})")
    system = system_of(model(tmp_path, OSCILLATOR, (SPRING, spring), (LOAD, "pass")))
    state = system.rest_state(np.array([7.0]))
    found = system.linearize(state)
    assert isinstance(found, Linearization)
    assert found.stiffness == pytest.approx(57.0, rel=1e-6)


def test_linearization_sees_loads_that_depend_on_the_state(tmp_path: Path) -> None:
    function = (
        "mbs.AddLoad(item.LoadCoordinate(markerNumber=mark, loadUserFunction=lambda mbs, t, load:"
        " mbs.variables['force'] - 30.0 * mbs.GetNodeOutput(node, OF.Coordinates)))"
    )
    system = system_of(model(tmp_path, OSCILLATOR, (LOAD, function)))
    assert system.linearize(system.get_state()).stiffness == pytest.approx(80.0, rel=1e-6)


def test_linearization_at_a_kink_has_the_mean_slope() -> None:
    system = system_of(QUARTER_CAR)
    found = system.linearize(system.rest_state(np.zeros(1)))
    expected = 1350.0 * np.array([[1, -1], [-1, 1]]) + np.diag([100.0, 0.0])
    assert found.damping == pytest.approx(expected, rel=1e-6)


ROD = OSCILLATOR.replace(
    LOAD,
    """other = mbs.AddNode(item.Node1D(referenceCoordinates=[0.0]))
    mbs.AddObject(item.Mass1D(nodeNumber=other, mass=1.0))
    end = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=other, coordinate=0))
    mbs.AddObject(item.CoordinateConstraint(markerNumbers=[mark, end]))
    mbs.AddLoad(item.LoadCoordinate("force", end))""",
).replace('"mass": 2.0', '"mass": 1.0')
"""The same oscillator of two masses joined by a rod."""


def test_constrained_model_is_integrated_implicitly(tmp_path: Path) -> None:
    system, inputs = system_of(model(tmp_path, ROD)), noise(150)
    found = simulate(system, inputs).outputs
    assert deviation(found, oscillator_motion(inputs, False)) < 3e-3
    assert system.linearize(system.get_state()).constraints.shape == (1, 2)
    with refused(LoadError, "explicit"):
        system_of(model(tmp_path, ROD), integrator="explicit")


@pytest.mark.parametrize(
    ("stiffness", "substeps", "explicit"), [(50.0, 2, True), (5e4, 4, True), (5e6, 20, False)]
)
def test_stiff_model_is_integrated_with_more_substeps_and_then_implicitly(
    tmp_path: Path, stiffness: float, substeps: int, explicit: bool
) -> None:
    system = system_of(model(tmp_path, OSCILLATOR), stiffness=stiffness)
    assert system.plant.substeps == substeps
    assert bool(system.plant.mbs.GetPreStepUserFunction()) is not explicit


LAG = OSCILLATOR.replace(
    LOAD,
    """state = mbs.AddNode(item.NodeGenericODE1(
        numberOfODE1Coordinates=1, referenceCoordinates=[0.0], initialCoordinates=[0.0]))
    mbs.AddObject(item.ObjectGenericODE1("lag", [state], [[-5.0]],
        rhsUserFunction=lambda mbs, t, n, x: [mbs.variables["force"]]))
    mbs.AddLoad(item.LoadCoordinate(markerNumber=mark,
        loadUserFunction=lambda mbs, t, load: 5.0 * mbs.GetNodeOutput(state, OF.Coordinates)))""",
)
"""The force follows the input with a lag of 0.2 s, a state of first order."""


def test_state_of_first_order_is_a_coordinate_but_not_linearized(tmp_path: Path) -> None:
    path, inputs = model(tmp_path, LAG), noise(100)
    system = system_of(path)
    assert "no equilibrium of first-order coordinates" in describe(path).remarks[-1]
    assert isinstance(system, Restorable)
    assert not isinstance(system, Linearizable)
    whole = simulate(system, inputs).outputs
    simulate(system, inputs[:40])
    state = system.get_state()
    assert state.coordinates.shape == state.velocities.shape == (2,)
    rest = whole[41:]
    for row in inputs[40:]:
        system.advance(row)
    system.set_state(state)
    assert np.array([system.advance(row) for row in inputs[40:]]) == pytest.approx(rest, abs=1e-5)


FRICTION = OSCILLATOR.replace(
    SPRING,
    """item.CoordinateSpringDamperExt("spring", [wall, mark], mbs.AddNode(
        item.NodeGenericData(initialCoordinates=[0, 0, 0], numberOfDataCoordinates=3)),
        p.stiffness, p.damping, dynamicFrictionForce=4.0, stickingStiffness=1e4)""",
)
"""With dry friction, which keeps where it sticks in data coordinates."""


def test_data_coordinates_are_a_part_of_the_state(tmp_path: Path) -> None:
    system, inputs = system_of(model(tmp_path, FRICTION)), noise(100, size=20.0)
    assert not isinstance(system, Linearizable)
    with refused(LoadError, "data coordinates"):
        system_of(model(tmp_path, FRICTION), integrator="explicit")
    simulate(system, inputs[:40])
    state = system.get_state()
    assert state.coordinates.shape == (4,)
    once = [system.advance(row)[0] for row in inputs[40:]]
    simulate(system, -inputs)
    system.set_state(state)
    again = [system.advance(row)[0] for row in inputs[40:]]
    assert np.ptp(once) > 0.01
    assert np.array(again) == pytest.approx(np.array(once), abs=1e-4)


def test_describe_says_what_the_file_declares(tmp_path: Path) -> None:
    found = describe(model(tmp_path, OSCILLATOR))
    assert found.kind == "exudyn"
    assert [(p.name, p.value) for p in found.parameters] == [
        ("substeps", 0),
        ("integrator", "auto"),
        ("start", "equilibrium"),
        ("mass", 2.0),
        ("stiffness", 50.0),
        ("damping", 3.0),
    ]
    assert [(name, t.unit, t.range) for name, t in found.inputs.items()] == [("force", "N", None)]
    assert [table.unit for table in found.outputs.values()] == ["m", "m/s^2"]
    assert found.remarks == ("input force is the load of its name",)


def test_another_function_of_a_module_builds_the_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    model(tmp_path, OSCILLATOR, ("def build(", "def heavy("), name="a_module_of_tests.py")
    system = system_of("a_module_of_tests:heavy", mass=8.0)
    assert system.linearize(system.get_state()).mass == pytest.approx(8.0)
    del sys.modules["a_module_of_tests"]
