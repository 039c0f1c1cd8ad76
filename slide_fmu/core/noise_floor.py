"""The noise floor: how much of an error on measured outputs is noise, which nobody can learn.

It is estimated from residuals, which are white noise plus the surrogate's own error; that error
follows the inputs through a system with a memory, so that its spectrum is high somewhere, while
that of white noise is flat: the noise is the flat bottom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.signal

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray

LONGEST_PIECE, SHORTEST_PIECE = 256, 16
"""A spectrum is averaged over pieces of so many samples, at most and at least."""
FEWEST_PIECES = 32
"""Pieces are made shorter until there are so many, as long as they are not the shortest."""
LOWEST_BINS = 0.25
"""The search for the bottom begins at this part of the spectrum, the lowest one."""
ABOVE = 3.0
"""Bins so many standard deviations above the bottom are no part of it."""
MOST_ROUNDS = 100
"""The bottom settles within a few rounds; more than these would go back and forth."""


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """The white part of residuals, in the outputs' units; arrays have the shape (n_outputs,).

    Attributes:
        floor: RMS of the noise, as far as it is white and the inputs do not explain it.
        total: RMS of the residuals about their mean.
    """

    floor: FloatArray
    total: FloatArray

    @property
    def share(self) -> FloatArray:
        """The part of the squared residuals that is noise; 1 where nothing else is left."""
        return np.asarray((self.floor / np.maximum(self.total, 1e-300)) ** 2)


def noise_of_residuals(residuals: Sequence[FloatArray]) -> NoiseFloor:
    """Estimate the noise floor from the residuals of trajectories that were not learnt from.

    ``residuals`` holds an array of shape (N, n_outputs) for each trajectory, of any length N from
    16 on, in the outputs' units.

    Of noise that is not white, only a part counts: the lowest level of its spectrum.

    Raises:
        ValueError: there is no trajectory, or one of fewer than 16 samples.
    """
    lengths = [len(residual) for residual in residuals]
    if min(lengths, default=0) < SHORTEST_PIECE:
        raise ValueError(
            f"residuals of {len(lengths)} trajectories, the shortest of {min(lengths, default=0)} "
            f"samples; expected at least one, and {SHORTEST_PIECE} samples in each"
        )
    spectrum, pieces = _spectrum(residuals)
    centred = np.concatenate([residual - residual.mean(axis=0) for residual in residuals])
    total = rms(centred)
    white = np.sqrt([_bottom(of_output, pieces) for of_output in spectrum.T])
    return NoiseFloor(np.minimum(white, total), total)


def _spectrum(residuals: Sequence[FloatArray]) -> tuple[FloatArray, int]:
    """Return a two-sided power density, (bins, n_outputs), and the number of averaged pieces.

    White noise has its variance in every bin. The mean and the fastest bin are left out.
    """
    samples = sum(len(residual) for residual in residuals)
    piece = min(LONGEST_PIECE, *(len(residual) for residual in residuals))
    while piece >= 2 * SHORTEST_PIECE and samples < FEWEST_PIECES * piece:
        piece //= 2
    counts = [(len(residual) - piece // 2) // (piece - piece // 2) for residual in residuals]
    parts = [scipy.signal.welch(residual, nperseg=piece, axis=0)[1] for residual in residuals]
    mean = np.average(np.stack(parts), axis=0, weights=counts)
    return np.asarray(0.5 * mean[2:-1]), sum(counts)


def _bottom(spectrum: FloatArray, pieces: int) -> float:
    """Return the level of the flat bottom of one output's spectrum, shape (bins,)."""
    ordered = np.sort(spectrum)
    level = float(ordered[: max(1, int(LOWEST_BINS * len(ordered)))].mean())
    factor = 1 + ABOVE / np.sqrt(pieces)
    for _ in range(MOST_ROUNDS):
        before, level = level, float(ordered[ordered <= factor * level].mean())
        if level == before:
            break
    return level
