"""These are the bytes of a feed-forward network; the contract is in
``slide_fmu/network/bytes.py``.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/network/feed_forward.c``.
"""

from __future__ import annotations

import struct

from slide_fmu.core.byte_reader import Reader, indices_bytes
from slide_fmu.features.sets import decode_features, encode_features
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.feed_forward.network import FeedForward, Layer


def encode_feed_forward(network: FeedForward) -> bytes:
    """Write the bytes of a network that follow its kind."""
    parts = [encode_features(network.features)]
    parts.append(struct.pack("<II", network.n_samples, len(network.layers)))
    parts.append(indices_bytes(network.ages))
    names = list(ACTIVATIONS)
    for layer in network.layers:
        n_out, n_in = layer.weights.shape
        parts.append(struct.pack("<III", n_in, n_out, names.index(layer.activation)))
        parts.append(layer.weights.astype("<f4").tobytes())
        parts.append(layer.bias.astype("<f4").tobytes())
    parts.append(struct.pack("<I", network.skip is not None))
    if network.skip is not None:
        parts.append(network.skip.astype("<f4").tobytes())
    return b"".join(parts)


def decode_feed_forward(section: Reader, n_inputs: int) -> FeedForward:
    """Read the bytes that follow the kind of a network.

    Raises:
        ValueError: the bytes are not such a network with ``n_inputs`` inputs.
    """
    features = decode_features(section, n_inputs)
    n_samples, n_layers = section.u32(), section.u32()
    ages = section.indices()
    names = list(ACTIVATIONS)
    layers: list[Layer] = []
    for _ in range(n_layers):
        n_in, n_out, activation = section.u32(), section.u32(), section.u32()
        if activation >= len(names):
            raise ValueError(f"activation {activation}; expected less than {len(names)}")
        layers.append(Layer(section.f32(n_out, n_in), section.f32(n_out), names[activation]))
    has_skip = section.u32()
    if has_skip > 1:
        raise ValueError(f"skip flag {has_skip}; expected 0 or 1")
    n_values = len(layers[-1].bias) if layers else 0
    n_first = (len(ages) or n_samples) * features.n_signals
    skip = section.f32(n_values, n_first) if has_skip else None
    return FeedForward(tuple(layers), n_samples, features, skip, ages)
