"""Inputs lie in the ranges of the training, or have left them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import Signal, cosines_of

RANGE_SLACK = 1e-6
"""Scaled inputs have the range -1 to 1; how far outside they still count as inside: rounding."""

LENGTH_SLACK = 0.01
"""How far the length of an angle's cosine and sine, 1 in the training, may be from that."""


def in_ranges(signals: tuple[Signal, ...], scaled: NDArray[Any]) -> NDArray[np.bool_]:
    """Say whether single scaled inputs lie in their ranges: (N, n_inputs) to (N,)."""
    inside = np.abs(scaled) <= 1 + RANGE_SLACK
    for cosine in cosines_of(signals):
        lengths = np.hypot(scaled[:, cosine], scaled[:, cosine + 1])
        inside[:, cosine : cosine + 2] = (np.abs(lengths - 1) <= LENGTH_SLACK)[:, None]
    return np.asarray(inside.all(axis=1))


def inside_throughout(inside: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Tell whether the newest ``count`` samples are inside, the first held before; (N,) both."""
    samples = np.arange(len(inside))
    strayed = np.maximum.accumulate(np.where(inside, -count, samples))
    return np.asarray(samples - strayed >= count)
