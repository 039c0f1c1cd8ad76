"""Features of the motion of a serial chain: the rigid-body loads on its base."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import Features
from slide_fmu.features.serial_chain import SerialChain


class ChainMotion(Features):
    """What a serial chain does that follows its joint angles: rigid-body loads on its base. Final.

    The inputs are the set points of the joint angles. The joints move on the quadratic B-spline
    through them: with constant acceleration in every step (``mbs_models.set_points``). All signals
    are those at the end of the step. Signals in SI units, in the axes of the base:

    - ``wrench``: force and moment on the base (recursive Newton-Euler); ``wrench_change``: its
      change in the step; ``position``: of the tool point; ``rates``: of the joints;
    - ``frame``: cosine and sine of the first joint's angle, and in the axes that turn with it:
      ``turned_wrench_change``, ``turned_inertia`` (first moment and inertia tensor of the chain
      about the base's origin, ``SerialChain.base_inertia``, 9) and ``turned_momentum`` (linear
      and angular, 6).

    A base on soft ground moves by M(q) xi'' + (...) xi' + K xi = wrench: drive, statics and
    schedule of its response are among the signals.

    Args:
        chain: geometry and masses.
        middle, half_range: of the inputs' ranges in rad, shape (n_joints,): angle = middle +
            half_range * scaled input.
        step: sample step h in s.
    """

    WIDTHS: ClassVar[dict[str, int | None]] = {
        "wrench": 6,
        "wrench_change": 6,
        "position": 3,
        "rates": None,
        "frame": 2,
        "turned_wrench_change": 6,
        "turned_inertia": 9,
        "turned_momentum": 6,
    }
    """Numbers of signals by name; None: one for each joint."""
    centred = frozenset({"wrench", "turned_inertia", "position"})
    bounded = frozenset({"frame"})

    def __init__(
        self, chain: SerialChain, middle: FloatArray, half_range: FloatArray, step: float
    ) -> None:
        n = len(chain.masses)
        if np.shape(middle) != (n,) or np.shape(half_range) != (n,):
            raise ValueError(
                f"chain of {n} joints with {np.size(middle)} inputs; expected one input per joint"
            )
        if not (np.all(np.isfinite(middle)) and np.all(np.isfinite(half_range))):
            raise ValueError("chain: a middle or half range of the inputs is not finite")
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"chain: step {step} s; expected a positive, finite step")
        self.n_channels = n
        self.chain, self.step = chain, step
        self.middle, self.half_range = np.asarray(middle), np.asarray(half_range)
        self.blocks = {name: width or n for name, width in self.WIDTHS.items()}

    def of(self, inputs: FloatArray) -> FloatArray:
        """(B, N + BEFORE, n_joints) to (B, N, n_signals)."""
        points = self.middle + self.half_range * inputs
        angles = 0.5 * (points[:, 2:] + points[:, 1:-1])
        changes = np.diff(points, axis=1) / self.step
        accelerations = np.diff(changes, axis=1) / self.step
        wrenches = self.chain.base_wrench(angles, changes[:, 1:], accelerations)
        angles, rates = angles[:, 1:], changes[:, 2:]
        wrench, change = wrenches[:, 1:], np.diff(wrenches, axis=1)
        position = self.chain.tool_position(angles)
        turn, angles[..., 0] = angles[..., 0].copy(), 0.0  # as seen from the turned axes
        inertia = self.chain.base_inertia(angles)[..., 1:]
        momentum = self.chain.base_momentum(angles, rates)
        frame = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        turned = [_turned(change, turn), inertia, momentum]
        return np.concatenate([wrench, change, position, rates, frame, *turned], axis=2)


def _turned(vectors: FloatArray, angle: FloatArray) -> FloatArray:
    """Vectors (..., 3 m), three by three, in axes turned about z by an angle (...)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y, z = vectors[..., 0::3], vectors[..., 1::3], vectors[..., 2::3]
    turned = np.stack([c * x + s * y, c * y - s * x, z], axis=-1)
    return turned.reshape(vectors.shape)
