"""Models rest where their forces balance, also where exudyn's static solver does not converge."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.systems.exudyn.model import describe
from slide_fmu.systems.simulation import simulate
from tests.systems.exudyn_models import OSCILLATOR, model, system_of
from tests.systems.test_exudyn_pendulum import GRAVITY, LENGTH, MASS, pendulum

LONG, THICK, WIDE, MODULUS = 1.0, 0.002, 0.02, 2e11
BEAM = """
import exudyn as exu
import exudyn.itemInterface as item

inputs = {"force": "N"}
outputs = {"tip": {"unit": "m", "sensor": "tip[1]"}}
parameters = {"thick": 0.002, "elements": 4}
CLAMPED = (0, 1, 3)


def build(mbs, p):
    area, inertia, part = 0.02 * p.thick, 0.02 * p.thick**3 / 12, 1.0 / p.elements
    nodes = [
        mbs.AddNode(item.NodePoint2DSlope1(referenceCoordinates=[part * n, 0, 1, 0]))
        for n in range(p.elements + 1)
    ]
    for pair in zip(nodes, nodes[1:]):
        mbs.AddObject(item.ObjectANCFCable2D(
            nodeNumbers=list(pair), length=part, massPerLength=7850 * area,
            bendingStiffness=2e11 * inertia, axialStiffness=2e11 * area,
            bendingDamping=4e8 * inertia,
        ))
    ground = mbs.AddMarker(item.MarkerNodeCoordinate(
        nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0
    ))

    def first(coordinate):
        return mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))

    for coordinate in CLAMPED:
        mbs.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[ground, first(coordinate)]))
    shown = exu.OutputVariableType.Displacement
    mbs.AddSensor(item.SensorNode("tip", nodes[-1], outputVariableType=shown))
    end = mbs.AddMarker(item.MarkerNodePosition(nodeNumber=nodes[-1]))
    mbs.AddLoad(item.LoadForceVector("force", end, loadVector=[0, 1, 0]))
"""
"""A beam of steel, 1 m long and 20 mm wide, clamped at one end, with a force on the other."""
ON_A_BASE = (
    ('inputs = {"force": "N"}', 'inputs = {"base": "m"}'),
    ("CLAMPED = (0, 1, 3)", "CLAMPED = (0, 3)"),
    (
        """    end = mbs.AddMarker(item.MarkerNodePosition(nodeNumber=nodes[-1]))
    mbs.AddLoad(item.LoadForceVector("force", end, loadVector=[0, 1, 0]))
""",
        """
    def push(mbs, time, number, place, speed, *_):
        apart = place - mbs.variables["base"], speed - mbs.variables["base_rate"]
        return 2e6 * apart[0] + 200.0 * apart[1]

    ends = [ground, first(1)]
    mbs.AddObject(item.CoordinateSpringDamper(markerNumbers=ends, springForceUserFunction=push))
""",
    ),
)


def test_clamped_beam_rests_without_a_load(tmp_path: Path) -> None:
    """Its forces are 1e8 times as large as what bends it, and rounded to as much."""
    path = model(tmp_path, BEAM)
    assert describe(path).remarks == ("input force is the load of its name",)
    system = system_of(path)
    assert np.abs(simulate(system, np.zeros((20, 1))).outputs).max() < 1e-12
    assert system.remarks == ()


@pytest.mark.parametrize("force", [1e-6, 1e-3, 0.01])
def test_clamped_beam_bends_as_in_the_textbook(tmp_path: Path, force: float) -> None:
    system = system_of(model(tmp_path, BEAM))
    system.set_state(system.rest_state(np.array([force])))
    bent = force * LONG**3 / (3 * MODULUS * WIDE * THICK**3 / 12)
    assert system.output()[0] == pytest.approx(bent, rel=1e-4)
    assert system.remarks == ()


def test_beam_on_a_base_rests_wherever_the_base_is(tmp_path: Path) -> None:
    system = system_of(model(tmp_path, BEAM, *ON_A_BASE), "first_order")
    for base in (0.0, 0.01, -0.3):
        system.set_state(system.rest_state(np.array([base])))
        assert system.output()[0] == pytest.approx(base, abs=1e-9)
    assert system.remarks == ()


def test_thick_beam_is_simulated_though_its_forces_are_rounded_to_more(tmp_path: Path) -> None:
    system = system_of(model(tmp_path, BEAM), thick=0.1, elements=16)
    assert system.plant.rounding > 1e-6
    assert np.abs(simulate(system, np.zeros((10, 1))).outputs).max() < 1e-12
    pushed = simulate(system, np.full((200, 1), 1000.0)).outputs[-1, 0]
    assert pushed == pytest.approx(1000.0 / (3 * MODULUS * WIDE * 0.1**3 / 12), rel=1e-3)


@pytest.mark.parametrize("lean", [-1.2, 0.0, 1.0])
@pytest.mark.parametrize("torque", [0.0, 2.0])
def test_pendulum_rests_where_it_hangs(tmp_path: Path, lean: float, torque: float) -> None:
    system = pendulum(tmp_path, lean=lean)
    place = system.rest_state(np.array([torque])).coordinates[2] + lean
    hung = torque / (0.5 * MASS * GRAVITY * LENGTH)
    assert math.sin(place + 0.5 * math.pi) == pytest.approx(hung, abs=1e-6)
    assert math.sin(place) < 0.0  # it does not stand
    assert system.remarks == ()


def test_linearization_at_rest_has_the_weight_that_hangs_there(tmp_path: Path) -> None:
    system = pendulum(tmp_path, lean=0.0)  # where it is level, nothing holds it
    found = system.linearize(system.rest_state(np.zeros(1)))
    _, singular, right = np.linalg.svd(found.constraints)
    free = right[len(singular) :].T
    stiffness, mass = ((free.T @ part @ free).item() for part in (found.stiffness, found.mass))
    frequency = 0.5 * MASS * GRAVITY * LENGTH / (MASS * LENGTH**2 / 3)
    assert stiffness / mass == pytest.approx(frequency, rel=1e-5)


def test_torque_that_turns_a_pendulum_round_leaves_no_rest(tmp_path: Path) -> None:
    """No support is missing, so none is advised."""
    system = pendulum(tmp_path)
    start = system.rest_state(np.array([6.0]))
    assert start.coordinates == pytest.approx(np.zeros(3))
    (remark,) = system.remarks
    assert "motions begin at the initial configuration" in remark
    assert "hold every body in the initial configuration, but forces do not balance" in remark
    assert "must hold" not in remark


def test_body_that_nothing_holds_lacks_a_support(tmp_path: Path) -> None:
    path = model(tmp_path, OSCILLATOR, ("p.stiffness, p.damping", "0.0, p.damping"))
    system = system_of(path)
    system.rest_state(np.ones(1))
    assert "Springs or supports must hold every body" in system.remarks[0]
