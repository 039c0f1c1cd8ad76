"""Surrogate files whose error bound the library refuses, as Python does."""

from __future__ import annotations

import copy
import dataclasses
import math
import re
import struct

import numpy as np
import pytest

from slide_fmu.core.window import MAX_WINDOW
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import (
    bounded_surrogate,
    random_bound,
    with_span,
)
from tests.fmu.native import Load
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.fmu.test_refused_payloads import edited, refused, with_checksum

SHAPE = Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape())
LONGEST = MAX_WINDOW // 9
TOLERANCES = 12 + 8 * (3 * 2 + 9)
FLOORS, SHARES, DOUBT = TOLERANCES + 8 * 2, TOLERANCES + 8 * 4, TOLERANCES + 8 * 6
"""Places of the numbers of two outputs in a section BOUN with nine limits."""


def unchecked(surrogate: Surrogate, **changes: object) -> bytes:
    """A surrogate file with parts of the bound that were never checked."""
    bound, changed = copy.copy(surrogate.bound), copy.copy(surrogate)
    for name, part in changes.items():
        object.__setattr__(bound, name, part)
    object.__setattr__(changed, "bound", bound)
    return changed.to_bytes()


def bound_of(surrogate: Surrogate) -> ErrorBound:
    assert surrogate.bound is not None
    return surrogate.bound


@pytest.mark.extended
def test_library_reads_the_longest_blocks(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE, (LONGEST, LONGEST))
    assert load(surrogate).instance().component.value


@pytest.mark.parametrize(
    ("short", "long"),
    [(0, 5), (5, 4), (1, LONGEST + 1), (0xFFFFFFFF, 0xFFFFFFFF), (2, 0xFFFFFFFF)],
)
def test_blocks_of_impossible_lengths_are_refused(load: Load, short: int, long: int) -> None:
    surrogate = bounded_surrogate(SHAPE)
    message = refused(load(surrogate), unchecked(surrogate, blocks=(short, long)))
    assert f"error bound with blocks of {short} and {long} samples; expected 1 to" in message


NOT_FINITE = (math.nan, math.inf)
NOT_POSITIVE, NEGATIVE = (0.0, -1.0, *NOT_FINITE), (-1e-9, *NOT_FINITE)
N_LOGARITHMS = bound_of(bounded_surrogate(SHAPE)).n_logarithms

IMPOSSIBLE_NUMBERS = [
    # section, place, type, values, and a pattern of what is said
    (b"BOUN", 8, "<I", (0, 10, 0xFFFFFFFF), "surrogate file"),  # the number of limits
    (b"BOUN", 12, "<d", NOT_POSITIVE, "factor |error bound number"),
    (b"BOUN", 12 + 8 * 5, "<d", NOT_POSITIVE, "factor |error bound number"),
    (b"BOUN", 12 + 8 * 6, "<d", NOT_POSITIVE, "limit |error bound number"),
    (b"BOUN", TOLERANCES + 8, "<d", NOT_POSITIVE, "tolerance "),
    (b"BOUN", FLOORS + 8, "<d", NEGATIVE, "floor "),
    (b"BOUN", SHARES + 8, "<d", (0.0, -0.5, 1.001, math.nan), "share "),
    (b"BOUN", DOUBT, "<d", NEGATIVE, "doubt "),
    (b"SPAN", 0, "<I", (0, LONGEST + 1, 0xFFFFFFFF), r"blocks of \d+ samples; expected 1 to"),
    (b"SPAN", 4 + 8, "<d", NOT_POSITIVE, "factor |error estimate number"),
]


@pytest.mark.parametrize(
    ("section", "place", "kind", "value", "message"),
    [(*row, value, message) for *row, values, message in IMPOSSIBLE_NUMBERS for value in values],
)
def test_impossible_number_is_refused(
    load: Load, section: bytes, place: int, kind: str, value: float, message: str
) -> None:
    surrogate = with_span(bounded_surrogate(SHAPE))
    said = refused(load(surrogate), edited(surrogate, section, place, kind, value))
    assert re.search(message, said), said


@pytest.mark.parametrize("value", [*NOT_FINITE, -math.inf])
@pytest.mark.parametrize("from_end", [1, N_LOGARITHMS])
def test_quietest_logarithms_that_are_not_finite_are_refused(
    load: Load, from_end: int, value: float
) -> None:
    surrogate = bounded_surrogate(SHAPE)
    content = edited(surrogate, b"BOUN", -8 * from_end, "<d", value)
    assert "quietest" in refused(load(surrogate), content)


def test_factors_that_fall_are_refused(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    falling = float(bound_of(surrogate).factors[0, 1]) * 0.999
    message = refused(load(surrogate), edited(surrogate, b"BOUN", 12 + 8 * 3, "<d", falling))
    assert "expected positive ones that rise with the confidence" in message


def test_another_number_of_limits_is_refused(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    content = unchecked(surrogate, limits=bound_of(surrogate).limits[:-1])
    message = refused(load(surrogate), content)
    assert "8 limits of an error bound; expected 9" in message


def test_companion_that_is_no_state_space_is_refused(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    layers = random_surrogate(dataclasses.replace(SHAPE, cell=None)).network
    message = refused(load(surrogate), unchecked(surrogate, companion=layers))
    assert "companion of an error bound is a network of kind 1; expected 2" in message


@pytest.mark.parametrize("changes", [{"n_in": 7}, {"n_out": 1}, {"n_outputs": 1}], ids=str)
def test_companion_of_another_window_is_refused(load: Load, changes: dict[str, int]) -> None:
    surrogate = bounded_surrogate(SHAPE)
    other = random_surrogate(dataclasses.replace(SHAPE, **changes)).network  # type: ignore[arg-type]
    message = refused(load(surrogate), unchecked(surrogate, companion=other))
    assert "companion of an error bound maps" in message


def test_companion_that_sees_an_angle_of_other_inputs_is_refused(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    director = random_surrogate(dataclasses.replace(SHAPE, features="director")).network
    assert isinstance(director, StateSpace)
    content = unchecked(surrogate, **vars(random_bound(director, 0)))
    message = refused(load(surrogate), content)
    assert "features of an angle" in message


def test_head_that_is_not_feed_forward_is_refused(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    message = refused(load(surrogate), unchecked(surrogate, head=surrogate.network))
    assert "surrogate file" in message


@pytest.mark.parametrize("fault", ["samples", "differences", "chosen"])
def test_head_of_other_sizes_is_refused(load: Load, fault: str) -> None:
    surrogate = bounded_surrogate(SHAPE)
    head = bound_of(surrogate).head
    count, features = head.n_channels, head.features
    first, last = head.layers
    if fault == "samples":
        wider = dataclasses.replace(first, weights=first.weights.repeat(2, axis=1))
        other = FeedForward((wider, last), 2, features)
    elif fault == "differences":
        every = tuple(range(count))
        other = FeedForward(head.layers, 1, FeatureMap(Differences(count, 1), every))
    else:
        narrow = dataclasses.replace(first, weights=first.weights[:, :-1])
        some = FeatureMap(Differences(count), tuple(range(count - 1)))
        other = FeedForward((narrow, last), 1, some)
    message = refused(load(surrogate), unchecked(surrogate, head=other))
    assert "the head of an error bound maps" in message


@pytest.mark.parametrize(
    ("count", "spanned"), [(1, False), (3, False), (4, False), (2, True), (3, True), (5, True)]
)
def test_head_of_another_number_of_values_is_refused(
    load: Load, count: int, spanned: bool
) -> None:
    surrogate = bounded_surrogate(SHAPE)
    surrogate, expected = (with_span(surrogate), 4) if spanned else (surrogate, 2)
    head = bound_of(surrogate).head
    first, last = head.layers
    rows = np.arange(count) % len(last.bias)
    other = dataclasses.replace(last, weights=last.weights[rows], bias=last.bias[rows])
    content = unchecked(surrogate, head=FeedForward((first, other), 1, head.features))
    message = refused(load(surrogate), content)
    assert f"the head of an error bound gives {count} values; expected {expected}" in message


def test_bound_of_layers_is_refused(load: Load) -> None:
    layers = random_surrogate(dataclasses.replace(SHAPE, cell=None))
    changed = copy.copy(layers)
    object.__setattr__(changed, "bound", bounded_surrogate(SHAPE).bound)
    message = refused(load(layers), changed.to_bytes())
    assert "an error bound of a network of kind 1 with 0 parameters" in message


def test_bound_of_a_network_with_parameters_is_refused(load: Load) -> None:
    surrogate = random_surrogate(dataclasses.replace(SHAPE, cell=CellShape(parameters=1)))
    changed = copy.copy(surrogate)
    object.__setattr__(changed, "bound", bounded_surrogate(SHAPE).bound)
    message = refused(load(surrogate), changed.to_bytes())
    assert "an error bound of a network of kind 2 with 1 parameters" in message


def test_bytes_behind_the_head_are_refused(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    body = surrogate.to_bytes()[:-4]
    begin, end = body.index(b"BOUN"), body.index(b"META")
    longer = struct.pack("<I", end - begin - 8 + 4)
    content = body[: begin + 4] + longer + body[begin + 8 : end] + bytes(4) + body[end:]
    message = refused(load(surrogate), with_checksum(content))
    assert "4 bytes too many in section BOUN" in message


@pytest.mark.parametrize("part", [0.02, 0.2, 0.5, 0.9])
def test_bound_that_is_cut_off_is_refused(load: Load, part: float) -> None:
    surrogate = bounded_surrogate(SHAPE)
    body = surrogate.to_bytes()[:-4]
    begin, end = body.index(b"BOUN"), body.index(b"META")
    kept = 4 * int(part * (end - begin - 8) / 4)
    content = body[: begin + 4] + struct.pack("<I", kept) + body[begin + 8 : begin + 8 + kept]
    message = refused(load(surrogate), with_checksum(content + body[end:]))
    assert "surrogate file" in message


def test_estimate_of_a_bound_beside_an_estimator_is_refused(load: Load) -> None:
    spanned = with_span(bounded_surrogate(SHAPE))
    seeing = bounded_surrogate(dataclasses.replace(SHAPE, positions=3))
    body, other = seeing.to_bytes()[:-4], spanned.to_bytes()[:-4]
    section = other[other.index(b"SPAN") : other.index(b"META")]
    place = body.index(b"META")
    message = refused(load(seeing), with_checksum(body[:place] + section + body[place:]))
    assert "estimate of the bound beside an error estimator; expected one" in message


@pytest.mark.parametrize("count", [0, 1, 3])
@pytest.mark.parametrize("name", ["tolerances", "floors", "shares", "quietest"])
def test_another_number_of_tolerances_is_refused(load: Load, name: str, count: int) -> None:
    surrogate = bounded_surrogate(SHAPE)
    content = unchecked(surrogate, **{name: np.ones(count)})
    assert "surrogate file" in refused(load(surrogate), content)


def test_floor_of_zero_is_read(load: Load) -> None:
    surrogate = bounded_surrogate(SHAPE)
    content = edited(surrogate, b"BOUN", FLOORS + 8, "<d", 0.0)
    again = Surrogate.from_bytes(content)
    assert again.to_bytes() == content
    assert load(again).instance().component.value


@pytest.mark.parametrize("positions", [0, 3])
def test_head_that_does_not_see_the_estimator_that_there_is_is_refused(
    load: Load, positions: int
) -> None:
    one, other = (
        bounded_surrogate(dataclasses.replace(SHAPE, positions=count))
        for count in (positions, 3 - positions)
    )
    head, quietest = bound_of(other).head, bound_of(other).quietest
    content = unchecked(one, head=head, quietest=quietest)
    assert "surrogate file" in refused(load(one), content)
