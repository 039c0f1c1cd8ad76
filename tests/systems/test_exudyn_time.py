"""Models whose user functions read the time, and constraints that say the same twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.exudyn.model import describe
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused
from tests.systems.exudyn_models import LOAD, OSCILLATOR, SPRING, model, system_of

RIPPLE = f"""{LOAD}
    def ripple(mbs, t, load): return {{}}
    mbs.AddLoad(item.LoadCoordinate("wind", mark, loadUserFunction=ripple))"""
SPRUNG = f"{SPRING[:-1]}, springForceUserFunction=lambda mbs, t, i, u, v, k, d, o: {{}})"
SENSED = """
    mbs.AddSensor(item.SensorUserFunction("late", sensorNumbers=[0], factors=[],
        sensorUserFunction=lambda mbs, t, numbers, factors, place: [t]))"""
TIMED = [
    (LOAD, RIPPLE.format("2 * (t > 5.0)"), "function 'ripple' of load 'wind' reads t"),
    (LOAD, RIPPLE.format("mbs.systemData.GetTime()"), "a user function (perhaps by mbs.system"),
    (SPRING, SPRUNG.format("k * u + d * v + t"), "function '<lambda>' of object 'spring'"),
]
"""What is replaced in the oscillator, by what, and which function is then named."""


@pytest.mark.parametrize(("before", "after", "reader"), TIMED)
def test_model_that_depends_on_time_is_refused_by_the_function_that_reads_it(
    tmp_path: Path, before: str, after: str, reader: str
) -> None:
    path = model(tmp_path, OSCILLATOR, (before, after))
    with refused(LoadError, "its outputs depend on time", "position goes from", reader):
        describe(path)


def test_refusal_says_how_far_outputs_move_with_time(tmp_path: Path) -> None:
    """50 N/m hold 5 N, which come and go slowly, near 0.1 m."""
    slow = RIPPLE.format("5 * __import__('math').sin(1.1 * t)")
    with pytest.raises(LoadError, match=r"goes from -0\.10\d to 0\.10\d m, .* within 10 s"):
        describe(model(tmp_path, OSCILLATOR, (LOAD, slow)))


def test_sensor_that_shows_the_time_is_refused(tmp_path: Path) -> None:
    late = ('"m/s^2"}', '"m/s^2", "late": "s"}')
    path = model(tmp_path, OSCILLATOR + SENSED, late)
    with refused(LoadError, "late goes from", "of sensor 'late' reads t"):
        describe(path)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
@pytest.mark.parametrize(
    "force", ["0.0", "0.0 * t", "3.0 * mbs.systemData.GetODE2Coordinates()[0]"]
)
def test_user_function_that_does_nothing_with_the_time_is_fine(
    tmp_path: Path, hold: str, force: str
) -> None:
    system = system_of(model(tmp_path, OSCILLATOR, (LOAD, RIPPLE.format(force))), hold)
    assert np.isfinite(simulate(system, np.ones((20, 1))).outputs).all()


TWO_JOINTS = """
import exudyn as exu
import exudyn.itemInterface as item
import exudyn.utilities as eu

inputs = {"push": "N"}
outputs = {"tip": {"unit": "m", "sensor": "tip[0]"}}


def build(mbs, p):
    ground = mbs.CreateGround()
    plate = eu.InertiaCuboid(1000.0, [0.05, 0.4, 0.05])
    body = mbs.CreateRigidBody(inertia=plate, referencePosition=[0, -0.2, 0])
    pair = [ground, body]
    mbs.CreateRevoluteJoint(name="hinge", itemNumbers=pair, position=[0, 0, 0], axis=[0, 0, 1])
    mbs.CreateSphericalJoint(
        name="ball", itemNumbers=pair, position=[0, 0, 0], constrainedAxes=[1, 1, 1]
    )
    mark = mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=body, localPosition=[0, -0.2, 0]))
    mbs.AddLoad(item.LoadForceVector(name="push", markerNumber=mark, loadVector=[1, 0, 0]))
    kind = exu.OutputVariableType.Position
    mbs.AddSensor(item.SensorMarker("tip", markerNumber=mark, outputVariableType=kind))
"""


def test_constraints_that_depend_on_each_other_are_named_once(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = model(tmp_path, TWO_JOINTS)
    with refused(LoadError, "3 of 9 constraints", "'hinge' (JointRevoluteZ), 'ball' (JointSph"):
        describe(path)
    assert capfd.readouterr().out == ""


PARALLELOGRAM = """
import numpy as np
import exudyn as exu
import exudyn.itemInterface as item

inputs, outputs = {"torque": "N*m"}, {"height": {"unit": "m", "sensor": "height[1]"}}
parameters = {"angle": ANGLE, "damping": 3.0}

def build(mbs, p):
    ground = mbs.AddObject(item.ObjectGround())

    def bar(begin, end):
        way = np.subtract(end, begin)
        length, at = float(np.linalg.norm(way)), [*np.add(begin, end) / 2, np.arctan2(*way[::-1])]
        node = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=at))
        body = mbs.AddObject(item.ObjectRigidBody2D(
            mass=1.0, inertia=0.1, nodeNumber=node))
        ends = [mbs.AddMarker(item.MarkerBodyPosition(
            bodyNumber=body, localPosition=[side * length / 2, 0, 0])) for side in (-1, 1)]
        return body, node, *ends

    def pin(name, one, other):
        mbs.AddObject(item.ObjectJointRevolute2D(name=name, markerNumbers=[one, other]))

    tip = [np.cos(p.angle), np.sin(p.angle)]
    crank, node, a0, a1 = bar([0, 0], tip)
    _, _, b0, b1 = bar([2, 0], [2 + tip[0], tip[1]])
    _, _, c0, c1 = bar(tip, [2 + tip[0], tip[1]])
    places = [mbs.AddMarker(item.MarkerBodyPosition(
        bodyNumber=ground, localPosition=[x, 0, 0])) for x in (0.0, 2.0)]
    for name, one, other in zip("lrcd", (places[0], places[1], a1, b1), (a0, b0, c0, c1)):
        pin(name, one, other)
    turn = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))
    zero = mbs.AddMarker(item.MarkerNodeCoordinate(
        nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    mbs.AddObject(item.CoordinateSpringDamper(
        markerNumbers=[zero, turn], stiffness=50.0, damping=p.damping))
    mbs.AddLoad(item.LoadCoordinate(name="torque", markerNumber=turn))
    mbs.AddSensor(item.SensorNode(
        name="height", nodeNumber=node, outputVariableType=exu.OutputVariableType.Coordinates))
"""


def test_linkage_that_begins_in_a_singular_position_is_told_apart(tmp_path: Path) -> None:
    """Its bars lie in one line: it may go on as a parallelogram, or crossed."""
    path = model(tmp_path, PARALLELOGRAM.replace("ANGLE", "0.0"))
    singular = "the initial configuration is singular: there, 1 of 8 constraints say"
    with refused(LoadError, singular, "let the model begin in another position"):
        describe(path)


def test_linkage_that_begins_elsewhere_is_fine(tmp_path: Path) -> None:
    path = model(tmp_path, PARALLELOGRAM.replace("ANGLE", "1.0"))
    assert describe(path).outputs.keys() == {"height"}


def test_joint_whose_axes_are_free_depends_on_nothing(tmp_path: Path) -> None:
    assert describe(model(tmp_path, TWO_JOINTS, ("[1, 1, 1]", "[0, 0, 0]"))).inputs
