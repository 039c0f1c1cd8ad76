"""The byte contract of a surrogate file: one writer, one reader.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/bytes/payload.c``; both reject the same
files. All numbers are little-endian; ``u32`` unsigned integer, ``f32``/``f64`` IEEE 754.

    file     := "SLIDEFMU"  u32 version (4)  section*  u32 crc32 (of all bytes before it)
    section  := 4-byte tag  u32 length in bytes (a multiple of 4)  content
    sections, in this order, each once; ESTI may be absent:
    WIND     := f64 step/s  u32 n_in  u32 n_out  u32 n_inputs  u32 n_outputs  u32 hold
    SCIN     := n_inputs  x (f64 offset  f64 scale  f64 start)   input = (u - offset) / scale
    SCOU     := n_outputs x (f64 offset  f64 scale)              y = offset + scale * output
    PRED     := network                                          the surrogate
    ESTI     := f64 low  f64 high  u32 positions  network        the error estimator
                f32 least[count]  f32 largest[count]             of its features
    META     := UTF-8 JSON, padded with spaces                   signals; the C runtime skips it
    network  := see slide_fmu/network/bytes.py

Inputs and outputs in SCIN and SCOU are those of the network. Hold (signals.Hold): 0 held, 1 ramp.
Start: u before anybody sets it, finite and within offset -+ scale (``check_starts``).

A feed-forward surrogate gives n_outputs values per evaluation (n_samples = n_in - n_out + 1; a
block is n_out evaluations, one per position), or n_out * n_outputs values (n_samples = n_in; a
block is one evaluation, newest sample last). A state-space surrogate has n_samples = n_in, n_out
as the window, and n_values = n_outputs.
The estimator is a feed-forward network. It gives n_outputs values eps per evaluation, with e =
10^(m + r eps), m = (high + low)/2, r = (high - low)/2; or n_outputs expected errors mu, relative
to the spread around them, followed by n_outputs values eps, with e = 10^(m + r eps) sqrt(1 +
mu^2). An e that is larger than 10^high, or not a number, counts as 10^high; so does every e at a
sample with a feature outside least .. largest. Over its last ``positions`` evaluations the root of
the mean square of e, times the scale of SCOU, is the estimate.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass
from typing import get_args

import numpy as np

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.core.window import MAX_WINDOW, Window
from slide_fmu.network.base import Network
from slide_fmu.network.bytes import decode_network, encode_network
from slide_fmu.network.feed_forward import FeedForward
from slide_fmu.surrogate.error_estimator import ErrorEstimator

MAGIC = b"SLIDEFMU"
VERSION = 4
HOLDS: tuple[Hold, ...] = get_args(Hold)
"""How inputs act between samples; their order is their number in the payload."""

START_TOLERANCE = 1e-12
"""How far a start may lie outside offset -+ scale, relative to |offset| + scale: rounding."""


class PayloadError(ValueError):
    """A surrogate file is damaged, of another version, or not a surrogate file."""


@dataclass(frozen=True, eq=False)
class Payload:
    """All that a surrogate file holds; starts: inputs before anybody sets them."""

    window: Window
    hold: Hold
    input_scaling: Affine
    starts: FloatArray
    output_scaling: Affine
    network: Network
    estimator: ErrorEstimator | None
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
    scaling = payload.input_scaling
    body += _section(b"SCIN", _columns(scaling.offset, scaling.scale, payload.starts))
    scaling = payload.output_scaling
    body += _section(b"SCOU", _columns(scaling.offset, scaling.scale))
    body += _section(b"PRED", encode_network(payload.network))
    if payload.estimator is not None:
        log_error = payload.estimator.log_error
        head = struct.pack("<ddI", log_error.low, log_error.high, payload.estimator.positions)
        ranges = payload.estimator.ranges.astype("<f4").tobytes()
        body += _section(b"ESTI", head + encode_network(payload.estimator.network) + ranges)
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
    reader = Reader(data[:-4], 12)
    try:
        payload = _decode_sections(reader)
    except ValueError as error:
        raise PayloadError(f"surrogate file, near byte {reader.position}: {error}") from error
    if reader.position != len(reader.data):
        raise PayloadError(f"surrogate file: unexpected bytes after byte {reader.position}")
    return payload


def check_starts(scaling: Affine, starts: FloatArray) -> None:
    """Refuse start values of inputs that do not lie in offset -+ scale, the scaled range.

    Raises:
        ValueError: with the input.
    """
    rows = zip(scaling.offset.tolist(), scaling.scale.tolist(), starts.tolist(), strict=True)
    for index, (offset, scale, start) in enumerate(rows):
        allowed = scale + START_TOLERANCE * (abs(offset) + scale)
        if not (math.isfinite(start) and abs(start - offset) <= allowed):
            raise ValueError(
                f"input {index} starts at {start:g}, but its scaling covers {offset - scale:g} to "
                f"{offset + scale:g}; scale the input by its range"
            )


def _section(tag: bytes, content: bytes) -> bytes:
    return tag + struct.pack("<I", len(content)) + content


def _columns(*columns: FloatArray) -> bytes:
    """Numbers by channel, those of a channel together."""
    return np.stack(columns, axis=1).astype("<f8").tobytes()


def _decode_sections(reader: Reader) -> Payload:
    section = reader.section(b"WIND")
    step = float(section.f64(1)[0])
    n_in, n_out, n_inputs, n_outputs, hold = (section.u32() for _ in range(5))
    section.done()
    window = Window(step, n_in, n_out)
    if hold >= len(HOLDS):
        raise ValueError(f"hold {hold}; expected less than {len(HOLDS)}")
    if n_in > MAX_WINDOW or n_inputs < 1 or n_outputs < 1:
        raise ValueError(f"n_in {n_in}, n_inputs {n_inputs}, n_outputs {n_outputs} out of range")
    offset, scale, starts = _decode_columns(reader.section(b"SCIN"), n_inputs, 3)
    input_scaling = Affine(offset, scale)
    check_starts(input_scaling, starts)
    output_scaling = Affine(*_decode_columns(reader.section(b"SCOU"), n_outputs, 2))
    section = reader.section(b"PRED")
    network = decode_network(section, n_inputs)
    section.done()
    network.require_window(window, n_outputs)
    estimator = None
    if reader.data[reader.position : reader.position + 4] == b"ESTI":
        estimator = _decode_estimator(reader.section(b"ESTI"), n_inputs)
        estimator.require_outputs(n_outputs)
    section = reader.section(b"META")
    metadata = section.take(len(section.data)).decode("utf-8").rstrip(" ")
    scalings = input_scaling, starts, output_scaling
    return Payload(window, HOLDS[hold], *scalings, network, estimator, metadata)


def _decode_columns(section: Reader, channels: int, count: int) -> tuple[FloatArray, ...]:
    rows = section.f64(count * channels).reshape(channels, count)
    section.done()
    return tuple(rows.T.copy())


def _decode_estimator(section: Reader, n_inputs: int) -> ErrorEstimator:
    low, high = (float(value) for value in section.f64(2))
    positions = section.u32()
    network = decode_network(section, n_inputs)
    if not isinstance(network, FeedForward):
        raise ValueError("estimator that is no feed-forward network; expected one")
    ranges = section.f32(2, network.features.n_signals)
    section.done()
    return ErrorEstimator(network, LogError(low, high), positions, ranges)
