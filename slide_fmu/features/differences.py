"""The inputs themselves, and their backward differences, as features."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE, Features

MAX_DIFFERENCES = 2
"""Highest order of the differences of inputs."""


class Differences(Features):
    """The inputs and their backward differences. Final.

    Signals: ``inputs``; from order 1 on ``changes``, u_k - u_(k-1); at order 2
    ``second_changes``, the changes of those.

    Raises:
        ValueError: an order or a number of channels out of range.
    """

    NAMES = ("inputs", "changes", "second_changes")
    bounded = frozenset({"inputs"})

    def __init__(self, n_channels: int, order: int = 0) -> None:
        if not 0 <= order <= MAX_DIFFERENCES or n_channels < 1:
            raise ValueError(
                f"features of {n_channels} inputs with differences = {order}; expected at least "
                f"one input and differences from 0 to {MAX_DIFFERENCES}"
            )
        self.n_channels, self.order = n_channels, order
        self.blocks = dict.fromkeys(self.NAMES[: order + 1], n_channels)

    def of(self, inputs: FloatArray) -> FloatArray:
        """Inputs, first and second differences: (B, N + BEFORE, c) to (B, N, c (order + 1))."""
        parts = [inputs]
        for _ in range(self.order):
            parts.append(np.diff(parts[-1], axis=1))
        count = inputs.shape[1] - BEFORE
        return np.concatenate([part[:, part.shape[1] - count :] for part in parts], axis=2)
