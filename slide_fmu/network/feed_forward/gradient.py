"""Derivatives of feed-forward networks by their features are computed in reverse mode, in
float64."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import PullBack
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.feed_forward.network import FeedForward, Layer


def pull_back_layers(network: FeedForward, features: FloatArray, n_out: int) -> PullBack:
    """Prepare the reverse mode of ``FeedForward.block`` after its features; see ``Family``.

    One evaluation gives a block of samples, or there is one evaluation for each of n_out
    positions.
    """
    n_samples, (batch, _, n_features) = network.n_samples, features.shape
    positions = features.shape[1] - n_samples + 1
    seen = [n_samples - 1 - age for age in network.ages] or list(range(n_samples))
    windows = [features[:, first : first + n_samples][:, seen] for first in range(positions)]
    flat = np.stack(windows, axis=1).reshape(batch * positions, -1)
    slopes = _layer_slopes(network.layers, flat)

    def pull_back(weights: FloatArray) -> FloatArray:
        of_values = weights.reshape(batch * positions, -1)
        of_layer = of_values
        for layer, slope in zip(reversed(network.layers), reversed(slopes), strict=True):
            of_layer = (of_layer * slope) @ layer.weights
        if network.skip is not None:
            of_layer = of_layer + of_values @ network.skip
        parts = of_layer.reshape(batch, positions, len(seen), n_features)
        gradient = np.zeros(features.shape)
        for first in range(positions):
            gradient[:, [first + age for age in seen]] += parts[:, first]
        return gradient

    return pull_back


def _layer_slopes(layers: tuple[Layer, ...], flat: FloatArray) -> list[FloatArray]:
    """Return the slopes of the activations by layer, shape (rows, n_out of the layer) each."""
    hidden, slopes = flat, []
    for layer in layers:
        activation = ACTIVATIONS[layer.activation]
        arguments = hidden @ layer.weights.T + layer.bias
        hidden = activation.value(arguments, np)
        slopes.append(np.asarray(activation.slope(arguments, hidden, np)))
    return slopes
