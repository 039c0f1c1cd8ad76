"""The motion of the links of a serial chain is computed link by link, in the axes of the base."""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np

from slide_fmu.core.signals import FloatArray


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
