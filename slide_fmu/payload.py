"""The byte contract of a surrogate file: one writer, one reader.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/payload.c``; both reject the same
files. All numbers are little-endian; ``u32`` unsigned integer, ``f32``/``f64`` IEEE 754.

    file     := "SLIDEFMU"  u32 version (2)  section*  u32 crc32 (of all bytes before it)
    section  := 4-byte tag  u32 length in bytes (a multiple of 4)  content
    sections, in this order, each once; ESTI may be absent:
    WIND     := f64 step/s  u32 n_in  u32 n_out  u32 n_inputs  u32 n_outputs  u32 hold
    SCIN     := n_inputs  x (f64 offset  f64 scale)       network input = (u - offset) / scale
    SCOU     := n_outputs x (f64 offset  f64 scale)       y = offset + scale * network output
    PRED     := network                                   the surrogate
    ESTI     := f64 low  f64 high  u32 positions  network the error estimator
    META     := UTF-8 JSON, padded with spaces            signals; the C runtime skips it
    network  := u32 kind (1)  u32 n_samples  u32 n_layers  layer*
                u32 has_skip  [f32 skip[n_values][n_first]]
              | u32 kind (2)  u32 n_samples  u32 n_out  u32 n_states  u32 n_units  u32 n_values
                u32 activation  u32 differences  f32 feature_scale[q]  f32 A[n_states][n_states]
                f32 B[n_states][q]  f32 E[n_states][n_units]  f32 W[n_units][n_states + q + 1]
                f32 C[n_values][n_states]  f32 D[n_values][q]  f32 d0[n_values]
    layer    := u32 n_in  u32 n_out  u32 activation  f32 weights[n_out][n_in]  f32 bias[n_out]

Hold (signals.Hold): 0 held, 1 ramp.

Kind 1, feed-forward: the first layer takes n_samples * n_inputs values: the newest n_samples
inputs, oldest first, all channels of a sample together. n_samples <= n_in. The surrogate gives
n_outputs values per evaluation (n_samples = n_in - n_out + 1; a block is n_out evaluations, one
per position), or n_out * n_outputs values (n_samples = n_in; a block is one evaluation, newest
sample last).
Kind 2, state space (state_space.py): q = n_inputs * (differences + 1), differences <= 2, n_states
and n_values >= 1, activation tanh or cubic. The surrogate has n_samples = n_in, n_out as the
window, and n_values = n_outputs.
The estimator gives n_outputs values eps per evaluation, with e = 10^(m + r eps), m = (high +
low)/2, r = (high - low)/2; or n_outputs expected errors mu followed by n_outputs values eps, with
e^2 = mu^2 + 10^(2 (m + r eps)). Over its last ``positions`` evaluations the root of the mean
square of e, times the scale of SCOU, is the estimate; n_samples + positions - 1 <= n_in.
Activations: 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu (the form with tanh), 5 cubic.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import get_args

import numpy as np

from slide_fmu.network import ACTIVATIONS, FeedForward, Float32Array, Layer, Network
from slide_fmu.scaling import Affine, LogError
from slide_fmu.signals import FloatArray, Hold
from slide_fmu.state_space import CELL_ACTIVATIONS, MAX_DIFFERENCES, Cell, StateSpace
from slide_fmu.window import Window

MAGIC = b"SLIDEFMU"
VERSION = 2
KIND_FEED_FORWARD, KIND_STATE_SPACE = 1, 2
HOLDS: tuple[Hold, ...] = get_args(Hold)
"""How inputs act between samples; their order is their number in the payload."""

MAX_WINDOW = 1 << 20
"""Largest n_in: an upper bound against damaged files, far above any use."""


class PayloadError(ValueError):
    """A surrogate file is damaged, of another version, or not a surrogate file."""


@dataclass(frozen=True, eq=False)
class EstimatorPayload:
    """The error estimator as stored: log map, number of averaged positions, network."""

    log_error: LogError
    positions: int
    network: Network


@dataclass(frozen=True, eq=False)
class Payload:
    """All that a surrogate file holds."""

    window: Window
    hold: Hold
    input_scaling: Affine
    output_scaling: Affine
    network: Network
    estimator: EstimatorPayload | None
    metadata: str


def encode(payload: Payload) -> bytes:
    """The bytes of a surrogate file; the same payload gives the same bytes."""
    window = payload.window
    n_inputs, n_outputs = len(payload.input_scaling.scale), len(payload.output_scaling.scale)
    body = MAGIC + struct.pack("<I", VERSION)
    body += _section(
        b"WIND",
        struct.pack("<dIIII", window.step, window.n_in, window.n_out, n_inputs, n_outputs)
        + struct.pack("<I", HOLDS.index(payload.hold)),
    )
    body += _section(b"SCIN", _encode_affine(payload.input_scaling))
    body += _section(b"SCOU", _encode_affine(payload.output_scaling))
    body += _section(b"PRED", _encode_network(payload.network))
    if payload.estimator is not None:
        log_error = payload.estimator.log_error
        head = struct.pack("<ddI", log_error.low, log_error.high, payload.estimator.positions)
        body += _section(b"ESTI", head + _encode_network(payload.estimator.network))
    metadata = payload.metadata.encode("utf-8")
    body += _section(b"META", metadata + b" " * (-len(metadata) % 4))
    return body + struct.pack("<I", zlib.crc32(body))


def decode(data: bytes) -> Payload:
    """Read a surrogate file.

    Raises:
        PayloadError: with the offset and what was expected there.
    """
    if len(data) < 16 or data[:8] != MAGIC:
        raise PayloadError("not a surrogate file: expected it to begin with 'SLIDEFMU'")
    (version,) = struct.unpack_from("<I", data, 8)
    if version != VERSION:
        raise PayloadError(f"surrogate file of version {version}; expected version {VERSION}")
    (checksum,) = struct.unpack_from("<I", data, len(data) - 4)
    if zlib.crc32(data[:-4]) != checksum:
        raise PayloadError("surrogate file is damaged: its checksum does not match its content")
    reader = _Reader(data[:-4], 12)
    try:
        payload = _decode_sections(reader)
    except ValueError as error:
        raise PayloadError(f"surrogate file, near byte {reader.position}: {error}") from error
    if reader.position != len(reader.data):
        raise PayloadError(f"surrogate file: unexpected bytes after byte {reader.position}")
    return payload


def check_block_sizes(window: Window, network: Network, n_outputs: int) -> None:
    """Refuse a surrogate network that does not fit its window.

    Raises:
        ValueError: neither one sample per evaluation nor one block per evaluation.
    """
    if isinstance(network, StateSpace):
        found = (network.n_samples, network.n_out, network.n_values)
        expected = (window.n_in, window.n_out, n_outputs)
        if found != expected:
            raise ValueError(
                f"state-space network with n_samples, n_out, n_values = {found}; "
                f"expected {expected}, those of the window and the outputs"
            )
        return
    one = (window.receptive_field, n_outputs)
    block = (window.n_in, window.n_out * n_outputs)
    if (network.n_samples, network.n_values) not in (one, block):
        raise ValueError(
            f"surrogate network maps {network.n_samples} samples to {network.n_values} values; "
            f"expected {one[0]} to {one[1]} or {block[0]} to {block[1]}"
        )


def check_estimator_sizes(
    window: Window, positions: int, network: Network, n_outputs: int
) -> None:
    """Refuse an error estimator that does not fit its window.

    Raises:
        ValueError: wrong number of values, or it looks further back than the window.
    """
    if network.n_values not in (n_outputs, 2 * n_outputs):
        raise ValueError(
            f"estimator gives {network.n_values} values; expected {n_outputs} or {2 * n_outputs}"
        )
    if positions < 1 or network.n_samples + positions - 1 > window.n_in:
        raise ValueError(
            f"estimator sees {network.n_samples} samples at {positions} positions; "
            f"expected at least one position and {window.n_in} samples in all at most"
        )


def _section(tag: bytes, content: bytes) -> bytes:
    return tag + struct.pack("<I", len(content)) + content


def _encode_affine(scaling: Affine) -> bytes:
    return np.stack([scaling.offset, scaling.scale], axis=1).astype("<f8").tobytes()


def _encode_network(network: Network) -> bytes:
    if isinstance(network, FeedForward):
        return _encode_feed_forward(network)
    if isinstance(network, StateSpace):
        return _encode_state_space(network)
    raise TypeError(f"no byte layout for networks of type {type(network).__name__}")


def _encode_state_space(network: StateSpace) -> bytes:
    cell = network.cell
    head = struct.pack("<III", KIND_STATE_SPACE, network.n_samples, network.n_out)
    activation = list(ACTIVATIONS).index(cell.activation)
    sizes = (len(cell.a), len(cell.w), len(cell.c), activation, network.differences)
    arrays = (network.feature_scale, cell.a, cell.b, cell.e, cell.w, cell.c, cell.d, cell.d0)
    content = b"".join(array.astype("<f4").tobytes() for array in arrays)
    return head + struct.pack("<IIIII", *sizes) + content


def _encode_feed_forward(network: FeedForward) -> bytes:
    parts = [struct.pack("<III", KIND_FEED_FORWARD, network.n_samples, len(network.layers))]
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


class _Reader:
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

    def section(self, tag: bytes) -> _Reader:
        found = self.take(4)
        if found != tag:
            raise ValueError(f"section {found!r}; expected {tag!r}")
        return _Reader(self.take(self.u32()))

    def done(self) -> None:
        if self.position != len(self.data):
            raise ValueError(f"{len(self.data) - self.position} bytes too many in a section")


def _decode_sections(reader: _Reader) -> Payload:
    section = reader.section(b"WIND")
    step = float(section.f64(1)[0])
    n_in, n_out, n_inputs, n_outputs, hold = (section.u32() for _ in range(5))
    section.done()
    window = Window(step, n_in, n_out)
    if hold >= len(HOLDS):
        raise ValueError(f"hold {hold}; expected less than {len(HOLDS)}")
    if n_in > MAX_WINDOW or n_inputs < 1 or n_outputs < 1:
        raise ValueError(f"n_in {n_in}, n_inputs {n_inputs}, n_outputs {n_outputs} out of range")
    input_scaling = _decode_affine(reader.section(b"SCIN"), n_inputs)
    output_scaling = _decode_affine(reader.section(b"SCOU"), n_outputs)
    section = reader.section(b"PRED")
    network = _decode_network(section, n_inputs)
    section.done()
    check_block_sizes(window, network, n_outputs)
    estimator = None
    if reader.data[reader.position : reader.position + 4] == b"ESTI":
        estimator = _decode_estimator(reader.section(b"ESTI"), n_inputs)
        check_estimator_sizes(window, estimator.positions, estimator.network, n_outputs)
    section = reader.section(b"META")
    metadata = section.take(len(section.data)).decode("utf-8").rstrip(" ")
    return Payload(
        window, HOLDS[hold], input_scaling, output_scaling, network, estimator, metadata
    )


def _decode_affine(section: _Reader, channels: int) -> Affine:
    pairs = section.f64(2 * channels).reshape(channels, 2)
    section.done()
    return Affine(pairs[:, 0].copy(), pairs[:, 1].copy())


def _decode_network(section: _Reader, n_inputs: int) -> Network:
    kind = section.u32()
    if kind == KIND_FEED_FORWARD:
        return _decode_feed_forward(section, n_inputs)
    if kind == KIND_STATE_SPACE:
        return _decode_state_space(section, n_inputs)
    raise ValueError(
        f"network of kind {kind}; expected {KIND_FEED_FORWARD} (feed-forward) or "
        f"{KIND_STATE_SPACE} (state space)"
    )


def _decode_state_space(section: _Reader, n_inputs: int) -> StateSpace:
    n_samples, n_out, n, units, values = (section.u32() for _ in range(5))
    activation, differences = section.u32(), section.u32()
    names = list(ACTIVATIONS)
    if activation >= len(names) or names[activation] not in CELL_ACTIVATIONS:
        expected = [names.index(name) for name in CELL_ACTIVATIONS]
        raise ValueError(f"activation {activation} of a cell; expected one of {expected}")
    if differences > MAX_DIFFERENCES:
        raise ValueError(f"differences {differences}; expected at most {MAX_DIFFERENCES}")
    q = n_inputs * (differences + 1)
    scale = section.f32(q)
    cell = Cell(
        a=section.f32(n, n),
        b=section.f32(n, q),
        e=section.f32(n, units),
        w=section.f32(units, n + q + 1),
        c=section.f32(values, n),
        d=section.f32(values, q),
        d0=section.f32(values),
        activation=names[activation],
    )
    return StateSpace(cell, n_samples, n_out, n_inputs, differences, scale)


def _decode_feed_forward(section: _Reader, n_inputs: int) -> FeedForward:
    n_samples, n_layers = section.u32(), section.u32()
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
    skip = section.f32(n_values, n_samples * n_inputs) if has_skip else None
    return FeedForward(tuple(layers), n_samples, n_inputs, skip)


def _decode_estimator(section: _Reader, n_inputs: int) -> EstimatorPayload:
    low, high = (float(value) for value in section.f64(2))
    positions = section.u32()
    network = _decode_network(section, n_inputs)
    section.done()
    return EstimatorPayload(LogError(low, high), positions, network)
