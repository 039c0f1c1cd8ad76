"""A serial chain is read from a robot's description in URDF (https://wiki.ros.org/urdf/XML).

The package yourdfpy (extra ``urdf``) reads the file. This module decides which robots are serial
chains, and which frames their links get.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.placed_chain import NO_PART, PlacedChain, RigidPart, chain_of_axes

if TYPE_CHECKING:  # an extra
    from yourdfpy import Joint, Link, Robot

MOST_JOINTS = 7
"""Largest number of joints of a chain."""
MOVING = {"revolute": 0.0, "continuous": 0.0, "prismatic": 1.0}
"""Types of joints that move, and whether they slide."""
ROUNDED = 1e-6
"""Files round moments of inertia to this part of the largest one."""
STANDARD_GRAVITY = (0.0, 0.0, -9.81)
"""In base axes, m/s^2."""


class UrdfError(ValueError):
    """A file is not the URDF of a serial chain; the message names the file and the remedy."""


def read_urdf(
    path: Path,
    tool: str | None = None,
    gravity: tuple[float, float, float] = STANDARD_GRAVITY,
) -> PlacedChain:
    """Read the serial chain of a robot from its URDF.

    Args:
        path: the file.
        tool: link whose origin is the tool point; the last one if None.
        gravity: acceleration of gravity in the axes of the file's base link, in m/s^2.

    Raises:
        UrdfError: the file cannot be read, or the robot is not a serial chain of one to seven
            revolute or prismatic joints whose moved links have masses.
    """
    robot = _read(path)
    links = {link.name: link for link in robot.links}
    joints = _in_order(path, robot, links)
    moving = [joint for joint in joints if joint.type in MOVING]
    if not 1 <= len(moving) <= MOST_JOINTS:
        raise UrdfError(
            f"{path}: {len(moving)} joints that move; expected 1 to {MOST_JOINTS}: fix the others "
            '(type="fixed")'
        )
    ends = {joint.child for joint in joints} | {joints[0].parent}
    name = joints[-1].child if tool is None else tool
    if name not in ends:
        raise UrdfError(f"{path}: no link {name!r} for the tool; expected one of {sorted(ends)}")
    return _chain(path, joints, links, (name, np.array(gravity, dtype=np.float64)))


def _read(path: Path) -> Robot:
    """Return the robot as yourdfpy reads it, without meshes."""
    try:
        from yourdfpy import URDF
    except ImportError as error:
        raise UrdfError(
            f"{path}: yourdfpy cannot be imported ({error}); a URDF needs it: pip install "
            "'slide-fmu[urdf]'"
        ) from error
    if not path.is_file():
        raise UrdfError(f"{path}: no such file; expected a robot's URDF")
    try:
        ElementTree.parse(path)  # yourdfpy reads broken files in part, without an error
        return URDF.load(
            str(path), build_scene_graph=False, load_meshes=False, load_collision_meshes=False
        ).robot
    except Exception as error:  # lxml and yourdfpy raise errors of many types
        raise UrdfError(
            f"{path}: cannot be read as URDF ({type(error).__name__}: {error}); expected the XML "
            "file of a robot (of a xacro file, what xacro writes)"
        ) from error


def _in_order(path: Path, robot: Robot, links: dict[str, Link]) -> list[Joint]:
    """Return all joints, starting at the base."""
    behind: dict[str, Joint] = {}
    for joint in robot.joints:
        unknown = [name for name in (joint.parent, joint.child) if name not in links]
        if unknown:
            raise UrdfError(f"{path}: joint {joint.name!r} joins {unknown}, which is no link")
        _require_kind(path, joint)
        if joint.parent in behind:
            raise UrdfError(
                f"{path}: link {joint.parent!r} carries the joints "
                f"{behind[joint.parent].name!r} and {joint.name!r}; expected a chain without "
                "branches: leave out all other links (a gripper's fingers as one link)"
            )
        behind[joint.parent] = joint
    children = [joint.child for joint in robot.joints]
    bases = [name for name in links if name not in children]
    if len(bases) != 1 or len(set(children)) != len(children) or not robot.joints:
        raise UrdfError(
            f"{path}: links {bases} hang on nothing, and {len(robot.joints)} joints carry "
            f"{len(set(children))} links; expected one base, and one joint for each other link"
        )
    row = [behind[bases[0]]]
    while row[-1].child in behind:
        row.append(behind[row[-1].child])
    return row


def _require_kind(path: Path, joint: Joint) -> None:
    """Refuse joints that a chain cannot have."""
    if joint.type not in (*MOVING, "fixed"):
        raise UrdfError(
            f"{path}: joint {joint.name!r} is of type {joint.type!r}; expected one of "
            f"{[*MOVING, 'fixed']}: the base of a chain does not move"
        )
    if joint.mimic is not None:
        raise UrdfError(
            f"{path}: joint {joint.name!r} mimics {joint.mimic.joint!r}; expected joints that "
            'move on their own: fix it (type="fixed")'
        )
    axis = np.asarray(joint.axis, dtype=np.float64)
    usable = axis.shape == (3,) and np.isfinite(axis).all() and np.linalg.norm(axis) > 0
    if joint.type in MOVING and not usable:
        raise UrdfError(
            f"{path}: joint {joint.name!r} has the axis {axis.tolist()}; expected a direction"
        )


def _chain(
    path: Path, joints: list[Joint], links: dict[str, Link], wanted: tuple[str, FloatArray]
) -> PlacedChain:
    """Build the chain from the joints in their order, the tool's link and gravity."""
    bodies, axes, slides, names = [NO_PART], [], [], []
    described = [True]  # whether the file has masses
    tool_name, gravity = wanted
    pose, tool = np.eye(4), (0, np.zeros(3))  # of a link in the base where all joints are at 0
    for joint in joints:
        pose = pose @ _pose(path, joint.name, joint.origin)
        if joint.type in MOVING:
            axis = np.asarray(joint.axis, dtype=np.float64)
            axes.append((pose[:3, 3].copy(), pose[:3, :3] @ (axis / np.linalg.norm(axis))))
            slides.append(MOVING[joint.type])
            names.append(joint.name)
            bodies.append(NO_PART)
            described.append(False)
        body = _body(path, links[joint.child]).moved(pose)
        bodies[-1] = bodies[-1].with_part(body)
        described[-1] |= links[joint.child].inertial is not None
        if joint.child == tool_name:
            tool = len(names), pose[:3, 3].copy()
    for name, has_mass in zip(names, described[1:], strict=True):
        if not has_mass:
            raise UrdfError(
                f"{path}: what joint {name!r} moves has no <inertial>; expected one with mass, "
                "origin and inertia, if need be of mass 0, in its link or in one fixed to it"
            )
    turned = not slides[-1] and bool(np.any(bodies[-1].inertia))
    if bodies[-1].mass == 0.0 and not turned:
        raise UrdfError(
            f"{path}: what the last joint {names[-1]!r} moves has mass 0; expected a "
            "body, since nothing resists this joint: give its link a mass, or fix the joint "
            '(type="fixed")'
        )
    if tool[0] != len(names):
        raise UrdfError(
            f"{path}: the tool {tool_name!r} is not behind the last joint {names[-1]!r}; expected "
            "a link that all joints move"
        )
    return chain_of_axes(axes, bodies[1:], (np.array(slides), tuple(names)), (gravity, tool[1]))


def _body(path: Path, link: Any) -> RigidPart:
    """Return mass, centre and inertia of a link in its own axes; zeros if the file has none."""
    inertial = link.inertial
    if inertial is None:
        return NO_PART
    mass = 0.0 if inertial.mass is None else float(inertial.mass)
    inertia = np.zeros((3, 3)) if inertial.inertia is None else np.asarray(inertial.inertia)
    pose = _pose(path, link.name, inertial.origin)
    if not (np.isfinite(mass) and mass >= 0 and np.isfinite(inertia).all()):
        raise UrdfError(
            f"{path}: link {link.name!r} has mass {mass} kg and inertia {inertia.tolist()}; "
            "expected finite numbers, and no negative mass"
        )
    if mass > 0 and inertial.inertia is None:
        raise UrdfError(f"{path}: link {link.name!r} has a mass, but no <inertia>; expected both")
    _require_possible(path, link.name, inertia)
    return RigidPart(mass, np.zeros(3), inertia.astype(np.float64)).moved(pose)


def _require_possible(path: Path, name: str, inertia: FloatArray) -> None:
    """Refuse an inertia that no body has, (3, 3) in kg m2: one with a negative principal moment.

    Robots whose inertias were identified may have other impossible ones, with which they move
    alike.
    """
    moments = np.linalg.eigvalsh(0.5 * (inertia + inertia.T))
    if moments[0] < -ROUNDED * float(np.max(np.abs(moments))):
        raise UrdfError(
            f"{path}: link {name!r} has the principal moments of inertia "
            f"{', '.join(f'{moment:.4g}' for moment in moments)} kg m2; expected none below 0, as "
            "of every body: correct <inertia> of the link, perhaps a sign of its products"
        )


def _pose(path: Path, name: str, origin: Any) -> FloatArray:
    """Return an origin in the file as a matrix, shape (4, 4)."""
    pose = np.eye(4) if origin is None else np.asarray(origin, dtype=np.float64)
    if not np.isfinite(pose).all():
        raise UrdfError(f"{path}: the origin of {name!r} is not finite; expected numbers")
    return pose
