"""Features of angles, given in rad or by cosine and sine, and of the other inputs."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Signal, period_of
from slide_fmu.features.base import BEFORE, FeatureOffer, Features, PullBack
from slide_fmu.features.differences import add_differences

OTHER, ANGLE, COSINE, SINE = range(4)
"""Kinds of inputs, by their numbers in files."""
LARGE_ANGLE = math.pi / 2
"""An angle with a smaller half range, in rad, changes its direction so little that it is
scaled."""


@final
class Director(Features):
    """The motion of angles; each is given directly or by its cosine and sine.

    Signals: ``direction``, cosine and sine of each angle, whatever the length of the input vector;
    ``turn``, the change of each angle in a step, in (-pi, pi] rad; ``turn_change``, the change
    of the turn. If other inputs exist: ``others``, their values, and ``other_changes``, their
    changes in a step.

    Args:
        kinds: kind of each input: ``OTHER``, ``ANGLE``, ``COSINE`` or ``SINE``; the sine of an
            angle directly follows its cosine.
        scaling: of the inputs that are ``ANGLE``, in rad; offset 0 and scale 1 for the others.

    Raises:
        ValueError: no input is an angle, a cosine or sine stands alone, or the scaling has another
            number of inputs.
    """

    TITLE = "director"
    NUMBER = 5
    NAMES = ("direction", "turn", "turn_change", "others", "other_changes")
    CHANGES_OF: ClassVar[dict[str, str]] = {"other_changes": "others"}
    n_before = 2

    def __init__(self, kinds: tuple[int, ...], scaling: Affine) -> None:
        behind = [False, *(kind == COSINE for kind in kinds)]
        whole = [kind == SINE for kind in kinds] + [False] == behind
        if not (whole and set(kinds) <= {OTHER, ANGLE, COSINE, SINE}):
            raise ValueError(
                f"director of inputs of the kinds {list(kinds)}; expected each to be 0 (none), "
                "1 (an angle), or 2 with 3 behind it (cosine and sine of an angle)"
            )
        self.n_channels, self.kinds, self.scaling = len(kinds), kinds, scaling
        self._angles = [i for i, kind in enumerate(kinds) if kind in (ANGLE, COSINE)]
        self._others = [i for i, kind in enumerate(kinds) if kind == OTHER]
        self.cosines = tuple(i for i, kind in enumerate(kinds) if kind == COSINE)
        if not self._angles or len(scaling.scale) != len(kinds):
            raise ValueError(
                f"director of inputs of the kinds {list(kinds)} with a scaling of "
                f"{len(scaling.scale)} inputs; expected an angle, and a scaling of all inputs"
            )
        n, others = len(self._angles), len(self._others)
        counts = dict(zip(self.NAMES, (2 * n, n, n, others, others), strict=True))
        self.blocks = {name: count for name, count in counts.items() if count}
        near = any(abs(scaling.scale[i]) < LARGE_ANGLE for i in self._angles if kinds[i] == ANGLE)
        self.bounded = frozenset({"others"} if near else {"direction", "others"})
        self.centred = frozenset({"direction"} if near else ())

    @classmethod
    def of_system(cls, names: tuple[str, ...], offered: FeatureOffer) -> Director:
        """Make the set for inputs that contain angles: single ones (``period_of``), or pairs."""
        kinds = kinds_of(offered.inputs)
        if set(kinds) == {OTHER}:
            raise ValueError(
                f"features {list(names)} of {len(kinds)} inputs "
                f"{[signal.name for signal in offered.inputs]}; expected an angle among them: an "
                "input in rad or deg, or with a period, or two, the cosine and sine of an angle "
                '(say so with angle = "cosine" and angle = "sine" in the system\'s signals); or '
                "use other features"
            )
        factors = np.array([2 * np.pi / (period_of(s) or 2 * np.pi) for s in offered.inputs])
        angles, scaling = np.array(kinds) == ANGLE, offered.scaling
        middle = np.where(angles, scaling.offset * factors, 0.0)
        return cls(kinds, Affine(middle, np.where(angles, scaling.scale * factors, 1.0)))

    @classmethod
    def read(cls, section: Reader, n_inputs: int) -> Director:
        """Read the kinds and the scaling of the inputs."""
        kinds = tuple(section.u32() for _ in range(n_inputs))
        return cls(kinds, Affine(section.f64(n_inputs), section.f64(n_inputs)))

    def parameters(self) -> bytes:
        """Write u32 kinds[n], f64 offset[n], f64 scale[n] of the inputs."""
        parts = (self.scaling.offset, self.scaling.scale)
        kinds = np.array(self.kinds, dtype="<u4").tobytes()
        return kinds + b"".join(part.astype("<f8").tobytes() for part in parts)

    def of(self, inputs: FloatArray) -> FloatArray:
        """Form the signals: (B, N + BEFORE, n_inputs) to (B, N, n_signals)."""
        angles = self._in_rad(inputs[:, 1:])
        turns = np.diff(angles, axis=1)
        turns -= 2 * np.pi * np.ceil((turns - np.pi) / (2 * np.pi))
        newest = angles[:, 2:]
        direction = np.stack([np.cos(newest), np.sin(newest)], axis=-1)
        others = inputs[:, BEFORE - 1 :, self._others]
        parts = [direction.reshape(*newest.shape[:2], -1), turns[:, 1:], np.diff(turns, axis=1)]
        return np.concatenate([*parts, others[:, 1:], np.diff(others, axis=1)], axis=2)

    def _in_rad(self, inputs: FloatArray) -> FloatArray:
        """Return the angles of scaled inputs, shape (B, N, n_angles)."""
        offset, scale = self.scaling.offset, self.scaling.scale
        angles = [
            np.arctan2(inputs[..., i + 1], inputs[..., i])
            if self.kinds[i] == COSINE
            else offset[i] + scale[i] * inputs[..., i]
            for i in self._angles
        ]
        return np.stack(angles, axis=-1)

    def pull_back(self, inputs: FloatArray) -> PullBack:
        """Prepare the reverse mode in closed form.

        An angle moves with the part of its vector's motion across the vector, divided by the
        length.
        """
        newest = self._in_rad(inputs[:, BEFORE:])
        c, s = np.cos(newest), np.sin(newest)
        ends = np.cumsum([2 * len(self._angles), *[len(self._angles)] * 2, len(self._others)])

        def pull_back(weights: FloatArray) -> FloatArray:
            directions, turns, changes, others, moves = np.split(weights, ends, axis=2)
            of_newest = directions[..., 1::2] * c - directions[..., 0::2] * s
            of_angles = np.zeros((*inputs.shape[:2], len(self._angles)))
            for order, part in enumerate((of_newest, turns, changes)):
                add_differences(part, order, of_angles)
            of_others = np.zeros((*inputs.shape[:2], len(self._others)))
            for order, part in enumerate((others, moves)):
                add_differences(part, order, of_others)
            gradient = self._of_inputs(of_angles, inputs)
            gradient[..., self._others] = of_others
            return gradient

        return pull_back

    def _of_inputs(self, of_angles: FloatArray, inputs: FloatArray) -> FloatArray:
        """Return the gradient of the inputs from that of the angles; zero for other inputs."""
        gradient = np.zeros(inputs.shape)
        for place, i in enumerate(self._angles):
            slope = of_angles[..., place]
            if self.kinds[i] == ANGLE:
                gradient[..., i] = self.scaling.scale[i] * slope
                continue
            x, y = inputs[..., i], inputs[..., i + 1]
            slope = slope / (x**2 + y**2)
            gradient[..., i], gradient[..., i + 1] = -y * slope, x * slope
        return gradient


def kinds_of(signals: tuple[Signal, ...]) -> tuple[int, ...]:
    """Return the kind of each input: ``OTHER``, ``ANGLE``, ``COSINE`` or ``SINE``."""

    def kind(signal: Signal) -> int:
        if signal.angle is not None:
            return COSINE if signal.angle == "cosine" else SINE
        return OTHER if period_of(signal) is None else ANGLE

    return tuple(kind(signal) for signal in signals)
