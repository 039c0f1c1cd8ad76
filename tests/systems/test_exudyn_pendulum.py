"""A pendulum on a joint: its weight makes it stiff, and is far larger than what moves it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization, State
from tests.systems.exudyn_models import STEP, model, system_of

LENGTH, MASS, GRAVITY, INERTIA = 1.0, 1.0, 9.81, 1 / 3
PENDULUM = """
import math
import exudyn as exu
import exudyn.itemInterface as item

inputs = {"torque": "N.m"}
outputs = {"angle": {"unit": "1", "sensor": "angle[2]"}}
OF = exu.OutputVariableType
parameters = {"lean": -0.5 * math.pi, "stiffness": 0.0, "damping": 1.0}


def build(mbs, p):
    up = [0.5 * math.cos(p.lean), 0.5 * math.sin(p.lean), p.lean]
    node = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=up))
    rod = mbs.AddObject(item.ObjectRigidBody2D(nodeNumber=node, mass=1.0, inertia=1 / 12))
    ground = mbs.AddObject(item.ObjectGround())
    ends = [
        mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=ground)),
        mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=rod, localPosition=[-0.5, 0.0, 0.0])),
    ]
    mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=ends))
    weight = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=rod))
    mbs.AddLoad(item.LoadMassProportional(markerNumber=weight, loadVector=[0.0, -9.81, 0.0]))
    fixed = item.MarkerNodeCoordinate(
        nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0
    )
    turned = item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2)
    marks = [mbs.AddMarker(one) for one in (fixed, turned)]
    mbs.AddObject(item.CoordinateSpringDamper(
        markerNumbers=marks, stiffness=p.stiffness, damping=p.damping
    ))
    mbs.AddLoad(item.LoadCoordinate(name="torque", markerNumber=marks[1]))
    mbs.AddSensor(item.SensorNode("angle", node, outputVariableType=OF.Coordinates))
"""


def pendulum(folder: Path, **parameters: Any) -> Any:
    return system_of(model(folder, PENDULUM), "first_order", **parameters)


def eigenvalues(found: Linearization) -> FloatArray:
    """Those of what the constraints leave free."""
    free = null_space(found.constraints)
    m, d, k = (free.T @ part @ free for part in (found.mass, found.damping, found.stiffness))
    return np.roots([m.item(), d.item(), k.item()])


@pytest.mark.parametrize(("lean", "stiffness"), [(-0.5 * math.pi, 0.0), (0.5 * math.pi, 100.0)])
def test_weight_of_a_pendulum_makes_it_stiff_or_soft(
    tmp_path: Path, lean: float, stiffness: float
) -> None:
    system = pendulum(tmp_path, lean=lean, stiffness=stiffness)
    found = eigenvalues(system.linearize(system.get_state()))
    of_weight = 0.5 * MASS * GRAVITY * LENGTH * -math.sin(lean)
    np.testing.assert_allclose(found, np.roots([INERTIA, 1.0, stiffness + of_weight]), rtol=1e-5)


def test_speed_of_a_pendulum_adds_no_stiffness(tmp_path: Path) -> None:
    """Its joint carries more while it turns, but the same force keeps the rod on its circle."""
    system = pendulum(tmp_path)
    begun, speed = system.get_state(), 3.0
    velocities = np.array([0.5 * speed, 0.0, speed])
    found = system.linearize(State(begun.coordinates, velocities, begun.last_input))
    of_weight = 0.5 * MASS * GRAVITY * LENGTH
    np.testing.assert_allclose(eigenvalues(found), np.roots([INERTIA, 1.0, of_weight]), rtol=1e-5)


def test_small_motions_are_as_accurate_as_large_ones(tmp_path: Path) -> None:
    """Newton's method must not end where what is left is small beside the weight alone."""
    system = pendulum(tmp_path, lean=0.5 * math.pi, stiffness=100.0)
    t = STEP * np.arange(200)

    def swing(torque: float) -> float:
        def push(time: float) -> float:
            return torque * float(np.interp(time, [0.1, 0.1 + STEP, 0.1 + 2 * STEP], [0, 1, 0]))

        def slope(time: float, y: FloatArray) -> list[float]:
            moment = push(time) - y[1] - 100.0 * y[0]
            return [y[1], (moment + 0.5 * MASS * GRAVITY * math.sin(y[0])) / INERTIA]

        inputs = np.array([[push(time)] for time in t[1:]])
        exact = solve_ivp(slope, (0, t[-1]), [0, 0], t_eval=t, rtol=1e-10, atol=1e-14,
                          max_step=STEP).y[0]  # fmt: skip
        found = system.simulate(inputs)[:, 0]
        return float(np.std(found - found[0] - exact) / np.std(exact))

    small, large = swing(0.01), swing(1.0)
    assert large < 2e-3
    assert small < 2e-3
