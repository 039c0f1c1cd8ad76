"""Features of an angle that is given by its cosine and sine."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import Features


class Director(Features):
    """The motion of an angle given by its cosine and sine. Final.

    Signals: ``direction``, cosine and sine of the angle whatever the length of the director;
    ``turn``, the change of the angle in a step, in (-pi, pi]; ``turn_change``, its change.
    """

    n_channels = 2
    of_angle = True
    bounded = frozenset({"direction"})
    blocks = {"direction": 2, "turn": 1, "turn_change": 1}  # noqa: RUF012 (final, never changed)

    def of(self, inputs: FloatArray) -> FloatArray:
        """(B, N + BEFORE, 2) to (B, N, 4)."""
        angles = np.arctan2(inputs[:, 1:, 1], inputs[:, 1:, 0])
        turns = np.diff(angles, axis=1)
        turns -= 2 * np.pi * np.ceil((turns - np.pi) / (2 * np.pi))
        newest = angles[:, 2:]
        parts = [np.cos(newest), np.sin(newest), turns[:, 1:], np.diff(turns, axis=1)]
        return np.stack(parts, axis=2)
