"""The serial chain against pinocchio, against its own derivatives, and on a pendulum."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from mbs_models.robot_6r.puma_560 import puma_560
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.serial_chain import SerialChain
from tests.refusals import refused

ARM = puma_560(np.array([0.01, -0.02, 0.1]))
JOINTS = ARM.n_joints
_RNG = np.random.default_rng(5)
ANY = dataclasses.replace(
    ARM,
    prismatic=np.array([0.0, 1.0, 0.0, 0.0, 1.0, 0.0]),
    theta=_RNG.uniform(-3, 3, JOINTS),
    alpha=_RNG.uniform(-3, 3, JOINTS),
    steps=_RNG.normal(0, 0.4, (JOINTS, 3)),
)
"""Revolute and prismatic joints of which nothing is special."""
SLIDING = dataclasses.replace(ANY, prismatic=1 - ANY.prismatic)
"""Its first joint slides."""


def motion(shape: tuple[int, ...] = (), seed: int = 0) -> tuple[FloatArray, ...]:
    """Random q, dq, ddq, shape (*shape, 6) each."""
    rng = np.random.default_rng(seed)
    return tuple(scale * rng.uniform(-1.0, 1.0, (*shape, JOINTS)) for scale in (3.0, 8.0, 40.0))


def pinocchio_model(pin: Any, arm: SerialChain) -> tuple[Any, Any]:
    """The arm in pinocchio: link i of the chain moves with joint i, before its constant part."""
    model = pin.Model()
    model.gravity.linear = arm.gravity
    constant, parent = pin.SE3.Identity(), 0
    for i in range(JOINTS):
        kind = pin.JointModelPZ if arm.prismatic[i] else pin.JointModelRZ
        turned = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, float(arm.theta[i])), np.zeros(3))
        parent = model.addJoint(parent, kind(), constant * turned, f"joint_{i + 1}")
        twist = pin.rpy.rpyToMatrix(float(arm.alpha[i]), 0.0, 0.0)
        constant = pin.SE3(twist, arm.steps[i])
        body = pin.Inertia(float(arm.masses[i]), arm.centres[i], arm.inertias[i])
        model.appendBodyToJoint(parent, body, constant)
    return model, constant


@pytest.mark.parametrize("arm", [ARM, ANY, SLIDING], ids=["Puma", "any joints", "sliding base"])
def test_serial_chain_agrees_with_pinocchio(arm: SerialChain) -> None:
    pin = pytest.importorskip("pinocchio")
    model, constant = pinocchio_model(pin, arm)
    data = model.createData()
    q, dq, ddq = motion((20,), 1)
    wrench, torques = arm.base_wrench(q, dq, ddq), arm.joint_torques(q, dq, ddq)
    momentum, inertia = arm.base_momentum(q, dq), arm.base_inertia(q)
    for k in range(20):
        expected = pin.rnea(model, data, q[k], dq[k], ddq[k])
        assert torques[k] == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9)
        pin.forwardKinematics(model, data, q[k], dq[k])
        # what the base does to the first link holds the arm
        base = data.oMi[1].act(data.f[1])
        held = np.concatenate([base.linear, base.angular])
        assert wrench[k] == pytest.approx(-held, rel=1e-9, abs=1e-9)
        tool = data.oMi[JOINTS].act(constant.act(arm.tool))
        assert arm.tool_position(q[k]) == pytest.approx(tool, abs=1e-13)
        rotations = arm.forward_kinematics(q[k]).rotations
        assert rotations[-1] == pytest.approx((data.oMi[JOINTS] * constant).rotation, abs=1e-13)
        # its momentum is about the centre of mass, which base_inertia gives
        found = pin.computeCentroidalMomentum(model, data)
        centre = inertia[k, 1:4] / inertia[k, 0]
        assert centre == pytest.approx(np.array(data.com[0]), abs=1e-13)
        about_base = found.angular + np.cross(centre, found.linear)
        expected = np.concatenate([found.linear, about_base])
        assert momentum[k] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("arm", [ARM, ANY, SLIDING], ids=["Puma", "any joints", "sliding base"])
def test_wrench_is_weight_minus_change_of_momentum(arm: SerialChain) -> None:
    q, dq, ddq = motion()
    h = 1e-5
    ahead, behind = (
        arm.base_momentum(q + t * dq + 0.5 * t**2 * ddq, dq + t * ddq) for t in (h, -h)
    )
    inertia = arm.base_inertia(q)
    weight = np.concatenate([inertia[0] * arm.gravity, np.cross(inertia[1:4], arm.gravity)])
    expected = weight - (ahead - behind) / (2 * h)
    assert arm.base_wrench(q, dq, ddq) == pytest.approx(expected, rel=1e-7, abs=1e-5)


def test_torques_times_rates_are_the_change_of_energy() -> None:
    q, dq, ddq = motion(seed=2)

    def energy(t: float) -> float:
        angles, rates = q + t * dq + 0.5 * t**2 * ddq, dq + t * ddq
        inertia = ARM.base_inertia(angles)
        # the kinetic energy from the torques that pure rates need: T = q'^T M q' / 2
        still = np.zeros(JOINTS)
        weightless = dataclasses.replace(ARM, gravity=np.zeros(3))
        kinetic = 0.5 * rates @ weightless.joint_torques(angles, still, rates)
        return float(kinetic - inertia[1:4] @ ARM.gravity)

    h = 1e-5
    power = float(ARM.joint_torques(q, dq, ddq) @ dq)
    assert power == pytest.approx((energy(h) - energy(-h)) / (2 * h), rel=1e-6)


def test_turning_the_first_joint_alone_shows_the_inertia() -> None:
    q = motion(seed=3)[0]
    rate = np.eye(JOINTS)[0]
    inertia = ARM.base_inertia(q)
    assert ARM.base_momentum(q, rate)[5] == pytest.approx(inertia[6])
    assert ARM.base_momentum(q, rate)[3:5] == pytest.approx(inertia[8:10])
    assert inertia[0] == pytest.approx(np.sum(ARM.masses))


def test_one_link_is_the_pendulum_of_textbooks() -> None:
    """One link in the vertical plane: what every textbook says."""
    m, length, inertia, g = 2.0, 0.7, 0.3, 9.81
    pendulum = SerialChain.denavit_hartenberg(
        a=np.array([length]),
        d=np.zeros(1),
        alpha=np.zeros(1),
        masses=np.array([m]),
        centres=np.zeros((1, 3)),
        inertias=inertia * np.eye(3)[None],
        gravity=np.array([0.0, -g, 0.0]),
        tool=np.zeros(3),
    )
    q, dq, ddq = np.array([0.4]), np.array([3.0]), np.array([-5.0])
    torque = (inertia + m * length**2) * ddq[0] + m * g * length * np.cos(q[0])
    assert pendulum.joint_torques(q, dq, ddq) == pytest.approx([torque])
    along, across = np.array([np.cos(0.4), np.sin(0.4)]), np.array([-np.sin(0.4), np.cos(0.4)])
    held = m * length * (ddq[0] * across - dq[0] ** 2 * along) + np.array([0.0, m * g])
    wrench = pendulum.base_wrench(q, dq, ddq)
    assert wrench == pytest.approx([-held[0], -held[1], 0.0, 0.0, 0.0, -torque])
    assert pendulum.tool_position(q) == pytest.approx([*(length * along), 0.0])


def test_batch_of_any_shape_gives_what_single_poses_give() -> None:
    q, dq, ddq = motion((4, 3), 5)
    frames = ARM.forward_kinematics(q)
    assert frames.positions.shape == (4, 3, 7, 3)
    assert frames.rotations.shape == (4, 3, 7, 3, 3)
    batches = {
        "tool": (ARM.tool_position(q), ARM.tool_position(q[2, 1]), 3),
        "wrench": (ARM.base_wrench(q, dq, ddq), ARM.base_wrench(q[2, 1], dq[2, 1], ddq[2, 1]), 6),
        "torques": (
            ARM.joint_torques(q, dq, ddq),
            ARM.joint_torques(q[2, 1], dq[2, 1], ddq[2, 1]),
            6,
        ),
        "inertia": (ARM.base_inertia(q), ARM.base_inertia(q[2, 1]), 10),
        "momentum": (ARM.base_momentum(q, dq), ARM.base_momentum(q[2, 1], dq[2, 1]), 6),
    }
    for name, (found, single, size) in batches.items():
        assert found.shape == (4, 3, size), name
        assert found[2, 1] == pytest.approx(single, rel=1e-13), name


@pytest.mark.parametrize("name", ["steps", "prismatic", "masses", "centres", "inertias", "tool"])
def test_wrong_shapes_and_numbers_are_named(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        dataclasses.replace(ARM, **{name: np.zeros(2)})
    with pytest.raises(ValueError, match=name):
        dataclasses.replace(ARM, **{name: np.nan * getattr(ARM, name)})


@pytest.mark.parametrize(("i", "j"), [(0, 1), (1, 2), (2, 0)])
def test_inertia_that_is_not_symmetric_is_named(i: int, j: int) -> None:
    inertias = ARM.inertias.copy()
    inertias[3, i, j] += 1e-12 * inertias[3, i, i]
    dataclasses.replace(ARM, inertias=inertias)
    inertias[3, i, j] += 1e-6 * inertias[3, i, i]
    with refused(ValueError, "inertias[3] has", "expected a symmetric tensor"):
        dataclasses.replace(ARM, inertias=inertias)


@pytest.mark.parametrize("name", ["a", "d", "alpha"])
def test_wrong_shapes_of_denavit_hartenberg_parameters_are_named(name: str) -> None:
    parts = {"a": np.zeros(6), "d": np.zeros(6), "alpha": np.zeros(6), name: np.zeros(5)}
    links = {part: getattr(ARM, part) for part in ("masses", "centres", "inertias", "gravity")}
    with pytest.raises(ValueError, match=rf"{name} = .* of shape \(5,\); expected"):
        SerialChain.denavit_hartenberg(**parts, **links, tool=ARM.tool)


def test_joints_of_no_kind_are_refused() -> None:
    with refused(ValueError, "prismatic =", "expected 1 for", "1 for prismatic"):
        dataclasses.replace(ARM, prismatic=np.full(JOINTS, 0.5))


def test_wrong_angles_are_named() -> None:
    with refused(ValueError, "dq of shape"):
        ARM.base_momentum(np.zeros(6), np.zeros(5))
