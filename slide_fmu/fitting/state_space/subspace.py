"""Linear models of all orders follow from what the past of records says about their future.

The method is a subspace identification with past inputs and outputs as instruments (PO-MOESP:
Verhaegen, "Identification of the deterministic part of MIMO state space models", Automatica 30,
1994; Van Overschee and De Moor, "Subspace Identification for Linear Systems", 1996). Stretches of
samples are the columns of Hankel matrices. What the future inputs explain of the future outputs is
taken away; the directions of the rest that the past explains are those of the states. White noise
of the outputs does not shift them. They are ordered by canonical correlations (CVA: Larimore,
1990), so that strong outputs, and what is not linear in them, do not hide the others. The number
of states is counted by what they add to the outputs.

A column lies in one trajectory as a whole, so that none crosses the end of a file or a gap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import scipy.linalg
from numpy.lib.stride_tricks import sliding_window_view

from slide_fmu.core.measures import TINY
from slide_fmu.core.signals import FloatArray

ROWS = 600
"""Largest number of rows of the Hankel matrices: the time grows with its square."""
LONGEST, SHORT, SHORTEST = 100, 10, 2
"""Largest and smallest number of samples in the past, and in the future. Noise makes it smaller
down to the second one only."""
COLUMNS = 60_000
"""Number of columns that suffice; of more, every second, third and so on is taken."""
RIDGE = 1e-8
"""Smallest power of a direction of past and future, relative to their mean power: inputs of a
narrow band hardly have some directions, and outputs without noise follow from the others."""
LEAST_SHOWN = 0.02
"""Singular values below this fraction of the largest do not indicate a state."""
FORGOTTEN = 0.03
"""A forgets directions of the states whose singular values are below this one within a sample."""
SURE = 0.1
"""A canonical correlation shows a state if it is above that of noise by this much."""


@final
@dataclass(frozen=True, eq=False)
class Subspace:
    """A Subspace has the directions of future outputs that the past explains.

    Attributes:
        directions: directions of the future outputs times their canonical correlations with the
            past, shape (samples * p, directions), the largest first.
        correlations: the canonical correlations, shape (directions,).
        energy: singular values of what the past explains of the future outputs, shape
            (directions,).
        chance: the largest canonical correlation of noise.
        n_outputs: the number p of outputs.
    """

    directions: FloatArray
    correlations: FloatArray
    energy: FloatArray
    chance: float
    n_outputs: int

    @property
    def highest_order(self) -> int:
        """The largest number of states that so many samples can show."""
        return len(self.directions) - self.n_outputs

    @property
    def states_shown(self) -> int:
        """The number of states that the singular values show, at least 1."""
        strong = int((self.energy > LEAST_SHOWN * self.energy[0]).sum())
        shown = min(strong, int((self.correlations > self.chance + SURE).sum()))
        return max(1, min(shown, self.highest_order))

    def model(self, order: int) -> tuple[FloatArray, FloatArray]:
        """Return A, (n, n), and C, (p, n), of the model of an order: y[k] = C x[k].

        Raises:
            ValueError: the order is higher than the subspace can show.
        """
        if order > self.highest_order:
            samples = len(self.directions) // self.n_outputs
            raise ValueError(
                f"network.order = {order}; expected at most {self.highest_order} for "
                f"{self.n_outputs} outputs over {samples} samples: lower it, or record for longer"
            )
        for fewer in range(order, max(0, order - self.n_outputs - 1), -1):
            a, c = self._after_input(fewer)
            if len(a) == order:
                return a, c
        return self._before_input(order)

    def _after_input(self, order: int) -> tuple[FloatArray, FloatArray]:
        """Return A and C of states that the newest input has moved, as y[k] = C x[k] has them.

        Those before it follow from these, but for what A forgets within one sample: the end of a
        delay. So many states more keep it, and A has more rows than the order.
        """
        a, c = self._before_input(order)
        left, size, right = np.linalg.svd(a)
        kept, lost = size >= FORGOTTEN, right[size < FORGOTTEN]
        before = right[kept].T / size[kept] @ left[:, kept].T
        zero = np.zeros((len(right), len(lost)))
        later = np.block([[a, zero], [lost, zero[: len(lost)]]])
        return later, np.concatenate([c @ before, c @ lost.T], axis=1)

    def _before_input(self, order: int) -> tuple[FloatArray, FloatArray]:
        """Return A, (n, n), and C, (p, n), of states that the newest input has not moved."""
        size = np.sqrt(np.maximum(self.correlations[:order], TINY))
        seen, p = self.directions[:, :order] / size, self.n_outputs
        return np.linalg.lstsq(seen[:-p], seen[p:], rcond=None)[0], seen[:p]


def subspace_of(inputs: Sequence[FloatArray], outputs: Sequence[FloatArray]) -> Subspace:
    """Find the subspace of trajectories: inputs (N, q) and outputs (N, p) of the same samples.

    Outputs may be NaN. Both are taken about their means.

    Raises:
        ValueError: trajectories are too short, or outputs are missing nearly everywhere.
    """
    q, p = inputs[0].shape[1], outputs[0].shape[1]
    samples = _samples([len(one) for one in inputs], p + q)
    products, count = _products(inputs, outputs, samples)
    if count <= len(products):
        raise ValueError(
            f"{count} stretches of {2 * samples} samples have all outputs; expected more than "
            f"{len(products)} for a linear fit: record more, with fewer gaps"
        )
    products.flat[:: len(products) + 1] += RIDGE * np.trace(products) / len(products)
    lower = scipy.linalg.cholesky(products / count, lower=True)
    known, future = samples * q + 1, samples * p
    explained, whole = lower[-future:, known : len(lower) - future], lower[-future:, known:]
    energy = np.linalg.svd(explained, compute_uv=False)
    own = whole @ whole.T
    own.flat[:: future + 1] += RIDGE * np.trace(own) / future
    scale = scipy.linalg.cholesky(own, lower=True)
    canonical = scipy.linalg.solve_triangular(scale, explained, lower=True)
    left, singular, _ = np.linalg.svd(canonical, full_matrices=False)
    chance = _correlation_of_noise(samples * (p + q) / count, future / count)
    return Subspace(scale @ left * singular, singular, energy, chance, p)


def _correlation_of_noise(past: float, future: float) -> float:
    """Return the largest canonical correlation of white noise with other white noise.

    Past and future are the numbers of rows of both over the number of columns (Wachter, "The
    limiting empirical measure of multiple discriminant ratios", Annals of Statistics 8, 1980).
    """
    past, future = min(past, 0.5), min(future, 0.5)
    return math.sqrt(past * (1 - future)) + math.sqrt(future * (1 - past))


def _samples(lengths: Sequence[int], signals: int) -> int:
    """Return the number of samples in the past, and in the future, that trajectories suffice for.

    Noise is averaged over many more columns than rows, if possible.
    """
    samples = min(LONGEST, ROWS // (2 * signals))
    for least, columns in ((SHORT, 25), (SHORTEST, 2)):
        while samples > least and _starts(lengths, samples) < columns * 2 * samples * signals:
            samples -= 1
    return max(SHORTEST, samples)


def most_states(lengths: Sequence[int], n_inputs: int, n_outputs: int) -> int:
    """Return the highest order that trajectories of these lengths can show."""
    return (_samples(lengths, n_inputs + n_outputs) - 1) * n_outputs


def _starts(lengths: Sequence[int], samples: int) -> int:
    """Count the columns for so many samples in the past, and in the future."""
    return sum(max(0, length - 2 * samples + 1) for length in lengths)


def _products(
    inputs: Sequence[FloatArray], outputs: Sequence[FloatArray], samples: int
) -> tuple[FloatArray, int]:
    """Return the sum of products of the Hankel matrices' rows, and the number of columns.

    The rows are ones, the inputs of the future, the inputs and outputs of the past, and the
    outputs of the future.
    """
    q, p = inputs[0].shape[1], outputs[0].shape[1]
    mean_u = np.concatenate(list(inputs)).mean(axis=0)
    mean_y = np.nanmean(np.concatenate(list(outputs)), axis=0)
    width = 2 * samples * (p + q) + 1
    products, count = np.zeros((width, width)), 0
    stride = max(1, _starts([len(one) for one in inputs], samples) // COLUMNS)
    for u, y in zip(inputs, outputs, strict=True):
        if len(u) < 2 * samples:
            continue
        columns = _columns(u - mean_u, y - mean_y, samples, stride)
        for block in columns:
            products += block.T @ block
            count += len(block)
    return products, count


def _columns(
    u: FloatArray, y: FloatArray, samples: int, stride: int, size: int = 4096
) -> Iterator[FloatArray]:
    """Return columns of the Hankel matrices as rows, some at a time; none has a NaN."""
    views = [
        sliding_window_view(part, 2 * samples, axis=0)[::stride].transpose(0, 2, 1)
        for part in (u, y)
    ]
    for first in range(0, len(views[0]), size):
        of_u, of_y = (view[first : first + size] for view in views)
        parts = of_u[:, samples:], of_u[:, :samples], of_y[:, :samples], of_y[:, samples:]
        ones = np.ones((len(of_u), 1))
        block = np.concatenate([ones, *(part.reshape(len(part), -1) for part in parts)], axis=1)
        yield block[np.isfinite(block).all(axis=1)]
