"""How features move with the inputs: reverse mode, in float64.

Differences are linear, directors have a closed form. The loads of a chain are differentiated by
the five-point formula in float64, exact to about 1e-12 of the largest terms where networks round
features to 6e-8: the recursions of ``SerialChain`` stay the only ones. The C runtime does the same
(``runtime/derivative/chain_derivative.c``).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import Director
from slide_fmu.features.feature_map import FeatureMap

TURN = 1e-3
"""Of a joint, in rad, to the nearest points of the five-point formula."""

FIVE_POINTS = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
"""Multiples of a distance, and weights of the values there for the slope times the distance."""

PullBack = Callable[[FloatArray], FloatArray]


def pull_back_features(features: FeatureMap, sequences: FloatArray) -> PullBack:
    """Reverse mode of ``FeatureMap.along``.

    Args:
        features: the set and the choice.
        sequences: scaled inputs, shape (B, N, n_channels).

    Returns:
        A function from weights of the features, shape (B, N, n_signals), to the gradient of their
        weighted sum with respect to the inputs, shape (B, N, n_channels).

    Raises:
        TypeError: a set of features without derivatives.
    """
    padded = np.pad(sequences, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge")
    of_set = _pull_back_set(features, padded)
    chosen = list(zip(features.chosen, features.scale.tolist(), strict=True))

    def pull_back(weights: FloatArray) -> FloatArray:
        signals = np.zeros((*weights.shape[:2], features.features.n_signals))
        for place, (signal, scale) in enumerate(chosen):
            signals[:, :, signal] += weights[:, :, place] / scale
        gradient = of_set(signals)
        first = gradient[:, : BEFORE + 1].sum(axis=1, keepdims=True)
        return np.concatenate([first, gradient[:, BEFORE + 1 :]], axis=1)

    return pull_back


def _pull_back_set(features: FeatureMap, padded: FloatArray) -> PullBack:
    """As ``pull_back_features``, of all signals, and to all of (B, N + BEFORE, n_channels)."""
    kind = features.features
    if isinstance(kind, Differences):
        return lambda weights: _differences(kind, weights)
    if isinstance(kind, Director):
        return lambda weights: _director(padded, weights)
    if isinstance(kind, ChainMotion):
        slopes = _chain_slopes(kind, padded)
        return lambda weights: _chain(slopes, weights, padded.shape)
    raise TypeError(f"no derivatives of features of type {type(kind).__name__}")


def _add_differences(weights: FloatArray, order: int, gradient: FloatArray) -> None:
    """What weights (B, N, ...) of differences of an order give to (B, N + BEFORE, ...)."""
    for age, factor in enumerate(((1,), (1, -1), (1, -2, 1))[order]):
        last = gradient.shape[1] - age
        gradient[:, BEFORE - age : last] += factor * weights


def _differences(features: Differences, weights: FloatArray) -> FloatArray:
    batch, count, _ = weights.shape
    gradient = np.zeros((batch, count + BEFORE, features.n_channels))
    for order, part in enumerate(np.split(weights, features.order + 1, axis=2)):
        _add_differences(part, order, gradient)
    return gradient


def _director(padded: FloatArray, weights: FloatArray) -> FloatArray:
    angles, squares = np.arctan2(padded[..., 1], padded[..., 0]), np.sum(padded**2, axis=2)
    of_angles, newest = np.zeros(angles.shape), angles[:, BEFORE:]
    of_newest = weights[..., 1] * np.cos(newest) - weights[..., 0] * np.sin(newest)
    for order, part in enumerate((of_newest, weights[..., 2], weights[..., 3])):
        _add_differences(part, order, of_angles)
    across = np.stack([-padded[..., 1], padded[..., 0]], axis=2)
    return np.asarray(across * (of_angles / squares)[..., None])


def _chain_slopes(features: ChainMotion, padded: FloatArray) -> dict[tuple[int, int], FloatArray]:
    """Slopes of the signals (B, N, n_signals) by channel and remainder of the moved samples.

    Of the samples that a signal depends on, one has each remainder by BEFORE + 1: all samples of
    the same remainder are moved at once.
    """
    slopes = {}
    for channel, half_range in enumerate(np.abs(features.half_range).tolist()):
        if half_range == 0:
            continue
        for remainder in range(BEFORE + 1):
            moved = np.zeros(padded.shape)
            moved[:, remainder :: BEFORE + 1, channel] = TURN / half_range
            total = sum(w * features.of(padded + m * moved) for m, w in FIVE_POINTS.items())
            slopes[channel, remainder] = np.asarray(total * (half_range / TURN))
    return slopes


def _chain(
    slopes: dict[tuple[int, int], FloatArray], weights: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    gradient, samples = np.zeros(shape), np.arange(weights.shape[1])
    for (channel, remainder), slope in slopes.items():
        total = (weights * slope).sum(axis=2)
        for before in range(BEFORE + 1):  # moved samples by how far they lie behind the oldest
            those = samples[(samples + before) % (BEFORE + 1) == remainder]
            gradient[:, those + before, channel] += total[:, those]
    return gradient
