"""Surrogates with physical parameters: predictions, bytes, derivatives, refusals."""

from __future__ import annotations

import json
import struct
import zlib
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.gradient import parameter_jacobian
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.plain import five_point_slope
from tests.fmu.samples import PARAMETERS, CellShape, Shape, random_surrogate
from tests.refusals import refused

SHAPE = Shape(n_in=20, n_out=6, n_inputs=2, n_outputs=2, cell=CellShape(states=4, parameters=2))
GIVEN = {"mass": 2.6, "damping": -0.7}
SLOPE = 1e-3
"""Deviation of a derivative allowed, relative to the largest: predictions are float32."""


def inputs(count: int, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 2))


def test_predictions_are_those_of_the_surrogate_for_fixed_values() -> None:
    surrogate = random_surrogate(SHAPE)
    fixed, record = surrogate.at(GIVEN), inputs(70)
    assert surrogate.parameters == PARAMETERS[:2]
    assert fixed.parameters == ()
    assert fixed.at({}) is fixed
    assert np.array_equal(surrogate.predict(record, GIVEN), fixed.predict(record))
    newest = surrogate.predict_newest(record, GIVEN)
    assert np.array_equal(newest, fixed.predict_newest(record))
    assert np.abs(newest - surrogate.predict_newest(record)).max() > 1e-3


def test_parameters_that_are_not_given_have_their_start_values() -> None:
    surrogate, record = random_surrogate(SHAPE), inputs(30)
    starts = {parameter.name: parameter.start_value for parameter in PARAMETERS[:2]}
    at_starts = surrogate.predict(record, starts)
    assert np.array_equal(surrogate.predict(record), at_starts)
    assert np.array_equal(surrogate.predict(record, {"mass": starts["mass"]}), at_starts)


def test_surrogate_with_other_starts_predicts_as_with_these_values() -> None:
    surrogate, record = random_surrogate(SHAPE), inputs(30)
    started = surrogate.starting_at(GIVEN)
    assert {parameter.name: parameter.start for parameter in started.parameters} == GIVEN
    assert np.array_equal(started.predict(record), surrogate.predict(record, GIVEN))
    assert np.array_equal(
        started.predict(record, {"mass": 1.5}), surrogate.predict(record, {**GIVEN, "mass": 1.5})
    )
    with refused(ValueError, "expected a number in", "its range"):
        surrogate.starting_at({"mass": 99.0})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass": 3.1}, r"'mass' = 3.1 kg; expected a number in its range, 1 \.\. 3 kg"),
        ({"weight": 1.0}, r"parameter 'weight'; expected one of \['mass', 'damping'\]"),
    ],
)
def test_bad_parameters_are_refused(given: dict[str, float], message: str) -> None:
    surrogate, record = random_surrogate(SHAPE), inputs(30)
    for predict in (surrogate.predict, surrogate.predict_newest):
        with pytest.raises(ValueError, match=message):
            predict(record, given)


def test_surrogate_without_parameters_takes_none() -> None:
    plain = random_surrogate(Shape(n_inputs=2))
    with refused(ValueError, "the surrogate has no parameters"):
        plain.predict(inputs(30), {"mass": 1.0})
    with refused(ValueError, "has no physical parameters"):
        parameter_jacobian(plain, inputs(30))


def test_derivatives_by_parameters_are_those_of_differences() -> None:
    surrogate, record = random_surrogate(SHAPE), inputs(40)
    found = parameter_jacobian(surrogate, record, GIVEN)
    assert found.shape == (40, 2, 2)
    for index, name in enumerate(GIVEN):

        def moved(amount: float, name: str = name) -> FloatArray:
            return surrogate.predict(record, {**GIVEN, name: GIVEN[name] + amount})

        expected = five_point_slope(moved, distance=0.02)
        allowed = SLOPE * np.abs(expected).max()
        assert found[..., index] == pytest.approx(expected, abs=allowed)


@pytest.mark.parametrize(
    "cell",
    [
        CellShape(parameters=1),
        CellShape(parameters=3, roles=True, factors=1),
        CellShape(states=4, parameters=2, activation="gated", turned=1),
        CellShape(parameters=1, units=0),
    ],
)
def test_bytes_hold_all_of_a_surrogate(cell: CellShape) -> None:
    surrogate = random_surrogate(Shape(n_inputs=3, n_outputs=2, cell=cell, positions=2))
    data = surrogate.to_bytes()
    read = Surrogate.from_bytes(data)
    assert read.parameters == surrogate.parameters
    assert read.to_bytes() == data
    record = np.random.default_rng(1).uniform(-1, 1, (40, 3))
    given = {"mass": 1.3}
    assert np.array_equal(read.predict(record, given), surrogate.predict(record, given))


def section_of(data: bytes, tag: bytes) -> slice:
    """Where the content of a section stands."""
    first = data.index(tag) + 8
    (length,) = struct.unpack_from("<I", data, first - 4)
    return slice(first, first + length)


def resealed(data: bytes, tag: bytes, content: bytes) -> bytes:
    """A file with another content of a section, and a checksum that fits."""
    place = section_of(data, tag)
    body = data[: place.start - 4] + struct.pack("<I", len(content)) + content
    body += data[place.stop : -4]
    return body + struct.pack("<I", zlib.crc32(body))


def with_metadata(data: bytes, **changes: Any) -> bytes:
    """A file whose first parameter is told to be another one."""
    metadata = json.loads(data[section_of(data, b"META")])
    metadata["parameters"][0].update(changes)
    text = json.dumps(metadata).encode()
    return resealed(data, b"META", text + b" " * (-len(text) % 4))


def test_damaged_parameters_are_refused() -> None:
    data = random_surrogate(Shape(cell=CellShape(parameters=1))).to_bytes()
    content = data[section_of(data, b"PARA")]
    none, many = struct.pack("<I", 0), struct.pack("<I", 10**6)
    transform = content[:28] + struct.pack("<I", 3) + content[32:]
    terms = content[:36] + struct.pack("<I", 0) + content[40:]
    degree = content[:40] + struct.pack("<I", 17) + content[44:]
    cases = {
        "0 parameters with": resealed(data, b"PARA", none + content[4:]),
        "bytes expected": resealed(data, b"PARA", many + content[4:]),
        "transforms below 3": resealed(data, b"PARA", transform),
        "0 terms of parameters": resealed(data, b"PARA", terms),
        "degree 17 of a parameter": resealed(data, b"PARA", degree),
        "4 bytes too many": resealed(data, b"PARA", content + bytes(4)),
        "by their metadata": with_metadata(data, high=4.0),
        "metadata of the parameters is damaged": with_metadata(data, unknown=1),
        "name 'two words'": with_metadata(data, name="two words"),
    }
    for message, damaged in cases.items():
        with pytest.raises(PayloadError, match=message):
            Surrogate.from_bytes(damaged)
