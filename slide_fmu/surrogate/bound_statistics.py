"""Statistics of a sample are what the head of an error bound sees, and what the domain watches.

They are the companion's states and features, its disagreement with the surrogate, and means of
their squares over blocks; their order is that of ``ErrorBound``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.block_means import block_means
from slide_fmu.core.signals import FloatArray
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
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the values that an error bound uses along sequences.

    Args:
        networks: the companion; and the error estimator, if the head takes its estimates.
        blocks: number of samples in a short and in a long block.
        scaled: scaled inputs, shape (B, N, n_inputs); the first counts as constant before.
        predicted: the surrogate's scaled outputs after each of them, shape (B, N, n_outputs).

    Returns:
        Statistics (B, N, n_statistics) and watched means (B, N, n_watched) in the order of
        ``ErrorBound``, and the disagreement (B, N, n_outputs) of ``LocalErrors``.
    """
    companion, estimator = networks
    features = companion.features.along(scaled)
    values, states = companion.ping_pong_states(features)
    drive = features[:, :, list(companion.roles.drive)]
    seen = np.concatenate([states, drive], axis=2).astype(np.float64)
    squares = (predicted.astype(np.float64) - values.astype(np.float64)) ** 2
    short, long = (block_means(squares, block) for block in blocks)
    of_seen = block_means(seen**2, blocks[1])
    watched = np.concatenate([short, long, of_seen], axis=2)
    parts: list[NDArray[Any]] = [seen, logarithms(squares), logarithms(watched)]
    if estimator is not None:
        expected = [estimator.along(sequence, short.shape[2]) for sequence in scaled]
        parts.append(logarithms(np.stack(expected)))
    statistics: FloatArray = np.concatenate(parts, axis=2)
    return statistics, watched, np.sqrt(np.maximum(squares, short))
