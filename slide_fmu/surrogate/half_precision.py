"""Weights in half precision: half the bytes that an evaluation of layers reads, and what it costs.

Weights of feed-forward layers are rounded to float16; the arithmetic stays float32. State-space
networks keep float32: their few weights lie in the nearest cache, so that rounding gains no time,
and it would change how they remember.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.base import Network
from slide_fmu.network.feed_forward import FeedForward, rounded_to_half
from slide_fmu.surrogate.surrogate import Surrogate

Weights = Literal["float32", "float16"]
SEED, RECORDS, WINDOWS, KNOTS = 20_261_120, 8, 4, 12
"""Random inputs of the comparison: seed, records, their length in windows, knots per window."""


def with_weights(surrogate: Surrogate, weights: str) -> Surrogate:
    """The surrogate with the weights of its feed-forward networks stored in a precision.

    Args:
        weights: ``float32`` or ``float16``. What was rounded before stays rounded.

    Raises:
        ValueError: another precision, or a weight larger than float16 can be.
    """
    if weights not in get_args(Weights):
        raise ValueError(f"weights {weights!r}; expected one of {list(get_args(Weights))}")
    estimator = surrogate.estimator
    if estimator is not None:
        network = _stored(estimator.network, weights)
        assert isinstance(network, FeedForward)
        estimator = replace(estimator, network=network)
    return replace(surrogate, network=_stored(surrogate.network, weights), estimator=estimator)


def is_rounded(surrogate: Surrogate) -> bool:
    """Whether any of its networks has weights of float16."""
    estimator = surrogate.estimator
    networks = [surrogate.network, *([] if estimator is None else [estimator.network])]
    return any(isinstance(network, FeedForward) and network.half for network in networks)


def _stored(network: Network, weights: str) -> Network:
    if not isinstance(network, FeedForward):
        return network
    half, layers, skip = weights == "float16", network.layers, network.skip
    if half:
        layers = tuple(replace(layer, weights=rounded_to_half(layer.weights)) for layer in layers)
        skip = None if skip is None else rounded_to_half(skip)
    return FeedForward(layers, network.n_samples, network.features, skip, network.ages, half)


def rounding_loss(surrogate: Surrogate, rounded: Surrogate) -> dict[str, Any]:
    """What rounding changes, on random unseen inputs within the trained ranges.

    Args:
        surrogate: as it was.
        rounded: the same after ``with_weights``.

    Returns:
        ``inputs``, which they are; ``predictor_rounded``, ``estimator_rounded``, whether these
        networks have float16 weights; ``outputs``, for every output ``name``, ``unit``,
        ``rms_change`` in that unit, ``relative_rms_change`` to the standard deviation of the
        output; with an estimator ``relative_estimate_change``, RMS of the estimates' change
        relative to each.
    """
    rng = np.random.default_rng(SEED)
    records = [_random_record(surrogate, rng) for _ in range(RECORDS)]
    before = np.stack([surrogate.predict_newest(record) for record in records])
    change = np.stack([rounded.predict_newest(record) for record in records]) - before
    spread = before.reshape(-1, before.shape[-1]).std(axis=0)
    outputs = [
        {
            "name": signal.name,
            "unit": signal.unit,
            "rms_change": float(np.sqrt(np.mean(change[..., i] ** 2))),
            "relative_rms_change": float(
                np.sqrt(np.mean(change[..., i] ** 2)) / max(spread[i], 1e-300)
            ),
        }
        for i, signal in enumerate(surrogate.outputs)
    ]
    figures: dict[str, Any] = {
        "inputs": f"random within the trained ranges, seed {SEED}",
        "predictor_rounded": getattr(rounded.network, "half", False),
        "estimator_rounded": rounded.estimator is not None and rounded.estimator.network.half,
        "outputs": outputs,
    }
    if rounded.estimator is not None:
        pairs = [(surrogate.estimate_error(r), rounded.estimate_error(r)) for r in records]
        relative = np.stack([after / estimate - 1 for estimate, after in pairs])
        figures["relative_estimate_change"] = float(np.sqrt(np.mean(relative**2)))
    return figures


def _random_record(surrogate: Surrogate, rng: np.random.Generator) -> FloatArray:
    """Inputs that move linearly between random values, shape (samples, n_inputs)."""
    n_in = surrogate.window.n_in
    low = np.array([signal.low for signal in surrogate.inputs])
    high = np.array([signal.high for signal in surrogate.inputs])
    knots = np.linspace(0, WINDOWS * n_in, WINDOWS * KNOTS + 1)
    values = rng.uniform(low, high, (len(knots), len(low)))
    samples = np.arange(WINDOWS * n_in)
    return np.stack([np.interp(samples, knots, column) for column in values.T], axis=1)
