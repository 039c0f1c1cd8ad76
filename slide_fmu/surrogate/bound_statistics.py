"""Statistics of a sample are what the head of an error bound sees, and what the domain watches.

They are the companion's states and features, its disagreement with the surrogate, and means of
their squares over blocks; their order is that of ``ErrorBound``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.block_means import N_BLOCKS, block_means
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE
from slide_fmu.network.base import Float32Array
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.error_estimator import ErrorEstimator

SMALLEST = 1e-30
"""Lower limit of squares in logarithms; single precision can represent it."""


def statistics_count(n_seen: int, n_outputs: int, with_estimates: bool) -> int:
    """Return the number of statistics of a sample; ``n_seen`` counts states and features."""
    return 2 * n_seen + (4 if with_estimates else 3) * n_outputs


def not_quieter(statistics: FloatArray, quietest: FloatArray) -> FloatArray:
    """Return statistics (..., n_statistics), of which the last ones are at least ``quietest``.

    These are the logarithms. An input that rests at the middle of its range has none at all, and
    the head would extrapolate far.
    """
    signed = statistics.shape[-1] - len(quietest)
    limits = np.concatenate([np.full(signed, -np.inf), quietest])
    return np.asarray(np.maximum(statistics, limits))


def logarithms(squares: FloatArray) -> Float32Array:
    """Return approximate logarithms to base 2: linear between powers of two, off by at most 0.09.

    They are taken from the bits of the number in single precision, which takes hardly any time.
    """
    single = np.maximum(squares, SMALLEST).astype(np.float32)
    bits = single.view(np.int32).astype(np.float32)
    return np.asarray(bits * np.float32(2.0**-23) - np.float32(127.0))


def statistics_of(
    networks: tuple[StateSpace, ErrorEstimator | None],
    blocks: tuple[int, int],
    scaled: FloatArray,
    predicted: FloatArray,
    ahead: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the values that an error bound uses along sequences.

    Args:
        networks: the companion; and the error estimator, if the head takes its estimates.
        blocks: number of samples in a short and in a long block.
        scaled: scaled inputs, shape (B, N, n_inputs); the first counts as constant before.
        predicted: the surrogate's scaled outputs after each of them, shape (B, N, n_outputs).
        ahead: scaled inputs as forecast while their sample is the newest, shape (B, N, n_inputs),
            if ``predicted`` was computed from them. Earlier samples are known then, also to the
            companion. (The estimator uses known samples only.)

    Returns:
        Statistics (B, N, n_statistics) and watched means (B, N, n_watched) in the order of
        ``ErrorBound``, and the disagreement (B, N, n_outputs) of ``Trust``.
    """
    companion, estimator = networks
    features = companion.features.along(scaled)
    values, states = companion.ping_pong_states(features)
    newest = known = _Seen.of(companion, predicted, values, states, features)
    if ahead is not None:
        others = _features_of_newest(companion, scaled, ahead)
        values, states = companion.ping_pong_states(features, others)
        newest = _Seen.of(companion, predicted, values, states, others)

    def means(of_known: FloatArray, of_newest: FloatArray, block: int) -> FloatArray:
        found = block_means(of_known, block)
        count = N_BLOCKS * block + 1 + np.arange(found.shape[1]) % block
        return np.maximum(found + (of_newest - of_known) / count[:, None], 0.0)

    short, long = (means(known.squares, newest.squares, block) for block in blocks)
    of_seen = means(known.values**2, newest.values**2, blocks[1])
    watched = np.concatenate([short, long, of_seen], axis=2)
    parts: list[NDArray[Any]] = [newest.values, logarithms(newest.squares), logarithms(watched)]
    if estimator is not None:
        expected = [estimator.along(sequence, short.shape[2]) for sequence in scaled]
        parts.append(logarithms(np.stack(expected)))
    statistics: FloatArray = np.concatenate(parts, axis=2)
    return statistics, watched, np.sqrt(np.maximum(newest.squares, short))


@dataclass(frozen=True, eq=False)
class _Seen:
    """_Seen holds the companion's values at every sample of B sequences.

    Attributes:
        values: states of the companion and the features that drive it, shape (B, N, n_seen).
        squares: squared disagreement, shape (B, N, n_outputs).
    """

    values: FloatArray
    squares: FloatArray

    @staticmethod
    def of(
        companion: StateSpace,
        predicted: FloatArray,
        values: Float32Array,
        states: Float32Array,
        features: Float32Array,
    ) -> _Seen:
        drive = features[:, :, list(companion.roles.drive)]
        seen = np.concatenate([states, drive], axis=2).astype(np.float64)
        return _Seen(seen, (predicted.astype(np.float64) - values.astype(np.float64)) ** 2)


def _features_of_newest(
    companion: StateSpace, scaled: FloatArray, ahead: FloatArray
) -> Float32Array:
    """Return the companion's features (B, N, q) of each sample while it is only forecast."""
    count, length, _ = scaled.shape
    before = np.concatenate([np.repeat(scaled[:, :1], BEFORE, axis=1), scaled], axis=1)
    views = np.lib.stride_tricks.sliding_window_view(before, BEFORE + 1, axis=1)
    rows = np.moveaxis(views, 3, 2).reshape(count * length, BEFORE + 1, -1).copy()
    rows[:, -1] = ahead.reshape(count * length, -1)
    return companion.features.along(rows)[:, -1].reshape(count, length, -1)
