"""A serial chain is built from joint axes and rigid parts: each link gets its frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.serial_chain import SerialChain

PARALLEL = 1e-12
"""Axes are parallel if the cross product of their unit vectors is smaller."""


@dataclass(frozen=True, eq=False)
class RigidPart:
    """A RigidPart has mass, centre of mass and inertia, and no joint inside.

    Attributes:
        mass: in kg.
        centre: centre of mass in the part's axes in m, shape (3,).
        inertia: tensor about the centre in the same axes in kg m^2, shape (3, 3).
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray

    def moved(self, pose: FloatArray) -> RigidPart:
        """Return the part in other axes; ``pose`` is the pose of its axes there, shape (4, 4)."""
        turn = pose[:3, :3]
        return RigidPart(self.mass, turn @ self.centre + pose[:3, 3], turn @ self.inertia @ turn.T)

    def with_part(self, other: RigidPart) -> RigidPart:
        """Return both parts as one."""
        mass = self.mass + other.mass
        if mass == 0:
            return self
        centre = (self.mass * self.centre + other.mass * other.centre) / mass
        inertia = sum(
            part.inertia + part.mass * _steiner(part.centre - centre) for part in (self, other)
        )
        return RigidPart(mass, centre, np.asarray(inertia))


NO_PART = RigidPart(0.0, np.zeros(3), np.zeros((3, 3)))


@dataclass(frozen=True, eq=False)
class PlacedChain:
    """A PlacedChain is a serial chain and the pose of its base in other axes.

    Attributes:
        chain: the chain, in the axes of its first joint.
        joints: names of its joints, starting at the base.
        position, rotation: of the chain's base axes in the other axes, shape (3,) in m, and shape
            (3, 3); zero and the identity if the first joint is upright and passes through their
            origin.
    """

    chain: SerialChain
    joints: tuple[str, ...]
    position: FloatArray
    rotation: FloatArray


def chain_of_axes(
    axes: list[tuple[FloatArray, FloatArray]],
    parts: list[RigidPart],
    joints: tuple[FloatArray, tuple[str, ...]],
    points: tuple[FloatArray, FloatArray],
) -> PlacedChain:
    """Give each link its frame: z along the next joint's axis, x perpendicular to both axes.

    With all joints at 0, frame i lies at the next joint's origin. The base frame lies on the first
    axis, at the point nearest to the origin. The last frame lies at the last joint's origin, like
    the one before it.

    Args:
        axes: a point on each joint's axis in m, and the axis, shape (3,) each, with all joints at
            0.
        parts: the rigid part that each joint moves.
        joints: 1 for prismatic joints and 0 for revolute ones, shape (n,), and their names.
        points: gravity in m/s^2, and the tool point in m, shape (3,) each.
    """
    n, (slides, names), (gravity, tool) = len(axes), joints, points
    frames = [_base_frame(*axes[0])]
    theta, alpha, steps = np.zeros(n), np.zeros(n), np.zeros((n, 3))
    for i in range(n):
        origin, z = axes[i + 1] if i + 1 < n else axes[i]
        turn = frames[-1][:3, :3]
        local = turn.T @ z
        theta[i], alpha[i] = _turn_and_twist(local)
        following = turn @ _about(2, theta[i]) @ _about(0, alpha[i])
        steps[i] = _about(2, theta[i]).T @ turn.T @ (origin - frames[-1][:3, 3])
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = following, origin
        frames.append(frame)
    moved = [body.moved(_inverse(frame)) for body, frame in zip(parts, frames[1:], strict=True)]
    base, last = frames[0], frames[-1]
    chain = SerialChain(
        prismatic=slides,
        theta=theta,
        alpha=alpha,
        steps=steps,
        masses=np.array([body.mass for body in moved]),
        centres=np.array([body.centre for body in moved]),
        inertias=np.array([0.5 * (body.inertia + body.inertia.T) for body in moved]),
        gravity=base[:3, :3].T @ gravity,
        tool=last[:3, :3].T @ (tool - last[:3, 3]),
    )
    return PlacedChain(chain, names, base[:3, 3], base[:3, :3])


def _turn_and_twist(z: FloatArray) -> tuple[float, float]:
    """Return angles theta and alpha of the turns, about z then about x, from e_z to ``z``."""
    across = float(np.hypot(z[0], z[1]))
    if across < PARALLEL:
        return 0.0, 0.0 if z[2] > 0 else np.pi
    # Rz(theta) Rx(alpha) e_z = (sin theta sin alpha, -cos theta sin alpha, cos alpha)
    sign = -1.0 if z[1] > 0 else 1.0  # the smaller of the two turns
    return float(np.arctan2(sign * z[0], -sign * z[1])), float(np.arctan2(sign * across, z[2]))


def _base_frame(origin: FloatArray, axis: FloatArray) -> FloatArray:
    """Return axes at the point of an axis nearest to the base's origin, with the least turn."""
    frame = np.eye(4)
    theta, alpha = _turn_and_twist(axis)
    frame[:3, :3] = _about(2, theta) @ _about(0, alpha) @ _about(2, -theta)
    frame[:3, 3] = origin - axis * (axis @ origin)
    return frame


def _about(axis: int, angle: float) -> FloatArray:
    """Return the rotation about an axis (0 to 2), shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    p, q = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[p, p], turn[p, q], turn[q, p], turn[q, q] = c, -s, s, c
    return turn


def _inverse(pose: FloatArray) -> FloatArray:
    """Return the inverse of a pose, shape (4, 4)."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def _steiner(arm: FloatArray) -> FloatArray:
    """Return the inertia of a mass of 1 kg at a place, shape (3, 3)."""
    return np.asarray(arm @ arm * np.eye(3) - np.outer(arm, arm))
