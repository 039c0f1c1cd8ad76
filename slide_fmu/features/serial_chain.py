"""Rigid kinematics and dynamics of a serial chain of joints on a fixed base are computed here.

All formulas are recursions over the links with 3-vectors in base axes, for any leading batch
shape. The C code follows them line by line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, final

import numpy as np

from slide_fmu.core.signals import FloatArray

SYMMETRY = 1e-9
"""Largest difference between an inertia tensor and its transpose, relative to the sum of the
absolute values of the two diagonal entries in the same row and column; rounding of rotations is
smaller."""


def part_shapes(n: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of a chain's arrays by name, for n joints, in the order of their bytes."""
    joints = {**dict.fromkeys(("prismatic", "theta", "alpha"), (n,)), "steps": (n, 3)}
    links = {"masses": (n,), "centres": (n, 3), "inertias": (n, 3, 3)}
    return {**joints, **links, "gravity": (3,), "tool": (3,)}


@dataclass(frozen=True, eq=False)
class SerialChain:
    """A SerialChain has n links; each turns about z of the frame before it or slides along it.

    Frame i is frame i - 1, turned by theta_i about z, moved by ``steps[i]`` in its turned axes,
    and turned by alpha_i about its new x. A revolute joint adds its angle to theta_i, a prismatic
    one adds its displacement to the third component of the step. Link i moves with frame i. Frame
    0 gives the base axes: z along the first joint. Joints about any axes have such frames; with
    the convention of Denavit and Hartenberg the second component of each step is zero.

    Attributes:
        prismatic: 1 for prismatic joints, 0 for revolute ones, shape (n,).
        theta: turns in rad, shape (n,).
        alpha: twists in rad, shape (n,).
        steps: in m, shape (n, 3).
        masses: in kg, shape (n,).
        centres: centres of mass in link frames in m, shape (n, 3).
        inertias: tensors about the centres of mass in link axes in kg m^2, shape (n, 3, 3);
            symmetric.
        gravity: acceleration of gravity in base axes in m/s^2, shape (3,).
        tool: tool point in the last link frame in m, shape (3,).

    Raises:
        ValueError: shapes do not match, a number is not finite, a joint is neither revolute nor
            prismatic, or an inertia tensor is not symmetric.
    """

    prismatic: FloatArray
    theta: FloatArray
    alpha: FloatArray
    steps: FloatArray
    masses: FloatArray
    centres: FloatArray
    inertias: FloatArray
    gravity: FloatArray
    tool: FloatArray

    @classmethod
    def denavit_hartenberg(
        cls, a: FloatArray, d: FloatArray, alpha: FloatArray, **links: FloatArray
    ) -> SerialChain:
        """Make a chain of revolute joints by the standard parameters of Denavit and Hartenberg.

        Args:
            a: lengths in m, shape (n,).
            d: offsets in m, shape (n,).
            alpha: twists in rad, shape (n,).
            links: masses and all arrays after them, as the attributes.

        Raises:
            ValueError: as for the class; or the parameters have other shapes.
        """
        n = len(links["masses"])
        for name, value in {"a": a, "d": d, "alpha": alpha}.items():
            if value.shape != (n,):
                raise ValueError(
                    f"serial chain: {name} = {value} of shape {value.shape}; expected finite "
                    f"numbers, shape {(n,)}"
                )
        still = np.zeros(n)
        steps = np.stack([a, still, d], axis=1)
        return cls(prismatic=still, theta=still, alpha=alpha, steps=steps, **links)

    def __post_init__(self) -> None:
        for name, shape in part_shapes(len(self.theta)).items():
            value = getattr(self, name)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(
                    f"serial chain: {name} = {value} of shape {value.shape}; "
                    f"expected finite numbers, shape {shape}"
                )
        if not np.isin(self.prismatic, (0.0, 1.0)).all():
            raise ValueError(
                f"serial chain: prismatic = {self.prismatic}; expected 1 for prismatic joints and "
                "0 for revolute ones"
            )
        self._require_symmetry()

    def _require_symmetry(self) -> None:
        """Refuse inertia tensors that are not symmetric; the C runtime does the same."""
        for link, inertia in enumerate(self.inertias.tolist()):
            for i, j in ((1, 2), (2, 0), (0, 1)):
                diagonal = abs(inertia[i][i]) + abs(inertia[j][j])
                if abs(inertia[i][j] - inertia[j][i]) > SYMMETRY * diagonal:
                    raise ValueError(
                        f"serial chain: inertias[{link}] has {inertia[i][j]} kg m^2 at {i, j} and "
                        f"{inertia[j][i]} kg m^2 at {j, i}; expected a symmetric tensor: use the "
                        "mean of it and its transpose"
                    )

    @property
    def n_joints(self) -> int:
        """The number of joints."""
        return len(self.theta)

    def turned(self, rotation: FloatArray) -> SerialChain:
        """Return the chain on a base whose axes are the columns of a rotation matrix, (3, 3).

        The chain keeps its base axes; only the direction of gravity in them changes.
        """
        return replace(self, gravity=rotation.T @ self.gravity)

    def forward_kinematics(self, q: FloatArray) -> Frames:
        """Return the frames at joint positions q, shape (..., n)."""
        steps, turns = self._link_transformations(self._places("q", q))
        position, rotation = np.zeros((*steps.shape[:-2], 3)), np.eye(3)
        positions = np.empty((*steps.shape[:-2], self.n_joints + 1, 3))
        rotations = np.empty((*positions.shape, 3))
        positions[..., 0, :], rotations[..., 0, :, :] = position, rotation
        for i in range(self.n_joints):
            position = position + times(rotation, steps[..., i, :])
            rotation = rotation @ turns[..., i, :, :]
            positions[..., i + 1, :], rotations[..., i + 1, :, :] = position, rotation
        return Frames(positions, rotations)

    def tool_position(self, q: FloatArray) -> FloatArray:
        """Return the tool point in base axes in m, (..., 3), at joint positions q, (..., n)."""
        turns, slides = self._turns_and_slides(self._places("q", q))
        cosines, sines = np.cos(turns), np.sin(turns)
        twists = zip(np.cos(self.alpha).tolist(), np.sin(self.alpha).tolist(), strict=True)
        links = list(zip(self.steps.tolist(), twists, strict=True))
        x, y, z = self.tool.tolist()
        for i in reversed(range(self.n_joints)):
            (a, b, _), (c, s) = links[i]
            along, across, z = x + a, c * y - s * z + b, s * y + c * z + slides[..., i]
            c, s = cosines[..., i], sines[..., i]
            x, y = c * along - s * across, s * along + c * across
        position = np.empty((*cosines.shape[:-1], 3))
        position[..., 0], position[..., 1], position[..., 2] = x, y, z
        return position

    def base_wrench(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return force in N and moment in N m of the chain ON its base, about the base origin.

        It is the sum of weight and inertia forces of all links, in base axes; at rest it is the
        weight. Its negative holds the base in place. Joint positions in rad or m, their rates and
        second derivatives by s and s^2, (..., n) each, give force and moment, (..., 6).
        """
        forces, moments, _ = self._link_wrenches(q, dq, ddq)
        both = np.concatenate([forces.sum(axis=-2), moments.sum(axis=-2)], axis=-1)
        return np.asarray(-both)

    def joint_torques(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the torques in N m, or forces in N, that the drives need, shape (..., n).

        Arguments are as for ``base_wrench``.
        """
        forces, moments, frames = self._link_wrenches(q, dq, ddq)
        forces = np.flip(np.cumsum(np.flip(forces, -2), axis=-2), -2)
        moments = np.flip(np.cumsum(np.flip(moments, -2), axis=-2), -2)
        axes, origins = frames.rotations[..., :-1, :, 2], frames.positions[..., :-1, :]
        moments = moments - cross(origins, forces)
        needed = np.where(self.prismatic[:, None] == 1, forces, moments)
        return np.asarray(np.sum(axes * needed, axis=-1))

    def base_inertia(self, q: FloatArray) -> FloatArray:
        """Return mass, first moment and inertia of the chain about the base origin, in base axes.

        Joint positions q, (..., n), give (..., 10): mass in kg; mass times centre of mass (3) in
        kg m; entries xx, yy, zz, xy, xz, yz of the inertia tensor in kg m^2 (xy is minus the
        integral of x y).
        """
        frames = self.forward_kinematics(q)
        centres = self._centres(frames)
        mass = np.broadcast_to(self.masses.sum(), (*centres.shape[:-2], 1))
        first = np.sum(self.masses[:, None] * centres, axis=-2)
        squares = np.sum(centres**2, axis=-1)[..., None, None] * np.eye(3)
        steiner = squares - centres[..., :, None] * centres[..., None, :]
        tensors = self._inertias(frames) + self.masses[:, None, None] * steiner
        tensor = tensors.sum(axis=-3)
        entries = tensor[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return np.concatenate([mass, first, entries], axis=-1)

    def base_momentum(self, q: FloatArray, dq: FloatArray) -> FloatArray:
        """Return the momenta in N s and N m s of the chain about the base origin, in base axes.

        Joint positions q and their rates, (..., n), give (..., 6), the linear momentum first.
        """
        frames = self.forward_kinematics(q)
        motion = LinkMotion(
            self.prismatic, self._places("dq", dq), np.zeros(q.shape), frames, np.zeros(3)
        )
        centres, inertias = self._centres(frames), self._inertias(frames)
        linear, angular = np.zeros((*q.shape[:-1], 3)), np.zeros((*q.shape[:-1], 3))
        for i in range(self.n_joints):
            arm = centres[..., i, :] - frames.positions[..., i, :]
            motion.enter(i)
            momentum = self.masses[i] * (motion.velocity + cross(motion.omega, arm))
            linear = linear + momentum
            angular = angular + cross(centres[..., i, :], momentum)
            angular = angular + times(inertias[..., i, :, :], motion.omega)
            motion.leave(i)
        return np.concatenate([linear, angular], axis=-1)

    def _link_wrenches(
        self, q: FloatArray, dq: FloatArray, ddq: FloatArray
    ) -> tuple[FloatArray, FloatArray, Frames]:
        """Return the force and moment of each link's motion about the base origin, (..., n, 3)."""
        frames = self.forward_kinematics(q)
        rates, changes = self._places("dq", dq), self._places("ddq", ddq)
        motion = LinkMotion(self.prismatic, rates, changes, frames, -self.gravity)
        centres, inertias = self._centres(frames), self._inertias(frames)
        shape = np.broadcast_shapes(q.shape, dq.shape, ddq.shape)
        forces, moments = np.empty((*shape, 3)), np.empty((*shape, 3))
        for i in range(self.n_joints):
            centre, inertia = centres[..., i, :], inertias[..., i, :, :]
            motion.enter(i)
            force = self.masses[i] * motion.acceleration_at(centre - frames.positions[..., i, :])
            spin = times(inertia, motion.omega)
            moment = times(inertia, motion.alpha) + cross(motion.omega, spin)
            forces[..., i, :], moments[..., i, :] = force, moment + cross(centre, force)
            motion.leave(i)
        return forces, moments, frames

    def _link_transformations(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return origins (..., n, 3) and axes (..., n, 3, 3) of frames in their predecessors."""
        angles, slides = self._turns_and_slides(q)
        c, s, (a, b, _) = np.cos(angles), np.sin(angles), self.steps.T
        ca, sa = np.cos(self.alpha), np.sin(self.alpha)
        steps, turns = np.empty((*q.shape, 3)), np.empty((*q.shape, 3, 3))
        steps[..., 0], steps[..., 1], steps[..., 2] = a * c - b * s, a * s + b * c, slides
        turns[..., 0, 0], turns[..., 0, 1], turns[..., 0, 2] = c, -s * ca, s * sa
        turns[..., 1, 0], turns[..., 1, 1], turns[..., 1, 2] = s, c * ca, -c * sa
        turns[..., 2, 0], turns[..., 2, 1], turns[..., 2, 2] = 0.0, sa, ca
        return steps, turns

    def _turns_and_slides(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return turns about z in rad and ways along it in m of all joints, (..., n) each."""
        return self.theta + (1 - self.prismatic) * q, self.steps[:, 2] + self.prismatic * q

    def _centres(self, frames: Frames) -> FloatArray:
        """Return the centres of mass in base axes, shape (..., n, 3)."""
        return frames.positions[..., 1:, :] + times(frames.rotations[..., 1:, :, :], self.centres)

    def _inertias(self, frames: Frames) -> FloatArray:
        """Return inertia tensors about the centres of mass in base axes, (..., n, 3, 3)."""
        rotations = frames.rotations[..., 1:, :, :]
        return np.asarray(rotations @ self.inertias @ np.swapaxes(rotations, -1, -2))

    def _places(self, name: str, values: FloatArray) -> FloatArray:
        """Return values as an array with one entry per joint."""
        if values.ndim == 0 or values.shape[-1] != self.n_joints:
            raise ValueError(
                f"serial chain: {name} of shape {values.shape}; expected (..., {self.n_joints})"
            )
        return values


class Frames(NamedTuple):
    """The frames of a chain in base axes: the base (index 0) and the n link frames.

    Attributes:
        positions: origins in m, shape (..., n + 1, 3).
        rotations: R, shape (..., n + 1, 3, 3); a vector v in link axes is R v in base axes.
    """

    positions: FloatArray
    rotations: FloatArray


@final
class LinkMotion:
    """A LinkMotion holds the motion of one link at a time, in base axes."""

    def __init__(
        self,
        slides: FloatArray,
        dq: FloatArray,
        ddq: FloatArray,
        frames: Frames,
        base: FloatArray,
    ) -> None:
        """Start at the base, whose origin has the acceleration ``base``, shape (3,).

        ``slides``, (n,), is 1 for joints that slide; dq and ddq, (..., n), are the rates of the
        joints and their derivatives.
        """
        self._slides = slides
        self._dq, self._ddq, self._frames = dq[..., None], ddq[..., None], frames
        self.omega, self.alpha = np.zeros(3), np.zeros(3)
        self.velocity, self.acceleration = np.zeros(3), base

    def enter(self, i: int) -> None:
        """Move on to link i (from 0), at the origin of the frame before it."""
        axis = self._frames.rotations[..., i, :, 2]
        rate, change = axis * self._dq[..., i, :], axis * self._ddq[..., i, :]
        if self._slides[i]:
            coriolis = 2 * cross(self.omega, rate)
            self.acceleration = self.acceleration + change + coriolis
            self.velocity = self.velocity + rate
        else:
            self.alpha = self.alpha + change + cross(self.omega, rate)
            self.omega = self.omega + rate

    def leave(self, i: int) -> None:
        """Move on to the origin of the frame of link i (from 0)."""
        arm = self._frames.positions[..., i + 1, :] - self._frames.positions[..., i, :]
        self.acceleration = self.acceleration_at(arm)
        self.velocity = self.velocity + cross(self.omega, arm)

    def acceleration_at(self, arm: FloatArray) -> FloatArray:
        """Give the acceleration of a point of the link, (..., 3) away from the current origin."""
        turning = cross(self.omega, cross(self.omega, arm))
        return self.acceleration + cross(self.alpha, arm) + turning


def times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply matrices (..., 3, 3) and vectors (..., 3)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return cross products of vectors (..., 3); faster than numpy's for single vectors."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    result[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    result[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result
