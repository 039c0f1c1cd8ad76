"""Features from the motion of a serial chain, such as the rigid-body loads on its base."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE, FeatureOffer, Features, PullBack
from slide_fmu.features.drive_law import DriveLaw
from slide_fmu.features.serial_chain import SerialChain, part_shapes

TURN = 1e-3
"""Step of a joint, in rad, between the points of the five-point formula."""

FIVE_POINTS = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
"""Positions of the points in steps, and their weights; the sum is slope times step."""


@final
class ChainMotion(Features):
    """The motion of a serial chain, and its loads; the inputs are set points of its joints.

    The joints follow their set points by a drive law. All signals are values at the end of the
    step, in SI units and in the axes of the base:

    - ``wrench``: force and moment on the base (recursive Newton-Euler); ``wrench_change``: its
      change in the step; ``position``: of the tool point; ``rates``: of the joints;
    - ``frame``: cosine and sine of the first joint's angle, and in the axes that turn with it:
      ``turned_wrench_change``, ``turned_inertia`` (first moment and inertia tensor of the chain
      about the base's origin, ``SerialChain.base_inertia``, 9) and ``turned_momentum`` (linear
      and angular, 6). Nothing turns where the first joint is prismatic.

    A base on soft ground follows M(q) xi'' + (...) xi' + K xi = wrench. The signals contain the
    state input, the feedthrough and the scheduling variables of this response.

    Args:
        chain: geometry and masses.
        law: how the joints follow their set points.
        middle, half_range: of the inputs' ranges in rad or m, shape (n_joints,): set point =
            middle + half_range * scaled input.
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
    """Number of channels by name; None: one for each joint."""
    TITLE = "chain motion"
    NUMBER = 4
    NAMES = tuple(WIDTHS)
    CHANGES_OF: ClassVar[dict[str, str]] = {
        "wrench_change": "wrench",
        "turned_wrench_change": "wrench",
    }
    centred = frozenset({"wrench", "turned_inertia", "position"})
    bounded = frozenset({"frame"})
    vectors = frozenset({"wrench_change", "turned_wrench_change", "turned_momentum"})

    def __init__(
        self,
        chain: SerialChain,
        law: DriveLaw,
        middle: FloatArray,
        half_range: FloatArray,
        step: float,
    ) -> None:
        n = chain.n_joints
        if np.shape(middle) != (n,) or np.shape(half_range) != (n,):
            raise ValueError(
                f"chain of {n} joints with {np.size(middle)} inputs; expected one input per "
                "joint, in the order of the joints"
            )
        if not (np.all(np.isfinite(middle)) and np.all(np.isfinite(half_range))):
            raise ValueError("chain: a middle or half range of the inputs is not finite")
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"chain: step {step} s; expected a positive, finite step")
        self.n_channels = n
        self.chain, self.law, self.step = chain, law, step
        self.middle, self.half_range = np.asarray(middle), np.asarray(half_range)
        self.blocks = {name: width or n for name, width in self.WIDTHS.items()}

    @classmethod
    def of_system(cls, names: tuple[str, ...], offered: FeatureOffer) -> ChainMotion:
        """Make the set on the set points of the system's serial chain."""
        if offered.chain is None:
            raise ValueError(
                f"features {list(names)} need a serial chain; this system has none: give it one "
                '(system.chain = "robot.urdf"), or use other features'
            )
        scaling, law = offered.scaling, offered.law
        return cls(offered.chain, law, scaling.offset, scaling.scale, offered.step)

    @classmethod
    def read(cls, section: Reader, n_inputs: int) -> ChainMotion:
        """Read the step, the law, the ranges and the chain."""
        n, step = n_inputs, float(section.f64(1)[0])
        law = DriveLaw.of_numbers(*section.f64(4).tolist())
        middle, half_range = section.f64(n), section.f64(n)
        shapes = part_shapes(n).items()
        parts = {name: section.f64(math.prod(shape)).reshape(shape) for name, shape in shapes}
        return cls(SerialChain(**parts), law, middle, half_range, step)

    def parameters(self) -> bytes:
        """Write f64 step, law[4], middle[n], half_range[n], then the chain's ``part_shapes``."""
        chain = [getattr(self.chain, name) for name in part_shapes(self.n_channels)]
        parts = [np.array([self.step, *self.law.numbers()]), self.middle, self.half_range, *chain]
        return b"".join(part.astype("<f8").tobytes() for part in parts)

    def of(self, inputs: FloatArray) -> FloatArray:
        """Form the signals: (B, N + BEFORE, n_joints) to (B, N, n_signals)."""
        points = self.middle + self.half_range * inputs
        places, rates, accelerations = self.law.motion(points, self.step)
        wrenches = self.chain.base_wrench(places, rates, accelerations)
        places, rates = places[:, 1:], rates[:, 1:]
        wrench, change = wrenches[:, 1:], np.diff(wrenches, axis=1)
        position = self.chain.tool_position(places)
        turn = np.zeros(places.shape[:-1])
        if not self.chain.prismatic[0]:  # in the axes that turn with the first joint
            turn, places[..., 0] = places[..., 0].copy(), 0.0
        inertia = self.chain.base_inertia(places)[..., 1:]
        momentum = self.chain.base_momentum(places, rates)
        frame = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        turned = [_turned(change, turn), inertia, momentum]
        return np.concatenate([wrench, change, position, rates, frame, *turned], axis=2)

    def pull_back(self, inputs: FloatArray) -> PullBack:
        """Prepare the reverse mode by the five-point formula in float64.

        The error is about 1e-12 of the largest terms, while networks round features to 6e-8. So
        the recursions of ``SerialChain`` need no hand-written derivative.
        """
        slopes = self._slopes(inputs)

        def pull_back(weights: FloatArray) -> FloatArray:
            gradient, samples = np.zeros(inputs.shape), np.arange(weights.shape[1])
            for (channel, remainder), slope in slopes.items():
                total = (weights * slope).sum(axis=2)
                for before in range(BEFORE + 1):  # moved samples by how far they lie behind
                    those = samples[(samples + before) % (BEFORE + 1) == remainder]
                    gradient[:, those + before, channel] += total[:, those]
            return gradient

        return pull_back

    def _slopes(self, inputs: FloatArray) -> dict[tuple[int, int], FloatArray]:
        """Return the slopes of the signals (B, N, n_signals), by channel and sample remainder.

        A signal depends on BEFORE + 1 samples, of which each has another remainder modulo BEFORE +
        1. So all samples with the same remainder are moved at once.
        """
        slopes = {}
        for channel, half_range in enumerate(np.abs(self.half_range).tolist()):
            if half_range == 0:
                continue
            for remainder in range(BEFORE + 1):
                moved = np.zeros(inputs.shape)
                moved[:, remainder :: BEFORE + 1, channel] = TURN / half_range
                total = sum(w * self.of(inputs + m * moved) for m, w in FIVE_POINTS.items())
                slopes[channel, remainder] = np.asarray(total * (half_range / TURN))
        return slopes


def _turned(vectors: FloatArray, angle: FloatArray) -> FloatArray:
    """Return vectors (..., 3 m), triples of components, in axes turned about z by angles (...)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y, z = vectors[..., 0::3], vectors[..., 1::3], vectors[..., 2::3]
    turned = np.stack([c * x + s * y, c * y - s * x, z], axis=-1)
    return turned.reshape(vectors.shape)
