"""Records whose inputs are the same, as of one drive signal that was run several times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.periods import ALIKE, MOVES, standardized

SHARED = 0.3
"""Two records are alike if they share this part of the shorter one at least."""
TOGETHER = 0.01
"""They run together if what one has more, at either end, is at most this part of it."""


@dataclass(frozen=True)
class Likeness:
    """A Likeness says that two records have the same inputs.

    Attributes:
        records: their numbers.
        begin: sample of the first record at which the second one begins; it may be negative.
        samples: number of samples that they share.
    """

    records: tuple[int, int]
    begin: int
    samples: int

    def together(self, lengths: Sequence[int]) -> bool:
        """Tell whether both begin and end at the same place of the signal, but for little."""
        one, other = (lengths[number] for number in self.records)
        return abs(self.begin) + abs(other - one) <= TOGETHER * min(one, other)


def alike_inputs(inputs: Sequence[FloatArray]) -> list[Likeness]:
    """Find which records have the same inputs, (N, n_inputs) each, at whatever offset.

    All inputs are the same together, up to noise. What is not finite counts as the mean.
    """
    lengths = [len(one) for one in inputs]
    scaled = np.split(standardized(np.concatenate(inputs)), np.cumsum(lengths)[:-1])
    size = next_fast_len(2 * max(lengths), real=True)
    spectra = [rfft(one.astype(np.float32), size, axis=0) for one in scaled]
    sums = [_Sums.of(one) for one in scaled]
    found = []
    for first, second in combinations(range(len(inputs)), 2):
        common = irfft(np.sum(spectra[first].conj() * spectra[second], axis=1), size)
        shared = _shared(sums[first], sums[second], common)
        if shared is not None:
            found.append(Likeness((first, second), *shared))
    return found


def groups_of_records(likenesses: Sequence[Likeness], count: int) -> list[int]:
    """Number so many records: those that are alike, in one or more steps, have one number.

    Numbers rise in the order of the records.
    """
    group = list(range(count))
    for likeness in likenesses:
        one, other = sorted(group[number] for number in likeness.records)
        group = [one if number == other else number for number in group]
    known = sorted(set(group))
    return [known.index(number) for number in group]


class _Sums(NamedTuple):
    """Sums of a record's inputs over its first samples, (N + 1, n_inputs), and of their power."""

    values: FloatArray
    power: FloatArray

    @classmethod
    def of(cls, values: FloatArray) -> _Sums:
        total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
        return cls(total, np.concatenate([[0.0], np.cumsum(np.sum(values**2, axis=1))]))

    def over(self, low: NDArray[np.intp], high: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return the sums of squares over ranges, and those about the mean."""
        squares = self.power[high] - self.power[low]
        means = np.sum((self.values[high] - self.values[low]) ** 2, axis=1) / (high - low)
        return squares, squares - means


def _shared(one: _Sums, other: _Sums, common: FloatArray) -> tuple[int, int] | None:
    """Return where the second record begins if it shares the most samples, and how many.

    None if they share too few.

    Args:
        common: sums of the products of both, by the sample of the second at which the first
            begins; negative ones count from the end.
    """
    first, second = len(one.power) - 1, len(other.power) - 1
    begins = np.arange(1 - second, first)
    samples = np.minimum(begins + second, first) - np.maximum(begins, 0)
    least = MOVES * samples * one.values.shape[1]
    enough = samples >= max(2, SHARED * min(first, second))
    begins = begins[enough & (common[-begins] > (1 - ALIKE) * least)]
    low, high = np.maximum(begins, 0), np.minimum(begins + second, first)
    squares, variance = one.over(low, high)
    squares_of_other, variance_of_other = other.over(low - begins, high - begins)
    power = np.minimum(variance, variance_of_other)
    off = squares + squares_of_other - 2 * common[-begins]
    alike = (off <= ALIKE * power) & (power > MOVES * (high - low) * one.values.shape[1])
    if not alike.any():
        return None
    best = int(np.argmax(np.where(alike, high - low, 0)))
    return int(begins[best]), int(high[best] - low[best])
