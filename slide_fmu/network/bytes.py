"""The byte contract of a network and its features inside a surrogate file (``payload.py``).

The second reader is the C runtime, ``slide_fmu/fmu/runtime/bytes/network_view.c`` with the files
it includes; both reject the same bytes. All numbers are little-endian.

    network  := u32 kind (1)  features  u32 n_samples  u32 n_layers  ages  layer*
                u32 has_skip  [f32 skip[n_values][n_first]]
              | u32 kind (2)  features  u32 n_samples  u32 n_out  u32 n_states  u32 n_units
                u32 n_values  u32 units  u32 turned  role[6]
                f32 A[n_states][n_states]  f32 B[n_states][n_drive]  f32 E[n_states][n_units]
                f32 W[n_units][n_arguments]  f32 V[n_units][n_products]
                f32 C[n_rows][n_states]  f32 D[n_rows][n_static]  f32 d0[n_rows]
              | u32 kind (3)  as kind 1, weights and skip of f16
    layer    := u32 n_in  u32 n_out  u32 activation  f32 weights[n_out][n_in]  f32 bias[n_out]
    ages     := u32 count  u32 age[count]
    role     := u32 count  u32 feature[count]     drive, static, gated, schedule, readout, turn
    features := u32 set  parameters  u32 count  u32 signal[count]  f64 offset[count]
                f64 scale[count]                  feature = (signal - offset) / scale
    set 1, differences  := u32 order                             order <= 2
    set 2, director     :=                                       n_inputs = 2
    set 3, chain motion := f64 step  f64 middle[n]  f64 half_range[n]  f64 a[n]  f64 d[n]
                           f64 alpha[n]  f64 masses[n]  f64 centres[n][3]
                           f64 inertias[n][3][3]  f64 gravity[3]  f64 tool[3]
                           n = n_inputs; step > 0; all finite

The signals of the sets and their order: ``slide_fmu/features/base.py``.
Kind 1, feed-forward: the first layer takes the features of some of the newest n_samples inputs,
all of a sample together: those of the ages, 0 the newest, which fall from n_samples - 1; of all
n_samples, oldest first, where the count of the ages is 0.
Kind 3, the same with weights of IEEE 754 binary16: an odd number of them is followed by two bytes
of padding.
Kind 2, state space (state_space.py): n_states, n_values >= 1; units 3 tanh, 5 cubic, 6 gated.
n_arguments = n_states + n_drive + 1, of gated units n_schedule + 1; n_products = n_states +
n_gated of gated units, else V is absent and n_gated = n_schedule = 0; n_rows = n_values (1 +
n_readout). n_turn is 2 where turned > 0, else 0; turned needs gated units, and 2 turned <=
n_states. The features of a role are indices into those chosen.
Activations: 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu (the form with tanh), 5 cubic.
"""

from __future__ import annotations

import struct
from dataclasses import fields

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import Features
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import Director
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.base import Float32Array, Network
from slide_fmu.network.feed_forward import FeedForward, Layer
from slide_fmu.network.state_space import StateSpace
from slide_fmu.network.state_space.cell import CELL_ACTIVATIONS, GATED, Cell
from slide_fmu.network.state_space.roles import Roles

KIND_FEED_FORWARD, KIND_STATE_SPACE, KIND_FEED_FORWARD_HALF = 1, 2, 3
SET_DIFFERENCES, SET_DIRECTOR, SET_CHAIN_MOTION = 1, 2, 3
UNITS = (*ACTIVATIONS, GATED)
"""Units of cells; their order is their number."""
CHAIN = ("a", "d", "alpha", "masses", "centres", "inertias", "gravity", "tool")
"""Parts of a serial chain in the order of the bytes."""


def encode_network(network: Network) -> bytes:
    """The bytes of a network.

    Raises:
        TypeError: a family without a layout.
    """
    if isinstance(network, FeedForward):
        return _encode_feed_forward(network)
    if isinstance(network, StateSpace):
        return _encode_state_space(network)
    raise TypeError(f"no byte layout for networks of type {type(network).__name__}")


def _encode_state_space(network: StateSpace) -> bytes:
    cell, roles = network.cell, network.roles
    head = struct.pack("<I", KIND_STATE_SPACE) + _encode_features(network.features)
    units = UNITS.index(cell.activation)
    head += struct.pack(
        "<IIIII", network.n_samples, network.n_out, *cell.e.shape, network.n_values
    )
    head += struct.pack("<II", units, network.turned)
    head += b"".join(_encode_indices(getattr(roles, field.name)) for field in fields(roles))
    products = [] if cell.v is None else [cell.v]
    arrays = (cell.a, cell.b, cell.e, cell.w, *products, cell.c, cell.d, cell.d0)
    return head + b"".join(array.astype("<f4").tobytes() for array in arrays)


def _encode_indices(indices: tuple[int, ...]) -> bytes:
    return struct.pack(f"<I{len(indices)}I", len(indices), *indices)


def _encode_features(features: FeatureMap) -> bytes:
    normalisation = np.concatenate([features.offset, features.scale]).astype("<f8").tobytes()
    return _encode_set(features.features) + _encode_indices(features.chosen) + normalisation


def _encode_set(features: Features) -> bytes:
    if isinstance(features, Differences):
        return struct.pack("<II", SET_DIFFERENCES, features.order)
    if isinstance(features, Director):
        return struct.pack("<I", SET_DIRECTOR)
    if isinstance(features, ChainMotion):
        chain = [getattr(features.chain, name) for name in CHAIN]
        parts = [np.array([features.step]), features.middle, features.half_range, *chain]
        numbers = b"".join(part.astype("<f8").tobytes() for part in parts)
        return struct.pack("<I", SET_CHAIN_MOTION) + numbers
    raise TypeError(f"no byte layout for features of type {type(features).__name__}")


def _encode_feed_forward(network: FeedForward) -> bytes:
    kind = KIND_FEED_FORWARD_HALF if network.half else KIND_FEED_FORWARD
    parts = [struct.pack("<I", kind), _encode_features(network.features)]
    parts.append(struct.pack("<II", network.n_samples, len(network.layers)))
    parts.append(_encode_indices(network.ages))
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


class Reader:
    """A cursor over bytes that never reads beyond its end."""

    def __init__(self, data: bytes, position: int = 0) -> None:
        self.data = data
        self.position = position

    def take(self, count: int) -> bytes:
        if count > len(self.data) - self.position:
            raise ValueError(f"{count} bytes expected, {len(self.data) - self.position} left")
        self.position += count
        return self.data[self.position - count : self.position]

    def u32(self) -> int:
        return int.from_bytes(self.take(4), "little")

    def f64(self, count: int) -> FloatArray:
        return np.frombuffer(self.take(8 * count), dtype="<f8").astype(np.float64)

    def f32(self, *shape: int) -> Float32Array:
        flat = np.frombuffer(self.take(4 * int(np.prod(shape, dtype=object))), dtype="<f4")
        return flat.astype(np.float32).reshape(shape)

    def f16(self, *shape: int) -> Float32Array:
        count = int(np.prod(shape, dtype=object))
        flat = np.frombuffer(self.take(2 * (count + count % 2)), dtype="<f2")[:count]
        return flat.astype(np.float32).reshape(shape)

    def section(self, tag: bytes) -> Reader:
        found = self.take(4)
        if found != tag:
            raise ValueError(f"section {found!r}; expected {tag!r}")
        return Reader(self.take(self.u32()))

    def done(self) -> None:
        if self.position != len(self.data):
            raise ValueError(f"{len(self.data) - self.position} bytes too many in a section")


def decode_network(section: Reader, n_inputs: int) -> Network:
    """Read a network.

    Raises:
        ValueError: the bytes are no network on so many inputs.
    """
    kind = section.u32()
    if kind in (KIND_FEED_FORWARD, KIND_FEED_FORWARD_HALF):
        return _decode_feed_forward(section, n_inputs, kind == KIND_FEED_FORWARD_HALF)
    if kind == KIND_STATE_SPACE:
        return _decode_state_space(section, n_inputs)
    raise ValueError(
        f"network of kind {kind}; expected {KIND_FEED_FORWARD} (feed-forward), "
        f"{KIND_STATE_SPACE} (state space) or {KIND_FEED_FORWARD_HALF} (feed-forward, float16)"
    )


def _decode_features(section: Reader, n_inputs: int) -> FeatureMap:
    features = _decode_set(section, n_inputs)
    chosen = _decode_indices(section)
    offset, scale = section.f64(len(chosen)), section.f64(len(chosen))
    return FeatureMap(features, chosen, offset, scale)


def _decode_indices(section: Reader) -> tuple[int, ...]:
    count = section.u32()
    return tuple(int(i) for i in np.frombuffer(section.take(4 * count), dtype="<u4"))


def _decode_set(section: Reader, n_inputs: int) -> Features:
    number = section.u32()
    if number == SET_DIFFERENCES:
        return Differences(n_inputs, section.u32())
    if number == SET_DIRECTOR:
        if n_inputs != Director.n_channels:
            raise ValueError(f"director of {n_inputs} inputs; expected {Director.n_channels}")
        return Director()
    if number == SET_CHAIN_MOTION:
        return _decode_chain_motion(section, n_inputs)
    raise ValueError(
        f"features of set {number}; expected {SET_DIFFERENCES}, {SET_DIRECTOR} or "
        f"{SET_CHAIN_MOTION}"
    )


def _decode_chain_motion(section: Reader, n: int) -> ChainMotion:
    step = float(section.f64(1)[0])
    middle, half_range = section.f64(n), section.f64(n)
    shapes = [(n,)] * 4 + [(n, 3), (n, 3, 3), (3,), (3,)]
    parts = [section.f64(int(np.prod(shape))).reshape(shape) for shape in shapes]
    return ChainMotion(
        SerialChain(**dict(zip(CHAIN, parts, strict=True))), middle, half_range, step
    )


def _decode_state_space(section: Reader, n_inputs: int) -> StateSpace:
    features = _decode_features(section, n_inputs)
    n_samples, n_out, n, units, values = (section.u32() for _ in range(5))
    number, turned = section.u32(), section.u32()
    if number >= len(UNITS) or UNITS[number] not in CELL_ACTIVATIONS:
        expected = [UNITS.index(name) for name in CELL_ACTIVATIONS]
        raise ValueError(f"units {number} of a cell; expected one of {expected}")
    roles = Roles(*(_decode_indices(section) for _ in fields(Roles)))
    gated = UNITS[number] == GATED
    drive, static, rows = len(roles.drive), len(roles.static), values * (1 + len(roles.readout))
    cell = Cell(
        a=section.f32(n, n),
        b=section.f32(n, drive),
        e=section.f32(n, units),
        w=section.f32(units, len(roles.schedule) + 1 if gated else n + drive + 1),
        v=section.f32(units, n + len(roles.gated)) if gated else None,
        c=section.f32(rows, n),
        d=section.f32(rows, static),
        d0=section.f32(rows),
        activation=UNITS[number],
    )
    return StateSpace(cell, n_samples, n_out, features, roles, turned)


def _decode_feed_forward(section: Reader, n_inputs: int, half: bool) -> FeedForward:
    features = _decode_features(section, n_inputs)
    n_samples, n_layers = section.u32(), section.u32()
    ages = _decode_indices(section)
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
