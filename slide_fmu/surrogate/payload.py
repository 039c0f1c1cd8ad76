"""The byte contract of a surrogate file has one writer and one reader in Python.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/bytes/payload.c``; both reject the same
files. All numbers are little-endian; ``u32`` unsigned integer, ``f32``/``f64`` IEEE 754.

    file     := "SLIDEFMU"  u32 version      section*  u32 crc32 (of all bytes before it)
    section  := 4-byte tag  u32 length in bytes (a multiple of 4)  content
    sections, in this order, each once; PARA, ESTI, BOUN, SPAN, PLAI, MOVE and RANG may be absent:
    WIND     := f64 step/s  u32 n_in  u32 n_out  u32 n_inputs  u32 n_outputs
    SCIN     := n_inputs  x (f64 offset  f64 scale  f64 start    input = (u - offset) / scale
                             u32 hold  u32 angle)
    SCOU     := n_outputs x (f64 offset  f64 scale)              y = offset + scale * output
    PRED     := network                                          the surrogate
    PARA     := u32 n_parameters                                 that its weights follow
                n_parameters x (f64 low  f64 high  f64 start  u32 transform  u32 0)
                u32 n_terms  u32 degree[n_terms][n_parameters]
                n_terms x (f32 weights, those of the cell of PRED in their order)
    ESTI     := f64 low  f64 high  u32 positions  network        the error estimator
                f32 least[count]  f32 largest[count]             of its features
    BOUN     := u32 short  u32 long  u32 n_watched               the error bound
                f64 factor[3][n_outputs]  f64 limit[n_watched]
                f64 tolerance[n_outputs]                         of bounds that are trusted
                f64 floor[n_outputs]                             of bounds
                f64 share[n_outputs]                             of the disagreement
                f64 doubt                                        of what inputs do between samples
                network  network                                 the companion and the head
                f64 quietest[n_logarithms]                       what the head gets at least
    SPAN     := u32 block  f64 factor[n_outputs]                 its error estimate
    MOVE     := u32 flags  u32 n_candidates  u32 n_past  u32 n_scored
                n_inputs x (f64 largest change  f64 weight[n_candidates][n_past])
    RANG     := f64[n_outputs][2]                                of the outputs in the training
    META     := UTF-8 JSON, padded with spaces                   signals; the C runtime skips it
    network  := see slide_fmu/network/bytes.py

Inputs and outputs in SCIN and SCOU are in the order of the network. Start: u before a user sets
it, finite and within offset -+ scale. Hold: 0 zero-order, 1 first-order; the same for all inputs.
Angle: 0 none; 1 the cosine of an angle, with its sine, 2, in the next row; both with offset 0 and
the same scale. META has all other properties of a signal, and its start again.

PARA says how the weights of a state-space network follow physical parameters p. They are the
weights of PRED plus a sum over the terms: the product over the parameters of T_degree(z), times
the weights of the term. T is the Chebyshev polynomial, z = 2 (t(p) - t(low)) / (t(high) - t(low))
- 1, t by the transform: 0 p, 1 log p, 2 1 / p; low > 0 except for 0. There are at most 63 terms,
of degrees up to 16.

BOUN has the samples in a short and in a long block, the factors for the confidences 0.9, 0.95 and
0.99, the limits, tolerances, floors and a doubt that are not negative, shares, the companion and
the head (``error_bound.py``), which takes the estimates of ESTI where there is one. It is never in
a file with PARA. SPAN is only in files with BOUN and without ESTI (``span_estimate.py``); then the
head gives twice the number of values.

There is one version for all files: the sections that are present say what a file has. Another
layout gets another version.

MOVE describes the forecast of inputs with a first-order hold (``input_forecast.py``); without it
they are held while unknown. Flags: 1, the inputs are planned motions; 2, the FMU starts with
inputs_at_step_end = 1; 4, they are samples of measured records; 8, they jumped in the training.

A feed-forward surrogate gives n_outputs values per evaluation (n_samples = n_in - n_out + 1; a
block is n_out evaluations, one per position), or n_out * n_outputs values (n_samples = n_in; a
block is one evaluation, newest sample last). A state-space surrogate has n_samples = n_in, n_out
as the window, and n_values = n_outputs.
The estimator is a feed-forward network. It gives n_outputs values eps per evaluation, with e =
10^(m + r eps), m = (high + low)/2, r = (high - low)/2; or n_outputs expected errors mu, relative
to the standard deviation around them, followed by n_outputs values eps, with e = 10^(m + r eps)
sqrt(1 + mu^2). An e that is larger than 10^high, or not a number, counts as 10^high; so does every
e at a sample with a feature outside least .. largest. The estimate is the root of the mean square
of e over its last ``positions`` evaluations, times the scale of SCOU.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import zlib
from collections.abc import Callable
from typing import IO, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.signals import Angle, FloatArray, Hold, Signal
from slide_fmu.core.window import Window
from slide_fmu.network.base import Network
from slide_fmu.network.bytes import decode_network, encode_network
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_payload import (
    decode_bound,
    decode_span,
    encode_bound,
    encode_span,
)
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.input_forecast import MAX_CANDIDATES, MAX_PAST, InputForecast
from slide_fmu.surrogate.parameter_payload import (
    decode_parameters,
    encode_parameters,
    parameter_row,
)

Made = TypeVar("Made")

MAGIC = b"SLIDEFMU"
HEAD, CHECKSUM = 12, 4
"""Bytes before and after the sections."""
TAGS = tuple(b"WIND SCIN SCOU PRED PARA ESTI BOUN SPAN MOVE RANG META".split())
"""Tags of the sections, in their order."""
VERSION = 13
HOLDS: tuple[Hold, ...] = ("zero_order", "first_order")
ANGLES: tuple[Angle | None, ...] = (None, "cosine", "sine")
"""Holds and angles; their positions are the numbers in the file."""

INPUT_ROW = np.dtype(
    [("offset", "<f8"), ("scale", "<f8"), ("start", "<f8"), ("hold", "<u4"), ("angle", "<u4")]
)


class PayloadError(ValueError):
    """A surrogate file is damaged, of another version, or not a surrogate file."""


class SurrogateFields(TypedDict):
    """SurrogateFields are the fields of a ``Surrogate``, as its file has them."""

    name: str
    window: Window
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    input_scaling: Affine
    output_scaling: Affine
    network: Network
    estimator: ErrorEstimator | None
    forecast: InputForecast | None
    bound: ErrorBound | None
    output_ranges: FloatArray | None


def encode(fields: SurrogateFields) -> bytes:
    """Write the bytes of a surrogate file; the same surrogate gives the same bytes."""
    window, network, scaling = fields["window"], fields["network"], fields["output_scaling"]
    inputs, outputs = fields["inputs"], fields["outputs"]
    estimator, bound = fields["estimator"], fields["bound"]
    forecast, ranges = fields["forecast"], fields["output_ranges"]
    sizes = window.n_in, window.n_out, len(inputs), len(outputs)
    polynomial = network.polynomial if isinstance(network, StateSpace) else None
    body = MAGIC + struct.pack("<I", VERSION)
    body += _section(b"WIND", struct.pack("<dIIII", window.step, *sizes))
    body += _section(b"SCIN", _input_rows(inputs, fields["input_scaling"]))
    body += _section(b"SCOU", _f64(np.stack([scaling.offset, scaling.scale], 1)))
    body += _section(b"PRED", encode_network(network))
    if polynomial is not None:
        body += _section(b"PARA", encode_parameters(polynomial))
    if estimator is not None:
        body += _section(b"ESTI", _encode_estimator(estimator))
    if bound is not None:
        body += _bound_sections(bound)
    if forecast is not None:
        body += _section(b"MOVE", _encode_forecast(forecast))
    if ranges is not None:
        body += _section(b"RANG", _f64(ranges))
    metadata = {
        "name": fields["name"],
        "inputs": [_row(signal) for signal in inputs],
        "outputs": [_row(signal) for signal in outputs],
    }
    if polynomial is not None:
        metadata["parameters"] = [parameter_row(p) for p in polynomial.basis.parameters]
    text = json.dumps(metadata, sort_keys=True, ensure_ascii=False).encode("utf-8")
    body += _section(b"META", text + b" " * (-len(text) % 4))
    return body + struct.pack("<I", zlib.crc32(body))


def _bound_sections(bound: ErrorBound) -> bytes:
    """Return the section BOUN, and those that may follow it."""
    sections = _section(b"BOUN", encode_bound(bound))
    if bound.span is not None:
        sections += _section(b"SPAN", encode_span(bound.span))
    return sections


def decode(data: bytes, make: Callable[..., Made]) -> Made:
    """Read the bytes of a surrogate file.

    ``make`` builds the result from ``SurrogateFields``, by name, and checks that they fit
    together: it is ``Surrogate`` itself.

    Raises:
        PayloadError: the message has the offset and the expectation.
    """
    if len(data) < HEAD + CHECKSUM:
        raise PayloadError("not a surrogate file: expected it to begin with 'SLIDEFMU'")
    _check_version(data)
    (checksum,) = struct.unpack_from("<I", data, len(data) - 4)
    if zlib.crc32(data[:-4]) != checksum:
        raise PayloadError("surrogate file is damaged: its checksum does not match its content")
    reader = Reader(data[:-4], HEAD)
    try:
        fields = _decode_sections(reader)
        if reader.position != len(reader.data):
            raise ValueError("unexpected bytes after the last section")
        return make(**fields)
    except RecursionError as error:
        raise PayloadError("surrogate file: metadata is nested too deeply") from error
    except ValueError as error:
        raise PayloadError(f"surrogate file, near byte {reader.position}: {error}") from error


def require_lengths(file: IO[bytes], size: int) -> None:
    """Refuse a surrogate file that is longer than its sections, without keeping it in memory.

    Args:
        file: at its beginning; skipped bytes of a packed file are read.
        size: its length in bytes.

    Raises:
        PayloadError: the message has the offset and the expectation.
    """
    _check_version(file.read(HEAD))
    position, expected = HEAD, TAGS
    while position != size - CHECKSUM:
        file.seek(position)
        tag, length = file.read(4), int.from_bytes(file.read(4), "little")
        if tag not in expected:
            raise PayloadError(
                f"surrogate file, near byte {position} of {size}: section {tag!r}; expected "
                f"{', '.join(text.decode() for text in expected) or 'the end of the file'}"
            )
        expected = expected[expected.index(tag) + 1 :]
        position += 8 + length
        if position > size - CHECKSUM:
            raise PayloadError(
                f"surrogate file, section {tag.decode()}: it ends at byte {position}; expected at "
                f"most {size - CHECKSUM}"
            )


def _check_version(beginning: bytes) -> None:
    """Refuse what does not begin like a surrogate file of this version."""
    if len(beginning) < HEAD or beginning[: len(MAGIC)] != MAGIC:
        raise PayloadError("not a surrogate file: expected it to begin with 'SLIDEFMU'")
    version = int.from_bytes(beginning[len(MAGIC) : HEAD], "little")
    if version != VERSION:
        raise PayloadError(
            f"surrogate file of version {version}; expected version {VERSION}: make it again with "
            "this version of slide-fmu (slide-fmu run RECIPE), or use the version that made it"
        )


def _f64(values: FloatArray) -> bytes:
    return values.astype("<f8").tobytes()


def _section(tag: bytes, content: bytes) -> bytes:
    return tag + struct.pack("<I", len(content)) + content


def _row(signal: Signal) -> dict[str, str | float | None]:
    """Return the row of a signal in META."""
    row = dataclasses.asdict(signal)
    del row["hold"], row["angle"]
    return row


def _input_rows(inputs: tuple[Signal, ...], scaling: Affine) -> bytes:
    rows = [
        (offset, scale, u.start_value, HOLDS.index(u.hold), ANGLES.index(u.angle))
        for u, offset, scale in zip(inputs, scaling.offset, scaling.scale, strict=True)
    ]
    return np.array(rows, INPUT_ROW).tobytes()


def _decode_sections(reader: Reader) -> SurrogateFields:
    section = reader.section(b"WIND")
    step = float(section.f64(1)[0])
    n_in, n_out, n_inputs, n_outputs = (section.u32() for _ in range(4))
    section.done()
    window = Window(step, n_in, n_out)
    if n_inputs < 1 or n_outputs < 1:
        raise ValueError(f"n_inputs {n_inputs}, n_outputs {n_outputs}; expected some of both")
    section = reader.section(b"SCIN")
    rows = np.frombuffer(section.take(INPUT_ROW.itemsize * n_inputs), INPUT_ROW)
    section.done()
    for column, words in (("hold", HOLDS), ("angle", ANGLES)):
        if rows[column].max() >= len(words):
            raise ValueError(f"{column} {rows[column].max()}; expected less than {len(words)}")
    section = reader.section(b"SCOU")
    output_scaling = Affine(*section.f64(2 * n_outputs).reshape(n_outputs, 2).T.copy())
    section.done()
    section = reader.section(b"PRED")
    network = decode_network(section, n_inputs)
    section.done()
    terms = reader.section(b"PARA") if _is_next(reader, b"PARA") else None
    estimator = bound = forecast = output_ranges = None
    if _is_next(reader, b"ESTI"):
        estimator = _decode_estimator(reader.section(b"ESTI"), n_inputs)
    if _is_next(reader, b"BOUN"):
        moving = HOLDS[rows["hold"][0]] == "first_order"
        bound = _decode_bound(reader, (n_inputs, n_outputs), estimator, moving)
    if _is_next(reader, b"MOVE"):
        forecast = _decode_forecast(reader.section(b"MOVE"), n_inputs)
    if _is_next(reader, b"RANG"):
        section = reader.section(b"RANG")
        output_ranges = section.f64(2 * n_outputs).reshape(n_outputs, 2).copy()
        section.done()
    section = reader.section(b"META")
    text = section.take(len(section.data)).decode("utf-8").rstrip(" ")
    name, inputs, outputs = _described(text, rows)
    return {
        "name": name,
        "window": window,
        "inputs": inputs,
        "outputs": outputs,
        "input_scaling": Affine(rows["offset"].copy(), rows["scale"].copy()),
        "output_scaling": output_scaling,
        "network": network if terms is None else decode_parameters(terms, network, text),
        "estimator": estimator,
        "forecast": forecast,
        "bound": bound,
        "output_ranges": output_ranges,
    }


def _decode_bound(
    reader: Reader, sizes: tuple[int, int], estimator: ErrorEstimator | None, moving: bool
) -> ErrorBound:
    """Read the section BOUN, and those that may follow it; sizes: n_inputs, n_outputs."""
    section, span = reader.section(b"BOUN"), None
    if _is_next(reader, b"SPAN"):
        span = decode_span(reader.section(b"SPAN"), sizes[1])
    return decode_bound(section, *sizes, estimator, span, moving)


def _is_next(reader: Reader, tag: bytes) -> bool:
    return reader.data[reader.position : reader.position + 4] == tag


def _described(
    text: str, rows: NDArray[np.void]
) -> tuple[str, tuple[Signal, ...], tuple[Signal, ...]]:
    """Return the name and the signals, from META and from the rows of the inputs."""
    try:
        metadata = json.loads(text)
        described = metadata["inputs"]
        if len(described) != len(rows):
            raise ValueError(f"{len(described)} inputs; expected {len(rows)}, those of SCIN")
        inputs = tuple(
            Signal(**signal, hold=HOLDS[row["hold"]], angle=ANGLES[row["angle"]])
            for signal, row in zip(described, rows, strict=True)
        )
        name, outputs = metadata["name"], tuple(Signal(**row) for row in metadata["outputs"])
        if not isinstance(name, str):
            raise ValueError(f"name {name!r}; expected text")
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as error:
        raise ValueError(f"metadata is damaged: {error!r}") from error
    starts = [signal.start_value for signal in inputs]
    if starts != rows["start"].tolist():
        raise ValueError(
            f"by its metadata, inputs start at {starts}; expected {rows['start'].tolist()}"
        )
    return name, inputs, outputs


def _encode_estimator(estimator: ErrorEstimator) -> bytes:
    log_error = estimator.log_error
    head = struct.pack("<ddI", log_error.low, log_error.high, estimator.positions)
    return head + encode_network(estimator.network) + estimator.ranges.astype("<f4").tobytes()


def _decode_estimator(section: Reader, n_inputs: int) -> ErrorEstimator:
    low, high = (float(value) for value in section.f64(2))
    positions = section.u32()
    network = decode_network(section, n_inputs)
    if not isinstance(network, FeedForward):
        kind = type(network).__name__
        raise ValueError(f"error estimator: network is a {kind}; expected a FeedForward")
    ranges = section.f32(2, network.features.n_signals)
    section.done()
    return ErrorEstimator(network, LogError(low, high), positions, ranges)


PLANNED, AT_STEP_END, SAMPLED, JUMPS = 1, 2, 4, 8
"""Flags of MOVE."""


def _encode_forecast(forecast: InputForecast) -> bytes:
    n_inputs, n_candidates, n_past = forecast.weights.shape
    rows = [forecast.largest_change[:, None], forecast.weights.reshape(n_inputs, -1)]
    sizes = (n_candidates, n_past, forecast.n_scored)
    flags = PLANNED * forecast.planned + AT_STEP_END * forecast.at_step_end
    flags += SAMPLED * forecast.sampled + JUMPS * forecast.jumps
    head = struct.pack("<IIII", flags, *sizes)
    body: bytes = np.concatenate(rows, axis=1).astype("<f8").tobytes()
    return head + body


def _decode_forecast(section: Reader, n_inputs: int) -> InputForecast:
    flags, n_candidates, n_past, n_scored = (section.u32() for _ in range(4))
    if (
        flags > PLANNED + AT_STEP_END + SAMPLED + JUMPS
        or n_candidates > MAX_CANDIDATES
        or n_past > MAX_PAST
    ):
        raise ValueError(
            f"forecast with flags {flags}, {n_candidates} candidates of {n_past} "
            f"samples; expected flags up to 15, "
            f"at most {MAX_CANDIDATES} and {MAX_PAST}"
        )
    columns = 1 + n_candidates * n_past
    rows = section.f64(n_inputs * columns).reshape(n_inputs, columns).copy()
    section.done()
    return InputForecast(
        weights=rows[:, 1:].reshape(n_inputs, n_candidates, n_past),
        largest_change=rows[:, 0],
        n_scored=n_scored,
        planned=bool(flags & PLANNED),
        at_step_end=bool(flags & AT_STEP_END),
        sampled=bool(flags & SAMPLED),
        jumps=bool(flags & JUMPS),
    )
