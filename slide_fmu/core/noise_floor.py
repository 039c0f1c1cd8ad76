"""The noise floor is the part of an error on measured outputs that is noise and cannot be learnt.

It is estimated from residuals: white noise plus the surrogate's own error. That error follows the
inputs through a system with memory, so its spectrum has peaks. The spectrum of white noise is
flat: the noise is the flat bottom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.signal

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray

LONGEST_PIECE, SHORTEST_PIECE = 256, 16
"""Longest and shortest piece, in samples, whose spectra are averaged."""
FEWEST_PIECES = 32
"""Pieces are halved until there are this many of them, or until they are the shortest."""
LOWEST_BINS = 0.25
"""The search for the bottom starts with this lowest fraction of the spectrum."""
ABOVE = 3.0
"""Bins more than this number of standard deviations above the bottom are no part of it."""
MOST_ROUNDS = 100
"""Limit of the rounds; the bottom settles within a few, unless they alternate."""


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """A NoiseFloor is the white part of residuals, in the outputs' units; shapes (n_outputs,).

    Attributes:
        floor: RMS of the noise that is white and that the inputs do not explain.
        total: RMS of the residuals about their mean.
    """

    floor: FloatArray
    total: FloatArray

    @property
    def share(self) -> FloatArray:
        """The part of the squared residuals that is noise; 1 where nothing else is left."""
        return np.asarray((self.floor / np.maximum(self.total, 1e-300)) ** 2)


def noise_of_residuals(residuals: Sequence[FloatArray]) -> NoiseFloor:
    """Estimate the noise floor from the residuals of trajectories that were not trained on.

    ``residuals`` has one array of shape (N, n_outputs) for each trajectory, N at least 16, in the
    outputs' units.

    Of coloured noise, only the lowest level of its spectrum counts.

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
