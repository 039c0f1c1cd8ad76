"""The bytes of a feed-forward network; the contract is in ``slide_fmu/network/bytes.py``.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/bytes/layers_view.c``.
"""

from __future__ import annotations

import struct

from slide_fmu.core.byte_reader import Reader, indices_bytes
from slide_fmu.features.sets import decode_features, encode_features
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.base import Float32Array
from slide_fmu.network.feed_forward.network import FeedForward, Layer

KIND, KIND_HALF = 1, 3
"""Numbers in a surrogate file: with weights of float32, and of float16."""


def encode_feed_forward(network: FeedForward) -> bytes:
    """The bytes of a network, its kind first."""
    kind = KIND_HALF if network.half else KIND
    parts = [struct.pack("<I", kind), encode_features(network.features)]
    parts.append(struct.pack("<II", network.n_samples, len(network.layers)))
    parts.append(indices_bytes(network.ages))
    names = list(ACTIVATIONS)
    for layer in network.layers:
        n_out, n_in = layer.weights.shape
        parts.append(struct.pack("<III", n_in, n_out, names.index(layer.activation)))
        parts.append(_encode_weights(layer.weights, network.half))
        parts.append(layer.bias.astype("<f4").tobytes())
    parts.append(struct.pack("<I", network.skip is not None))
    if network.skip is not None:
        parts.append(_encode_weights(network.skip, network.half))
    return b"".join(parts)


def _encode_weights(weights: Float32Array, half: bool) -> bytes:
    if not half:
        return weights.astype("<f4").tobytes()
    return weights.astype("<f2").tobytes() + bytes(2 * (weights.size % 2))


def decode_feed_forward(section: Reader, n_inputs: int) -> FeedForward:
    """Read what follows the kind of a network with weights of float32.

    Raises:
        ValueError: the bytes are no such network on so many inputs.
    """
    return _decode(section, n_inputs, half=False)


def decode_feed_forward_half(section: Reader, n_inputs: int) -> FeedForward:
    """As ``decode_feed_forward``, with weights of float16."""
    return _decode(section, n_inputs, half=True)


def _decode(section: Reader, n_inputs: int, half: bool) -> FeedForward:
    features = decode_features(section, n_inputs)
    n_samples, n_layers = section.u32(), section.u32()
    ages = section.indices()
    names = list(ACTIVATIONS)
    weights = section.f16 if half else section.f32
    layers: list[Layer] = []
    for _ in range(n_layers):
        n_in, n_out, activation = section.u32(), section.u32(), section.u32()
        if activation >= len(names):
            raise ValueError(f"activation {activation}; expected less than {len(names)}")
        layers.append(Layer(weights(n_out, n_in), section.f32(n_out), names[activation]))
    has_skip = section.u32()
    if has_skip > 1:
        raise ValueError(f"skip flag {has_skip}; expected 0 or 1")
    n_values = len(layers[-1].bias) if layers else 0
    n_first = (len(ages) or n_samples) * features.n_signals
    skip = weights(n_values, n_first) if has_skip else None
    return FeedForward(tuple(layers), n_samples, features, skip, ages, half)
