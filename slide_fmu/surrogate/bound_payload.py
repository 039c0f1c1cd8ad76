"""These are the bytes of an error bound in a surrogate file; the contract is in ``payload.py``.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/bytes/payload.c``.
"""

from __future__ import annotations

import struct

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.bytes import decode_network, encode_network
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import statistics_count
from slide_fmu.surrogate.error_bound import CONFIDENCES, ErrorBound
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.span_estimate import SpanEstimate


def encode_bound(bound: ErrorBound) -> bytes:
    """Write the content of the section BOUN."""
    sizes = struct.pack("<III", *bound.blocks, len(bound.limits))
    numbers = _f64(bound.factors, bound.limits, bound.tolerances, bound.floors, bound.shares)
    numbers += struct.pack("<d", bound.doubt)
    networks = encode_network(bound.companion) + encode_network(bound.head)
    return sizes + numbers + networks + _f64(bound.quietest)


def _f64(*parts: FloatArray) -> bytes:
    return b"".join(part.astype("<f8").tobytes() for part in parts)


def encode_span(span: SpanEstimate) -> bytes:
    """Write the content of the section SPAN."""
    return struct.pack("<I", span.block) + span.factors.astype("<f8").tobytes()


def decode_span(section: Reader, n_outputs: int) -> SpanEstimate:
    """Read the content of the section SPAN."""
    block = section.u32()
    factors = section.f64(n_outputs)
    section.done()
    return SpanEstimate(block, factors)


def decode_bound(
    section: Reader,
    n_inputs: int,
    n_outputs: int,
    estimator: ErrorEstimator | None,
    span: SpanEstimate | None,
    moving: bool,
) -> ErrorBound:
    """Read the content of the section BOUN of a surrogate.

    ``estimator`` is the surrogate's error estimator, or None; ``span`` is the content of the
    section SPAN; ``moving`` tells whether its inputs move.
    """
    short, long, n_watched = (section.u32() for _ in range(3))
    factors = section.f64(len(CONFIDENCES) * n_outputs).reshape(len(CONFIDENCES), n_outputs)
    limits = section.f64(n_watched)
    tolerances, floors, shares = (section.f64(n_outputs).copy() for _ in range(3))
    (doubt,) = section.f64(1)
    companion = decode_network(section, n_inputs)
    if not isinstance(companion, StateSpace):
        kind = type(companion).__name__
        raise ValueError(f"error bound: companion is a {kind}; expected a StateSpace")
    n_seen = len(companion.cell.a) + len(companion.roles.drive)
    n_statistics = statistics_count(n_seen, n_outputs, estimator is not None)
    head = _decode_head(section, n_statistics)
    quietest = section.f64(n_statistics - n_seen).copy()
    section.done()
    return ErrorBound(
        companion,
        head,
        (short, long),
        factors,
        limits,
        tolerances=tolerances,
        floors=floors,
        shares=shares,
        doubt=float(doubt),
        moving=moving,
        quietest=quietest,
        estimator=estimator,
        span=span,
    )


def _decode_head(section: Reader, n_statistics: int) -> FeedForward:
    head = decode_network(section, n_statistics)
    if not isinstance(head, FeedForward):
        kind = type(head).__name__
        raise ValueError(f"error bound: head is a {kind}; expected a FeedForward")
    return head
