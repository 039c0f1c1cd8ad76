"""Feed-forward networks are layers on a window of features."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.window import Window
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.base import BATCH, Float32Array, Network, batches


@dataclass(frozen=True, eq=False)
class Layer:
    """A Layer gives y = a(W x + b) (paper, section on feed-forward networks).

    Attributes:
        weights: W, shape (n_out, n_in), float32.
        bias: b, shape (n_out,), float32.
        activation: key of ``ACTIVATIONS``.

    Raises:
        ValueError: shapes differ, values are not finite, or the activation is unknown.
    """

    weights: Float32Array
    bias: Float32Array
    activation: str

    def __post_init__(self) -> None:
        if self.weights.ndim != 2 or self.bias.shape != self.weights.shape[:1]:
            raise ValueError(
                f"layer: weights of shape {self.weights.shape}, bias of shape "
                f"{self.bias.shape}; expected (n_out, n_in) and (n_out,)"
            )
        if self.activation not in ACTIVATIONS:
            raise ValueError(
                f"layer: activation {self.activation!r}; expected one of {list(ACTIVATIONS)}"
            )
        if not (np.all(np.isfinite(self.weights)) and np.all(np.isfinite(self.bias))):
            raise ValueError("layer: a weight or bias is not finite; was the training stable?")


@final
class FeedForward(Network):
    """Feed-forward network on the flattened features (time first, then feature).

    Args:
        layers: at least one; each layer's output fits the next.
        n_samples: length of the input sequence.
        features: the features formed at each sample.
        skip: optional linear path from the flattened features to the output, shape (n_values,
            n_seen * n_features).
        ages: ages of the n_seen samples that it uses; 0 is the newest, and they fall from
            n_samples - 1. If empty, all n_samples are used.

    Raises:
        ValueError: sizes do not fit, or a weight is not finite.
    """

    def __init__(
        self,
        layers: tuple[Layer, ...],
        n_samples: int,
        features: FeatureMap,
        skip: Float32Array | None = None,
        ages: tuple[int, ...] = (),
    ) -> None:
        if not layers:
            raise ValueError("feed-forward network without layers; expected at least one")
        if n_samples < 1:
            raise ValueError(f"network on {n_samples} samples; expected at least one")
        _check_ages(ages, n_samples)
        width = n_first = (len(ages) or n_samples) * features.n_signals
        for index, layer in enumerate(layers):
            if layer.weights.shape[1] != width:
                raise ValueError(
                    f"layer {index} takes {layer.weights.shape[1]} values; expected {width}"
                )
            width = layer.weights.shape[0]
        if skip is not None and skip.shape != (width, n_first):
            raise ValueError(f"linear skip of shape {skip.shape}; expected {(width, n_first)}")
        if skip is not None and not np.all(np.isfinite(skip)):
            raise ValueError("linear skip: a weight is not finite; was the training stable?")
        self.layers = layers
        self.skip = skip
        self.features = features
        self.ages = ages
        self.n_samples = self.memory_length = n_samples
        self.n_channels = features.n_channels
        self.n_values = width

    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        return self.evaluate_features(self.features.along(sequences))

    def evaluate_features(self, features: Float32Array) -> Float32Array:
        """Evaluate on features of windows: (B, n_samples, n_features) to (B, n_values)."""
        if self.ages:
            features = features[:, [self.n_samples - 1 - age for age in self.ages]]
        flat = np.asarray(features, dtype=np.float32).reshape(len(features), -1)
        hidden = flat
        for layer in self.layers:
            arguments = hidden @ layer.weights.T + layer.bias
            hidden = ACTIVATIONS[layer.activation].value(arguments, np)
        if self.skip is not None:
            hidden = hidden + flat @ self.skip.T
        return np.asarray(hidden, dtype=np.float32)

    def block(self, sequences: NDArray[Any], n_out: int) -> Float32Array:
        """Evaluate once for a block of samples, or once at each of n_out positions."""
        features = self.features.along(sequences)
        if features.shape[1] == self.n_samples:
            return self.evaluate_features(features).reshape(len(features), n_out, -1)
        views = np.lib.stride_tricks.sliding_window_view(features, self.n_samples, axis=1)
        windows = np.moveaxis(views[:, :n_out], -1, 2)
        flat = windows.reshape(-1, self.n_samples, self.features.n_signals)
        return self.evaluate_features(flat).reshape(len(sequences), n_out, -1)

    def stream(self, sequences: NDArray[Any]) -> Float32Array:
        return self.stream_features(self.features.along(sequences))

    def stream_features(self, features: Float32Array) -> Float32Array:
        """Evaluate features of long sequences at every sample: (B, N, q) to (B, N, n_values).

        Before a sequence its features count as constant, equal to the first.
        """
        padded = np.pad(features, ((0, 0), (self.n_samples - 1, 0), (0, 0)), mode="edge")
        return np.stack([self._slide_over(row) for row in padded])

    def _slide_over(self, padded: Float32Array) -> Float32Array:
        """Return values at the end of every window: (N + n_samples - 1, q) to (N, p)."""
        count, columns = len(padded) - self.n_samples + 1, np.arange(self.n_samples)
        starts = np.arange(count)[:, None]
        cut = (padded[starts[some] + columns] for some in batches(count, BATCH))
        return np.concatenate([self.evaluate_features(windows) for windows in cut])

    def require_window(self, window: Window, n_outputs: int) -> None:
        """Reject sizes for which one evaluation gives neither one sample nor a block."""
        one = (window.memory_length, n_outputs)
        block = (window.n_in, window.n_out * n_outputs)
        if (self.n_samples, self.n_values) not in (one, block):
            raise ValueError(
                f"surrogate network maps {self.n_samples} samples to {self.n_values} values; "
                f"expected {one[0]} to {one[1]} or {block[0]} to {block[1]}"
            )

    def block_length(self, n_outputs: int) -> int:
        """Return the number of samples of one evaluation."""
        return self.n_values // n_outputs

    @property
    def measures_truncation(self) -> bool:
        """False: the memory is the window."""
        return False

    @property
    def is_affine(self) -> bool:
        affine = all(layer.activation == "identity" for layer in self.layers)
        return affine and self.features.features.linear

    def count_parameters(self) -> int:
        count = sum(layer.weights.size + layer.bias.size for layer in self.layers)
        return count + (0 if self.skip is None else self.skip.size)


def _check_ages(ages: tuple[int, ...], n_samples: int) -> None:
    """Reject ages of samples that do not fall from n_samples - 1."""
    falling = all(older > newer for older, newer in itertools.pairwise(ages))
    if ages and not (falling and ages[0] == n_samples - 1 and ages[-1] >= 0):
        raise ValueError(
            f"network on samples of the ages {list(ages)}; expected them to fall from "
            f"{n_samples - 1}, one less than its {n_samples} samples, to 0 at least"
        )
