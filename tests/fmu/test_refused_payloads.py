"""Surrogate files that the library refuses, as Python does."""

from __future__ import annotations

import copy
import dataclasses
import math
import struct
import zlib

import pytest

from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.payload import VERSION, PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import forecasting
from tests.fmu.native import ExportedFmu, Load
from tests.fmu.samples import CellShape, Shape, random_surrogate, sum_surrogate


def refused(loaded: ExportedFmu, content: bytes) -> str:
    """What the library says about a surrogate file; Python must refuse it, too."""
    with pytest.raises(PayloadError):
        Surrogate.from_bytes(content)
    (loaded.folder / "resources" / "surrogate.slide").write_bytes(content)
    native = loaded.instance()
    assert not native.component.value
    assert len(native.messages) == 1
    return native.messages[0]


def with_checksum(body: bytes) -> bytes:
    return body + struct.pack("<I", zlib.crc32(body))


def edited(surrogate: Surrogate, section: bytes, place: int, kind: str, value: float) -> bytes:
    """The surrogate's file with another number at a place in a section.

    Places below 0 count from the section's end.
    """
    body = bytearray(surrogate.to_bytes()[:-4])
    if place < 0:
        place += int.from_bytes(body[body.index(section) + 4 :][:4], "little")
    struct.pack_into(kind, body, body.index(section) + 8 + place, value)
    return with_checksum(bytes(body))


def _with_estimator(surrogate: Surrogate, **changes: object) -> bytes:
    """A surrogate file whose estimator was never checked."""
    assert surrogate.estimator is not None
    changed = copy.copy(surrogate)
    estimator = dataclasses.replace(surrogate.estimator, **changes)  # type: ignore[arg-type]
    object.__setattr__(changed, "estimator", estimator)
    return changed.to_bytes()


def test_estimators_of_another_family_are_refused(load: Load) -> None:
    surrogate = random_surrogate(Shape(positions=2, cell=CellShape()))
    message = refused(load(surrogate), _with_estimator(surrogate, network=surrogate.network))
    assert "estimator is a network of kind 2; expected 1 (feed-forward)" in message


def test_library_refuses_a_file_of_another_version_and_says_how_to_get_one(load: Load) -> None:
    loaded = load(sum_surrogate())
    content = loaded.surrogate.to_bytes()
    old = with_checksum(content[:8] + struct.pack("<I", VERSION - 1) + content[12:-4])
    (loaded.folder / "resources" / "surrogate.slide").write_bytes(old)
    native = loaded.instance()
    assert not native.component.value
    expected = f"of version {VERSION - 1}; expected version {VERSION}: make the FMU again with"
    assert expected in native.messages[0]


@pytest.mark.parametrize("positions", [0, (1 << 20) + 1, 0xFFFFFFFF])
def test_positions_out_of_range_are_refused(load: Load, positions: int) -> None:
    surrogate = random_surrogate(Shape(positions=2))
    content = _with_estimator(surrogate, positions=positions)
    assert f"at {positions} positions; expected" in refused(load(surrogate), content)


@pytest.mark.parametrize(
    "ages", [(10, 7, 3), (11, 7, 7), (11, 3, 7), (11, 7, 12), (11, 7, 0xFFFFFFFF)], ids=str
)
def test_ages_that_do_not_fall_are_refused(load: Load, ages: tuple[int, ...]) -> None:
    surrogate = random_surrogate(Shape(n_in=12, ages=3))
    network, content = surrogate.network, surrogate.to_bytes()
    assert isinstance(network, FeedForward)
    right, wrong = (struct.pack("<4I", 3, *row) for row in (network.ages, ages))
    assert content.count(right) == 1
    message = refused(load(surrogate), with_checksum(content.replace(right, wrong)[:-4]))
    assert "surrogate file: " in message
    assert "age" in message


def test_instantiation_with_a_wrong_guid_or_payload_is_refused(rich: ExportedFmu) -> None:
    assert not rich.instance(guid="other").component.value
    assert "GUID other; expected slide-" in rich.instances[-1].messages[0]
    payload = rich.folder / "resources" / "surrogate.slide"
    payload.write_bytes(payload.read_bytes()[:-5])
    native = rich.instance()
    assert not native.component.value
    assert "checksum" in native.messages[0]
    payload.unlink()
    assert "cannot read" in rich.instance().messages[0]


def test_inertia_that_is_not_symmetric_is_refused(load: Load) -> None:
    surrogate = random_surrogate(Shape(n_inputs=2, features="chain", cell=CellShape()))
    network, content = surrogate.network, surrogate.to_bytes()
    assert isinstance(network, StateSpace)
    assert isinstance(network.features.features, ChainMotion)
    right = network.features.features.chain.inertias[1]
    wrong = right.copy()
    wrong[0, 2] *= 1 + 1e-6
    assert content.count(right.tobytes()) == 1
    body = content.replace(right.tobytes(), wrong.tobytes())[:-4]
    message = refused(load(surrogate), with_checksum(body))
    assert "surrogate file: inertia of link 1 of a chain; expected a symmetric tensor" in message


@pytest.mark.parametrize(
    ("section", "place", "kind", "value", "said"),
    [
        *(
            (b"MOVE", place, "<I", value, "a forecast by ")
            for place, values in {
                0: (16,),
                4: (9, 0xFFFFFFFF),
                8: (0, 9, 0xFFFFFFFF),
                12: (0, 65),
            }.items()
            for value in values
        ),
        (b"MOVE", 16, "<d", -1.0, "surrogate file"),
        (b"MOVE", 16, "<d", math.nan, "surrogate file"),
        (b"MOVE", 16 + 8 * 3, "<d", math.inf, "surrogate file"),
        (b"SCIN", 24, "<I", 0, "of inputs with a first-order hold"),
    ],
)
def test_impossible_forecast_is_refused(
    load: Load, section: bytes, place: int, kind: str, value: float, said: str
) -> None:
    surrogate = forecasting(sum_surrogate(hold="first_order"))
    assert said in refused(load(surrogate), edited(surrogate, section, place, kind, value))
