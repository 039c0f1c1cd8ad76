"""Files of former versions are read as what they were, or refused where they are damaged."""

from __future__ import annotations

import dataclasses
import struct

import numpy as np
import pytest
from hypothesis import assume, given

from mbs_models.robot_6r.puma_560 import puma_560
from slide_fmu.core.byte_reader import Reader
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.drive_law import DRIVE_LAWS
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.sets import decode_features, encode_features
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import Shape, random_surrogate
from tests.strategies import all_shapes
from tests.surrogate.test_payload import (
    ROW,
    SMALL,
    refused_or_read,
    single_byte_damages,
    with_checksum,
)


def with_former_director(body: bytes) -> bytes:
    """A file without checksum whose networks see an angle by the set that version 4 had."""
    now = struct.pack("<III4d", 5, 2, 3, 0, 0, 1, 1)
    for tag in (b"PRED", b"ESTI"):
        at = body.find(tag) + 4
        if at >= 4 and now in body[at:]:
            (length,) = struct.unpack_from("<I", body, at)
            section = body[at + 4 : at + 4 + length]
            former = section.replace(now, struct.pack("<I", 2), 1)
            size = struct.pack("<I", len(former))
            body = body[:at] + size + former + body[at + 4 + length :]
    return body


def version_4_of(surrogate: Surrogate) -> bytes:
    """The file as version 4 had it, by its byte contract."""
    body = with_former_director(surrogate.to_bytes()[:-4])
    window, rows, outputs = (body.index(tag) for tag in (b"WIND", b"SCIN", b"SCOU"))
    hold = struct.pack("<I", surrogate.hold == "first_order")
    inputs = b"".join(body[at : at + 24] for at in range(rows + 8, outputs, ROW))
    return with_checksum(
        body[:8]
        + struct.pack("<I", 4)
        + b"WIND"
        + struct.pack("<I", 28)
        + body[window + 8 : rows]
        + hold
        + b"SCIN"
        + struct.pack("<I", len(inputs))
        + inputs
        + body[outputs:]
    )


@given(all_shapes())
def test_a_file_of_version_4_is_read_as_what_it_was(shape: Shape) -> None:
    """Its network's features say what is an angle."""
    assume(shape.features != "director" or shape.n_inputs == 2)
    surrogate = random_surrogate(shape)
    assert Surrogate.from_bytes(version_4_of(surrogate)).to_bytes() == surrogate.to_bytes()


def test_chain_of_former_versions_is_read_as_what_it_was() -> None:
    """Set 3: revolute joints, Denavit and Hartenberg, quadratic B-spline."""
    arm = puma_560(np.array([0.0, 0.1, 0.2]))
    steps = arm.steps.T
    middle, half_range = np.arange(6.0), 0.5 + np.arange(6.0)
    links = [arm.masses, arm.centres, arm.inertias, arm.gravity, arm.tool]
    parts = [0.01, middle, half_range, steps[0], steps[2], arm.alpha, *links]
    former = struct.pack("<I", 3) + b"".join(np.asarray(p, "<f8").tobytes() for p in parts)
    motion = ChainMotion(arm, DRIVE_LAWS["quadratic_b_spline"], middle, half_range, 0.01)
    now = encode_features(FeatureMap(motion))
    rest = now[4 + len(motion.parameters()) :]
    assert encode_features(decode_features(Reader(former + rest), 6)) == now


def test_damaged_files_of_version_4_are_refused() -> None:
    data = version_4_of(Surrogate.from_bytes(SMALL))
    for length in range(len(data) - 4):
        assert refused_or_read(with_checksum(data[:length])), length
    for damaged in single_byte_damages(data):
        refused_or_read(with_checksum(bytes(damaged)))


@pytest.mark.parametrize("tag", [b"WIND", b"SCIN"])
def test_sections_of_version_4_that_are_too_long_are_refused(tag: bytes) -> None:
    """A word that nobody reads is the sign of a damaged file, as it is in this version."""
    body = version_4_of(Surrogate.from_bytes(SMALL))[:-4]
    at = body.index(tag) + 4
    (length,) = struct.unpack_from("<I", body, at)
    end = at + 4 + length
    longer = body[:at] + struct.pack("<I", length + 4) + body[at + 4 : end] + bytes(4) + body[end:]
    with pytest.raises(PayloadError, match="4 bytes too many"):
        Surrogate.from_bytes(with_checksum(longer))


def test_file_of_version_5_has_no_forecast_and_its_inputs_are_held() -> None:
    shape = Shape(n_in=3, n_out=2, hold="first_order")
    data = dataclasses.replace(random_surrogate(shape), forecast=None).to_bytes()
    old = Surrogate.from_bytes(with_checksum(data[:8] + struct.pack("<I", 5) + data[12:-4]))
    assert old.forecast is None
    assert not old.inputs_at_step_end
    assert not old.planned
    assert old.to_bytes() == data
