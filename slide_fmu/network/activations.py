"""The activations of networks, by name."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slide_fmu.network.base import Float32Array


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
    "cubic": lambda values: values * values * values,
}
"""Activation functions by name; their order is their number in the payload.

``gelu`` is the form with the hyperbolic tangent.
"""
