"""Networks as data: what is left of a trained network, evaluated with numpy.

A second family joins by another final class of ``Network``, its reader and writer in
``payload.py``, and its kernel in the C runtime.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float32Array = NDArray[np.float32]


class Network(abc.ABC):
    """A pure function from a sequence of scaled inputs to scaled values. Interface.

    Attributes:
        n_samples: length of the input sequence.
        n_channels: number of input channels.
        n_values: number of values it gives.
    """

    n_samples: int
    n_channels: int
    n_values: int

    @abc.abstractmethod
    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        """Evaluate a batch.

        Args:
            sequences: scaled inputs, shape (B, n_samples, n_channels), oldest sample first.

        Returns:
            Scaled values, shape (B, n_values), float32.
        """

    @abc.abstractmethod
    def count_parameters(self) -> int:
        """Number of weights and biases."""


def _elu(values: Float32Array) -> Float32Array:
    return np.where(values > 0, values, np.expm1(np.minimum(values, 0)))


def _gelu(values: Float32Array) -> Float32Array:
    inner = np.float32(math.sqrt(2 / math.pi)) * (values + np.float32(0.044715) * values**3)
    return np.asarray(np.float32(0.5) * values * (1 + np.tanh(inner)))


ACTIVATIONS: dict[str, Callable[[Float32Array], Float32Array]] = {
    "identity": lambda values: values,
    "relu": lambda values: np.maximum(values, 0),
    "elu": _elu,
    "tanh": np.tanh,
    "gelu": _gelu,
}
"""Activation functions by name; their order is their number in the payload.

``gelu`` is the form with the hyperbolic tangent.
"""


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer y = a(W x + b) (paper, section on feed-forward networks).

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


class FeedForward(Network):
    """Feed-forward network on the flattened sequence (time first, then channel). Final.

    Args:
        layers: at least one; the output of each fits the next.
        n_samples: length of the input sequence.
        n_channels: number of input channels.
        skip: optional linear path from the flattened input to the output,
            shape (n_values, n_samples * n_channels).

    Raises:
        ValueError: sizes do not fit.
    """

    def __init__(
        self,
        layers: tuple[Layer, ...],
        n_samples: int,
        n_channels: int,
        skip: Float32Array | None = None,
    ) -> None:
        if not layers:
            raise ValueError("feed-forward network without layers; expected at least one")
        if n_samples < 1:
            raise ValueError(f"network on {n_samples} samples; expected at least one")
        width = n_samples * n_channels
        for index, layer in enumerate(layers):
            if layer.weights.shape[1] != width:
                raise ValueError(
                    f"layer {index} takes {layer.weights.shape[1]} values; expected {width}"
                )
            width = layer.weights.shape[0]
        if skip is not None and skip.shape != (width, n_samples * n_channels):
            raise ValueError(
                f"linear skip of shape {skip.shape}; expected {(width, n_samples * n_channels)}"
            )
        if skip is not None and not np.all(np.isfinite(skip)):
            raise ValueError("linear skip: a weight is not finite; was the training stable?")
        self.layers = layers
        self.skip = skip
        self.n_samples = n_samples
        self.n_channels = n_channels
        self.n_values = width

    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        flat = np.asarray(sequences, dtype=np.float32).reshape(len(sequences), -1)
        hidden = flat
        for layer in self.layers:
            hidden = ACTIVATIONS[layer.activation](hidden @ layer.weights.T + layer.bias)
        if self.skip is not None:
            hidden = hidden + flat @ self.skip.T
        return np.asarray(hidden, dtype=np.float32)

    def count_parameters(self) -> int:
        count = sum(layer.weights.size + layer.bias.size for layer in self.layers)
        return count + (0 if self.skip is None else self.skip.size)
