"""The byte contract: round trips, and damaged files that end in PayloadError or nothing else."""

from __future__ import annotations

import io
import json
import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from slide_fmu.core.scaling import Affine
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.base import Network
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.payload import VERSION, PayloadError, require_lengths
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import forecasting
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.refusals import refused
from tests.strategies import all_shapes

SMALL = random_surrogate(
    Shape(n_in=3, n_out=2, n_inputs=2, hidden=(2,), activation="gelu", skip=True, positions=2)
).to_bytes()
"""About a thousand bytes with every kind of section, so that each of them can be damaged."""

CELLS = random_surrogate(
    Shape(n_in=3, n_out=2, positions=2, differences=1, cell=CellShape(2, 3))
).to_bytes()
"""The same with a state-space surrogate."""

GATED = random_surrogate(
    Shape(
        n_in=3,
        n_out=2,
        n_inputs=2,
        features="chain",
        cell=CellShape(2, 2, "gated", turned=1, factors=1),
    )
).to_bytes()
"""Gated units, with roles and the longest of the sets of features."""

ANGLE = random_surrogate(Shape(n_inputs=2, features="director")).to_bytes()
"""Two inputs, cosine and sine of an angle."""

MOVING = forecasting(
    random_surrogate(Shape(n_in=3, n_out=2, n_inputs=2, hidden=(2,), hold="first_order"))
).to_bytes()
"""Inputs that move, with their forecast."""

ROW = 32
"""Bytes of an input in SCIN."""

both_files = pytest.mark.parametrize(
    "data", [SMALL, CELLS, GATED, MOVING], ids=["feed_forward", "cells", "gated", "moving"]
)


def with_checksum(body: bytes) -> bytes:
    return body + struct.pack("<I", zlib.crc32(body))


def refused_or_read(data: bytes) -> bool:
    """Whether a file is refused; any exception but PayloadError fails the test."""
    try:
        Surrogate.from_bytes(data)
    except PayloadError:
        return True
    return False


@both_files
def test_lengths_of_sections_are_those_of_the_file_and_no_other(data: bytes) -> None:
    require_lengths(io.BytesIO(data), len(data))
    for damaged in (data[:-8], data + bytes(4), data[:64] + bytes(1000), data[:30], b""):
        with pytest.raises(PayloadError):
            require_lengths(io.BytesIO(damaged), len(damaged))


PARTS = ("chain", "scaling")
"""Parts of sets of features that have parts themselves."""


def features_of(features: FeatureMap) -> list[object]:
    """All that makes features."""
    normalised = [features.chosen, features.scaling.offset, features.scaling.scale]
    own = {"blocks": features.features.blocks, **vars(features.features)}
    parts = [vars(own.pop(name, None) or Affine.of_channels([], [])) for name in PARTS]
    return [*normalised, *(value for part in parts for value in part.values()), *own.values()]


def arrays_of(network: Network) -> list[object]:
    """All that makes a network, sizes and names among arrays."""
    sizes: list[object] = [network.n_samples, network.n_channels, network.n_values]
    assert isinstance(network, StateSpace | FeedForward)
    sizes += features_of(network.features)
    if isinstance(network, StateSpace):
        rest = [network.n_out, network.turned, *vars(network.roles).values()]
        return [*sizes, *rest, *vars(network.cell).values()]
    layers = [value for layer in network.layers for value in vars(layer).values()]
    return [*sizes, network.skip is None, *layers, 0 if network.skip is None else network.skip]


def same_network(one: Network, other: Network) -> bool:
    pairs = zip(arrays_of(one), arrays_of(other), strict=True)
    return type(one) is type(other) and all(np.array_equal(a, b) for a, b in pairs)  # type: ignore[arg-type]


@given(all_shapes())
def test_payload_that_is_written_and_read_is_the_same_surrogate(shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    data = surrogate.to_bytes()
    again = Surrogate.from_bytes(data)
    assert again.to_bytes() == data
    for name in ("name", "window", "inputs", "outputs"):
        assert getattr(again, name) == getattr(surrogate, name)
    assert same_network(again.network, surrogate.network)
    assert (again.estimator is None) == (surrogate.estimator is None)
    if again.estimator is not None and surrogate.estimator is not None:
        assert again.estimator.log_error == surrogate.estimator.log_error
        assert again.estimator.positions == surrogate.estimator.positions
        assert same_network(again.estimator.network, surrogate.estimator.network)


@both_files
def test_payload_truncated_anywhere_is_refused(data: bytes) -> None:
    for length in range(len(data)):
        assert refused_or_read(data[:length]), length
    for length in range(len(data) - 4):
        assert refused_or_read(with_checksum(data[:length])), length


def single_byte_damages(data: bytes) -> Iterator[bytearray]:
    for place in range(len(data) - 4):
        for flip in (1, 2, 4, 8, 16, 32, 64, 128, 255):
            damaged = bytearray(data[:-4])
            damaged[place] ^= flip
            yield damaged


def test_payload_with_any_byte_flipped_is_refused() -> None:
    for damaged in single_byte_damages(SMALL):
        assert refused_or_read(bytes(damaged) + SMALL[-4:])
    for place in range(len(SMALL) - 4, len(SMALL)):
        damaged = bytearray(SMALL)
        damaged[place] ^= 1
        assert refused_or_read(bytes(damaged))


@pytest.mark.extended
@both_files
def test_flipped_bytes_with_a_right_checksum_are_refused_or_read(data: bytes) -> None:
    """Weights may change unseen, sizes and tags may not."""
    damages = single_byte_damages(data)
    refused = [refused_or_read(with_checksum(bytes(body))) for body in damages]
    assert any(refused)
    assert not all(refused)


@both_files
@pytest.mark.parametrize("value", [0, 1, 2**30 + 1, 2**31 - 1, 2**31, 2**32 - 1])
def test_payload_with_any_wrong_number_is_refused_or_read_within_its_bytes(
    data: bytes, value: int
) -> None:
    """Every aligned number in turn, also products that overflow 32 and 64 bits."""
    for place in range(12, len(data) - 4, 4):
        body = data[:place] + struct.pack("<I", value) + data[place + 4 : -4]
        refused_or_read(with_checksum(body))


def refused_because(data: bytes, changes: list[tuple[int, int | float, str]], start: int) -> None:
    """Each word from a place on, changed on its own, is refused with its message."""
    for word, value, message in changes:
        place = start + 4 * word
        number = struct.pack("<I" if isinstance(value, int) else "<d", value)
        body = data[:place] + number + data[place + len(number) : -4]
        with pytest.raises(PayloadError, match=message):
            Surrogate.from_bytes(with_checksum(body))


def test_payload_with_impossible_features_is_refused() -> None:
    """Words: kind; set, order; count, signals 0 to 3; f64 offset[4]; f64 scale[4]."""
    wrong: list[tuple[int, int | float, str]] = [
        (0, 4, "network of kind 4"),
        (0, 3, "network of kind 3; expected 1 .feed-forward. or 2 .state space.: export it"),
        (1, 0, "features of set 0; expected one of .1, 4, 5."),
        (1, 2, "features of set 2; expected one of .1, 4, 5."),
        (2, 3, "differences = 3"),
        (3, 0, "chosen features .*; expected at least one"),
        (4, 2, "chosen features .* from 0 to 1"),
        (3, 2**32 - 1, "bytes expected"),
        (8, math.nan, "finite numbers"),
        (16, math.inf, "finite numbers"),
        (22, 0.0, "expected positive numbers"),
        (22, -1.0, "expected positive numbers"),
    ]
    refused_because(CELLS, wrong, CELLS.index(b"PRED") + 8)


def test_cell_of_impossible_sizes_is_refused_with_its_sizes() -> None:
    """Words after the features: n_samples, n_out, n, H, p, units, turned, roles."""
    start = CELLS.index(b"PRED") + 8 + 4 * 24
    wrong: list[tuple[int, int | float, str]] = [
        (0, 4, "n_samples, n_out, n_values"),
        (1, 1, "n_samples, n_out, n_values"),
        (1, 0, "expected 1 <= n_out"),
        (2, 0, "0 states"),
        (4, 0, "0 rows"),
        (5, 2, "units 2 of a cell"),
        (5, 8, "units 8 of a cell"),
        (5, 3 + 256 * 16, "17 sub-steps of a cell"),
        (6, 1, "1 turned pairs"),
        (8, 4, "role of feature 4; there are 4"),
        (2, 2**32 - 1, "bytes expected"),
        (3, 2**32 - 1, "bytes expected"),
        (7, 2**32 - 1, "bytes expected"),
    ]
    refused_because(CELLS, wrong, start)


def test_payload_with_an_impossible_chain_is_refused() -> None:
    """f64 step, then finite numbers; 8 joints would not fit."""
    start = GATED.index(b"PRED") + 8 + 8
    step = "expected a positive, finite step"
    wrong: list[tuple[int, int | float, str]] = [
        *((0, value, step) for value in (0.0, -1.0, math.nan, math.inf)),
        (2, math.nan, "drive law: position"),
        (8, math.inf, "drive law: acceleration"),
        (10, math.nan, "middle or half range"),
        (16, math.inf, "middle or half range"),
        (18, math.nan, "serial chain: prismatic"),
        (18, 0.5, "expected 1 for prismatic joints"),
        (22, math.nan, "serial chain: theta"),
        (60, math.inf, "serial chain: inertias"),
        (60, 1.0, "expected a symmetric tensor"),
    ]
    refused_because(GATED, wrong, start)


def test_payload_with_impossible_start_values_is_refused() -> None:
    """Of every input: offset, scale, start, each of 8 bytes, hold and angle, of 4."""
    outside = "by its metadata, inputs start at"
    begin = SMALL.index(b"SCIN") + 8
    offset, scale, _ = struct.unpack_from("<ddd", SMALL, begin + ROW)
    ends = [offset - scale, offset + scale]
    wrong: list[tuple[int, int | float, str]] = [
        (0, value, outside)
        for value in (math.nan, math.inf, -math.inf, ends[0] - 1e-6, ends[1] + 1e-6)
    ]
    refused_because(SMALL, wrong, begin + ROW + 16)
    surrogate = Surrogate.from_bytes(SMALL)
    for end in (*ends, np.nextafter(ends[1], math.inf)):  # rounding is none of it
        wide = replace(surrogate.inputs[1], low=-9.0, high=9.0, start=float(end))
        at_end = replace(surrogate, inputs=(surrogate.inputs[0], wide))
        assert Surrogate.from_bytes(at_end.to_bytes()).starts[1] == end
    for beyond in (ends[0] - 1e-6, ends[1] + 1e-6):
        wide = replace(surrogate.inputs[1], low=-9.0, high=9.0, start=float(beyond))
        with refused(ValueError, "input 1 starts at", "but its scaling covers"):
            replace(surrogate, inputs=(surrogate.inputs[0], wide))


def test_starts_of_file_and_metadata_are_the_same() -> None:
    place = SMALL.index(b"SCIN") + 8 + 16
    (start,) = struct.unpack_from("<d", SMALL, place)
    body = SMALL[:place] + struct.pack("<d", start + 1e-6) + SMALL[place + 8 : -4]
    with refused(PayloadError, "inputs start"):
        Surrogate.from_bytes(with_checksum(body))


def test_payload_with_impossible_holds_or_angles_is_refused() -> None:
    """Of two inputs, neither of which is an angle: each number changed by itself."""
    hold = SMALL.index(b"SCIN") + 8 + 24
    wrong: list[tuple[int, int | float, str]] = [
        (0, 2, "hold 2; expected less than 2"),
        (0, 1, "inputs of several holds"),
        (1, 3, "angle 3; expected less than 3"),
        (1, 1, "input 'u0' is the cosine of an angle; expected its sine directly behind it"),
        (1, 2, "input 'u0' is the sine of an angle; expected its cosine directly before it"),
        (ROW // 4 + 1, 1, "input 'u1' is the cosine of an angle"),
        (ROW // 4 + 1, 2, "input 'u1' is the sine of an angle"),
    ]
    refused_because(SMALL, wrong, hold)


def test_angles_are_scaled_alike_about_zero() -> None:
    begin = ANGLE.index(b"SCIN") + 8
    scaled = "cosine and sine of an angle with offsets .* and scales"
    wrong: list[tuple[int, int | float, str]] = [(0, 0.1, scaled), (ROW // 4 + 2, 1.9, scaled)]
    refused_because(ANGLE, wrong, begin)


def test_features_of_an_angle_without_an_angle_are_refused() -> None:
    begin = ANGLE.index(b"SCIN") + 8
    words = [begin + 28, begin + ROW + 28]
    body = bytearray(ANGLE[:-4])
    for place in words:
        body[place : place + 4] = struct.pack("<I", 0)
    with refused(PayloadError, "['u0', 'u1'] are no", "a network"):
        Surrogate.from_bytes(with_checksum(bytes(body)))


def test_huge_layer_is_refused_before_it_is_allocated() -> None:
    place = SMALL.index(b"PRED") + 8 + 12 + 4 * (1 + 2) + 16 * 2 + 4
    sizes = struct.pack("<II", 2**32 - 1, 2**32 - 1)
    with refused(PayloadError, "bytes expected"):
        Surrogate.from_bytes(with_checksum(SMALL[:place] + sizes + SMALL[place + 8 : -4]))


def test_message_about_a_damaged_payload_names_what_is_wrong() -> None:
    with refused(PayloadError, "expected it to", "with 'SLIDEFMU'"):
        Surrogate.from_bytes(b"PK\x03\x04" + bytes(100))
    with refused(PayloadError, "checksum does not match"):
        Surrogate.from_bytes(SMALL[:-4] + bytes(4))
    with refused(PayloadError, "unexpected bytes"):
        Surrogate.from_bytes(with_checksum(SMALL[:-4] + bytes(4)))
    with refused(PayloadError, "near byte", "section b'XXXX'; expected b'SCIN'"):
        Surrogate.from_bytes(with_checksum(SMALL[:-4].replace(b"SCIN", b"XXXX")))


@pytest.mark.parametrize(
    "change",
    [
        {"name": 5},
        {"name": "2nd"},
        {"inputs": []},
        {"inputs": 3},
        {"outputs": [{"name": "y0", "unit": "m", "low": 1, "high": 0}]},
        {"outputs": [{"name": "y0", "unit": "m", "low": 0, "high": 1, "start": "now"}]},
        {"outputs": [{"name": "y0", "unit": "m", "low": 0, "high": 10**400}]},
    ],
    ids=["name", "identifier", "no_inputs", "inputs", "range", "start", "overflow"],
)
def test_damaged_metadata_is_refused(change: dict[str, object]) -> None:
    place = SMALL.index(b"META")
    metadata = json.loads(SMALL[place + 8 : -4])
    content = json.dumps({**metadata, **change}).encode()
    content += b" " * (-len(content) % 4)
    body = SMALL[:place] + b"META" + struct.pack("<I", len(content)) + content
    assert refused_or_read(with_checksum(body))


@pytest.mark.parametrize("text", ["[]", "3", "{", "null", '"x"', "{}"])
def test_metadata_of_another_kind_is_refused(text: str) -> None:
    place = SMALL.index(b"META")
    content = text.ljust(8).encode()
    body = SMALL[:place] + b"META" + struct.pack("<I", len(content)) + content
    assert refused_or_read(with_checksum(body))


def test_forecast_of_inputs_is_kept_to_the_bit() -> None:
    surrogate = Surrogate.from_bytes(MOVING)
    expected = forecasting(replace(surrogate, forecast=None)).forecast
    assert surrogate.forecast is not None
    assert expected is not None
    assert not surrogate.inputs_at_step_end
    assert vars(surrogate.forecast).keys() == vars(expected).keys()
    for name, value in vars(expected).items():
        np.testing.assert_array_equal(getattr(surrogate.forecast, name), value)
    assert surrogate.to_bytes() == MOVING


@pytest.mark.parametrize("flag", ["planned", "at_step_end", "sampled", "jumps"])
def test_each_flag_of_a_forecast_is_kept_alone(flag: str) -> None:
    flags = dict.fromkeys(("planned", "at_step_end", "sampled", "jumps"), False) | {flag: True}
    moving = Surrogate.from_bytes(MOVING)
    assert moving.forecast is not None
    flagged = replace(moving, forecast=replace(moving.forecast, **flags))
    found = Surrogate.from_bytes(flagged.to_bytes()).forecast
    assert {name: getattr(found, name) for name in flags} == flags


def test_forecast_of_held_inputs_or_of_another_number_is_refused() -> None:
    moving, held = Surrogate.from_bytes(MOVING), Surrogate.from_bytes(SMALL)
    with refused(ValueError, "forecast of 2 inputs", "the hold 'zero_order'"):
        replace(held, forecast=moving.forecast)
    alone = random_surrogate(Shape(hold="first_order"))
    with refused(ValueError, "forecast of 2 inputs", "expected 1"):
        replace(alone, forecast=moving.forecast)


@pytest.mark.parametrize("version", [VERSION - 1, VERSION + 1, 0])
def test_file_of_another_version_is_refused_with_the_remedy(version: int) -> None:
    other = with_checksum(SMALL[:8] + struct.pack("<I", version) + SMALL[12:-4])
    expected = f"surrogate file of version {version}; expected version {VERSION}: make it again"
    with refused(PayloadError, expected):
        Surrogate.from_bytes(other)
    with refused(PayloadError, expected):
        require_lengths(io.BytesIO(other), len(other))
