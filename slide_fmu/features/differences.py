"""Features that are the inputs themselves and their backward differences."""

from __future__ import annotations

import struct
from typing import final

import numpy as np

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE, FeatureOffer, Features, PullBack

MAX_DIFFERENCES = 2
"""Highest order of the differences."""


@final
class Differences(Features):
    """The inputs and their backward differences.

    Signals: ``inputs``; from order 1 on ``changes``, u_k - u_(k-1); at order 2 ``second_changes``,
    the changes of the changes.

    Raises:
        ValueError: an order or a number of channels out of range.
    """

    TITLE = "differences"
    NUMBER = 1
    NAMES = ("inputs", "changes", "second_changes")
    CHANGES_OF = {"changes": "inputs", "second_changes": "inputs"}  # noqa: RUF012 (never changed)
    linear = True
    bounded = frozenset({"inputs"})

    def __init__(self, n_channels: int, order: int = 0) -> None:
        if not 0 <= order <= MAX_DIFFERENCES or n_channels < 1:
            raise ValueError(
                f"features of {n_channels} inputs with differences = {order}; expected at least "
                f"one input and differences from 0 to {MAX_DIFFERENCES}"
            )
        self.n_channels, self.order = n_channels, order
        self.n_before = order
        self.blocks = dict.fromkeys(self.NAMES[: order + 1], n_channels)

    @classmethod
    def of_system(cls, names: tuple[str, ...], offered: FeatureOffer) -> Differences:
        """Make the set up to the highest order that the names contain."""
        return cls(len(offered.inputs), max(cls.NAMES.index(name) for name in names))

    @classmethod
    def read(cls, section: Reader, n_inputs: int) -> Differences:
        """Read the order."""
        return cls(n_inputs, section.u32())

    def parameters(self) -> bytes:
        """Write u32 order."""
        return struct.pack("<I", self.order)

    def of(self, inputs: FloatArray) -> FloatArray:
        """Form inputs and differences: (B, N + BEFORE, c) to (B, N, c (order + 1))."""
        parts = [inputs]
        for _ in range(self.order):
            parts.append(np.diff(parts[-1], axis=1))
        count = inputs.shape[1] - BEFORE
        return np.concatenate([part[:, part.shape[1] - count :] for part in parts], axis=2)

    def pull_back(self, inputs: FloatArray) -> PullBack:
        """Prepare the reverse mode: the transposed sums, which do not depend on the inputs."""

        def pull_back(weights: FloatArray) -> FloatArray:
            gradient = np.zeros(inputs.shape)
            for order, part in enumerate(np.split(weights, self.order + 1, axis=2)):
                add_differences(part, order, gradient)
            return gradient

        return pull_back


def add_differences(weights: FloatArray, order: int, gradient: FloatArray) -> None:
    """Add the contribution of weighted backward differences to the gradient of their samples.

    The weights of differences of order 0 to 2 have the shape (B, N, ...). The gradient, (B, N +
    BEFORE, ...), is changed in place.
    """
    for age, factor in enumerate(((1,), (1, -1), (1, -2, 1))[order]):
        last = gradient.shape[1] - age
        gradient[:, BEFORE - age : last] += factor * weights
