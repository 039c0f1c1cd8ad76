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

ABRUPT = 4.0
"""A change of an input is a jump as far as it is larger than so many times those beside it. With
3, no sine of six samples or more in a period has one.
``slide_fmu/fmu/runtime/window/jumps.c`` has the same number."""

LOOKED_BACK = 4
"""Number of samples before one that tell whether a jump came just before it."""


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


def with_late_jumps(scaled: FloatArray, part: float) -> FloatArray:
    """Return inputs that move, (B, N, n_inputs), of which a part of each jump comes later.

    Samples do not show when within its step an input jumped: it counts as a straight line. With
    the part 0.5, the sample after a jump lacks half of it. That has the effect of a jump at the
    end of its step. The sample after it first shows that it was a jump: the changes beside it are
    smaller (``ABRUPT``). The first inputs count as constant before.
    """
    if part == 0.0:
        return scaled
    before = np.repeat(scaled[:, :1], LOOKED_BACK, axis=1)
    changes = np.diff(np.concatenate([before, scaled], axis=1), axis=1)
    oldest, older, changed, newest = (
        changes[:, i : i + scaled.shape[1]] for i in range(LOOKED_BACK)
    )
    beside = np.maximum(np.maximum(np.abs(oldest), np.abs(older)), np.abs(newest))
    jump = np.maximum(np.abs(changed) - ABRUPT * beside, 0.0)
    return np.asarray(scaled - part * np.copysign(jump, changed))


def statistics_of(
    networks: tuple[StateSpace, ErrorEstimator | None],
    blocks: tuple[int, int],
    scaled: FloatArray,
    predicted: FloatArray,
    late: float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the values that an error bound uses along sequences.

    Args:
        networks: the companion; and the error estimator, if the head takes its estimates.
        blocks: number of samples in a short and in a long block.
        scaled: scaled inputs, shape (B, N, n_inputs); the first counts as constant before.
        predicted: the surrogate's scaled outputs after each of them, shape (B, N, n_outputs).
        late: the part of each jump that the companion sees later (``with_late_jumps``).

    Returns:
        Statistics (B, N, n_statistics) and watched means (B, N, n_watched) in the order of
        ``ErrorBound``, and the disagreement (B, N, n_outputs) of ``LocalErrors``.
    """
    companion, estimator = networks
    features = companion.features.along(with_late_jumps(scaled, late))
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
