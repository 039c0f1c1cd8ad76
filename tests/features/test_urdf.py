"""Robots from their URDF, against pinocchio's own reader, and those that are no serial chain."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.robot_6r.puma_560 import LIMITS, puma_560
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.drive_law import DRIVE_LAWS
from slide_fmu.features.urdf import UrdfError, read_urdf
from tests.refusals import refused

PUMA = Path(__file__).parents[2] / "mbs_models" / "robot_6r" / "puma_560.urdf"
INERTIAL = (
    '<inertial><origin xyz="{}" rpy="{}"/><mass value="{}"/>'
    '<inertia ixx="0.3" ixy="0.02" ixz="-0.01" iyy="0.4" iyz="0.03" izz="0.35"/></inertial>'
)
TWO = """
<robot name="two">
  <link name="ground"/>
  <link name="upper"><inertial><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="ground"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="prismatic"><parent link="upper"/><child link="lower"/>
    <origin xyz="1 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""


def words(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def random_urdf(kinds: list[str], seed: int) -> str:
    """Joints about any axes, a part fixed to every second link, and a tool."""
    rng, parts, parent = np.random.default_rng(seed), ['<link name="base"/>'], "base"

    def place() -> str:
        turn = words(rng.uniform(-2, 2, 3))
        return f'<origin xyz="{words(rng.normal(0, 0.5, 3))}" rpy="{turn}"/>'

    def link(name: str) -> str:
        numbers = words(rng.normal(0, 0.2, 3)), words(rng.uniform(-2, 2, 3)), rng.uniform(1, 5)
        return f'<link name="{name}">{INERTIAL.format(*numbers)}</link>'

    limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
    for i, kind in enumerate([*kinds, "fixed"]):
        name = "tool" if kind == "fixed" else f"link_{i}"
        ends = f'<parent link="{parent}"/><child link="{name}"/>'
        axis = "" if kind == "fixed" else f'<axis xyz="{words(rng.normal(size=3))}"/>{limit}'
        parts += [link(name), f'<joint name="j{i}" type="{kind}">{ends}{place()}{axis}</joint>']
        parent = name
        if kind != "fixed" and i % 2:
            ends = f'<parent link="{name}"/><child link="part_{i}"/>'
            parts.append(link(f"part_{i}"))
            parts.append(f'<joint name="f{i}" type="fixed">{ends}{place()}</joint>')
            parent = f"part_{i}"
    return f'<robot name="any">{"".join(parts)}</robot>'


def written(folder: Path, text: str) -> Path:
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return path


MACHINES = [
    ["revolute"],
    ["prismatic"],
    ["revolute", "revolute"],
    ["prismatic", "prismatic", "revolute", "revolute"],
    ["revolute", "prismatic", "revolute", "prismatic", "revolute", "revolute", "revolute"],
]


@pytest.mark.parametrize("kinds", MACHINES, ids=lambda kinds: f"{len(kinds)} {kinds[0]}")
def test_chain_of_a_urdf_moves_as_pinocchio_says(kinds: list[str], tmp_path: Path) -> None:
    """Of joints about any axes, in the axes of the first joint, about its own origin."""
    pin: Any = pytest.importorskip("pinocchio")
    text = random_urdf(kinds, len(kinds))
    gravity = (1.0, -2.0, -9.0)
    found = read_urdf(written(tmp_path, text), gravity=gravity)
    model = pin.buildModelFromXML(text)
    model.gravity.linear = np.array(gravity)
    data, n = model.createData(), len(kinds)
    rng = np.random.default_rng(1)
    for _ in range(5):
        q, dq, ddq = (scale * rng.uniform(-1, 1, n) for scale in (3.0, 8.0, 40.0))
        torques = np.array(pin.rnea(model, data, q, dq, ddq))
        assert found.chain.joint_torques(q, dq, ddq) == pytest.approx(torques, rel=1e-9, abs=1e-9)
        pin.framesForwardKinematics(model, data, q)
        tool = data.oMf[model.getFrameId("tool")].translation
        place = found.position + found.rotation @ found.chain.tool_position(q)
        assert place == pytest.approx(np.array(tool), abs=1e-12)
        base = data.oMi[1].act(data.f[1])
        force = found.rotation.T @ base.linear
        moment = base.angular - np.cross(found.position, base.linear)
        held = np.concatenate([force, found.rotation.T @ moment])
        wrench = found.chain.base_wrench(q, dq, ddq)
        assert wrench == pytest.approx(-held, rel=1e-9, abs=1e-9)
    assert found.joints == tuple(f"j{i}" for i in range(n))


def test_features_of_the_puma_are_the_same_from_its_urdf() -> None:
    """To rounding, so that its surrogate needs no other training."""
    read = read_urdf(PUMA)
    assert (read.position == 0).all()
    assert (read.rotation == np.eye(3)).all()
    inputs = np.random.default_rng(0).uniform(-1, 1, (2, 30, 6))
    law = DRIVE_LAWS["quadratic_b_spline"]
    one, other = (
        ChainMotion(chain, law, np.zeros(6), LIMITS, 1 / 60).of(inputs)
        for chain in (puma_560(np.zeros(3)), read.chain)
    )
    size = np.maximum(one.std((0, 1)), 1e-9 * one.std())
    assert np.max(np.abs(one - other) / size) < 1e-13


def test_tool_is_the_link_that_is_named(tmp_path: Path) -> None:
    path = written(tmp_path, random_urdf(["revolute"] * 2, 3))
    link = read_urdf(path, tool="link_1").chain.tool_position(np.zeros(2))
    tool = read_urdf(path).chain.tool_position(np.zeros(2))
    assert np.linalg.norm(link - tool) > 0.1
    with refused(UrdfError, "expected one of ['base'", "'hand' for the"):
        read_urdf(path, tool="hand")
    with refused(UrdfError, "expected a", "'link_0' is not"):
        read_urdf(path, tool="link_0")


BRANCH = '<joint name="b" type="fixed"><parent link="upper"/><child link="beside"/></joint>'
WRONG = {
    "type": ('type="prismatic"', 'type="planar"', "'elbow' is of type 'planar'; expected one of"),
    "floating": ('type="revolute"', 'type="floating"', "'shoulder' is of type 'floating'"),
    "branch": (
        "</robot>",
        f'<link name="beside"/>{BRANCH}</robot>',
        "'upper' carries the joints 'elbow' and 'b'; expected a chain without branches",
    ),
    "two bases": ("</robot>", '<link name="alone"/></robot>', "expected one base, and one joint"),
    "no inertial": (
        '<link name="lower"><inertial><mass value="1"/>\n    <inertia ixx="1" ixy="0" ixz="0" '
        'iyy="1" iyz="0" izz="1"/></inertial></link>',
        '<link name="lower"/>',
        "what joint 'elbow' moves has no <inertial>; expected one with mass, origin and inertia",
    ),
    "mimic": (
        '<axis xyz="1 0 0"/>',
        '<axis xyz="1 0 0"/><mimic joint="shoulder"/>',
        "joint 'elbow' mimics 'shoulder'; expected joints that move on their own",
    ),
    "axis": ('<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>', r"'elbow' has the axis \[0.0, 0.0, 0"),
    "mass": ('<mass value="2"/>', '<mass value="nan"/>', "'upper' has mass nan kg and inertia"),
    "negative": ('<mass value="2"/>', '<mass value="-1"/>', "'upper' has mass -1.0 kg"),
    "negative moment": (
        'ixx="1"',
        'ixx="-1"',
        r"'upper' has the principal moments of inertia -1, 1, 1",
    ),
    "product": ('ixy="0"', 'ixy="3"', r"'upper' has the principal moments of inertia -2, 1, 4"),
    "no mass": (
        '<mass value="1"/>',
        '<mass value="0"/>',
        "the last joint 'elbow' moves has mass 0",
    ),
    "inertia": ('ixx="1"', 'ixx="inf"', "'upper' has mass 2.0 kg and inertia"),
    "origin": ('<origin xyz="1 0 0"/>', '<origin xyz="nan 0 0"/>', "origin of 'elbow' is not fin"),
    "unknown": ('<child link="lower"/>', '<child link="low"/>', r"'elbow' joins \['low'\], which"),
    "not XML": ("</robot>", "", "cannot be read as URDF"),
    "text": ('<mass value="2"/>', '<mass value="two"/>', "cannot be read as URDF"),
}


@pytest.mark.parametrize(("old", "new", "message"), WRONG.values(), ids=WRONG)
def test_robots_that_are_no_chain_are_refused(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    assert old in TWO
    path = written(tmp_path, TWO.replace(old, new, 1))
    with pytest.raises(UrdfError, match=message) as refused:
        read_urdf(path)
    assert str(refused.value).startswith(str(path))


def test_numbers_of_joints_beyond_one_to_seven_are_refused(tmp_path: Path) -> None:
    with refused(UrdfError, "expected 1 to", "8 joints that"):
        read_urdf(written(tmp_path, random_urdf(["revolute"] * 8, 0)))
    fixed = TWO.replace('"prismatic"', '"fixed"').replace('"revolute"', '"fixed"')
    with refused(UrdfError, "expected 1 to", "0 joints that"):
        read_urdf(written(tmp_path, fixed))


def test_files_that_are_not_there_are_named(tmp_path: Path) -> None:
    with refused(UrdfError, "expected a robot's URDF", "such file"):
        read_urdf(tmp_path / "none.urdf")


def test_missing_reader_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yourdfpy", None)
    with refused(UrdfError, "pip install 'slide-fmu[urdf]'"):
        read_urdf(written(tmp_path, TWO))
