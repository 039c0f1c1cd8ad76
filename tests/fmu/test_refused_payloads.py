"""Surrogate files that the library refuses, as Python does."""

from __future__ import annotations

import copy
import dataclasses
import struct
import zlib

import pytest

from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.payload import VERSION, PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import forecasting
from tests.fmu.native import Load, Loaded
from tests.fmu.samples import CellShape, Shape, random_surrogate, sum_surrogate


def refused(loaded: Loaded, content: bytes) -> str:
    """What the library says about a surrogate file; Python must refuse it, too."""
    with pytest.raises(PayloadError):
        Surrogate.from_bytes(content)
    (loaded.folder / "resources" / "surrogate.slide").write_bytes(content)
    native = loaded.instance()
    assert not native.component.value
    assert len(native.messages) == 1
    return native.messages[0]


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
    body = content[:8] + struct.pack("<I", VERSION - 1) + content[12:-4]
    old = body + struct.pack("<I", zlib.crc32(body))
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
    body = content.replace(right, wrong)[:-4]
    message = refused(load(surrogate), body + struct.pack("<I", zlib.crc32(body)))
    assert "surrogate file: " in message
    assert "age" in message


def test_instantiation_with_a_wrong_guid_or_payload_is_refused(rich: Loaded) -> None:
    assert not rich.instance(guid="other").component.value
    assert "GUID other; expected slide-" in rich.instances[-1].messages[0]
    payload = rich.folder / "resources" / "surrogate.slide"
    payload.write_bytes(payload.read_bytes()[:-5])
    native = rich.instance()
    assert not native.component.value
    assert "checksum" in native.messages[0]
    payload.unlink()
    assert "cannot read" in rich.instance().messages[0]


def test_inertia_that_is_not_symmetric_isrefused(load: Load) -> None:
    surrogate = random_surrogate(Shape(n_inputs=2, features="chain", cell=CellShape()))
    network, content = surrogate.network, surrogate.to_bytes()
    assert isinstance(network, StateSpace)
    assert isinstance(network.features.features, ChainMotion)
    right = network.features.features.chain.inertias[1]
    wrong = right.copy()
    wrong[0, 2] *= 1 + 1e-6
    assert content.count(right.tobytes()) == 1
    body = content.replace(right.tobytes(), wrong.tobytes())[:-4]
    message = refused(load(surrogate), body + struct.pack("<I", zlib.crc32(body)))
    assert "surrogate file: inertia of link 1 of a chain; expected a symmetric tensor" in message


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, 16), (4, 9), (4, 0xFFFFFFFF), (8, 0), (8, 9), (8, 0xFFFFFFFF), (12, 0), (12, 65)],
)
def test_forecasts_of_impossible_sizes_are_refused(load: Load, place: int, value: int) -> None:
    surrogate = forecasting(sum_surrogate(hold="first_order"))
    body = bytearray(surrogate.to_bytes()[:-4])
    struct.pack_into("<I", body, body.index(b"MOVE") + 8 + place, value)
    message = refused(load(surrogate), bytes(body) + struct.pack("<I", zlib.crc32(body)))
    assert "surrogate file: a forecast by " in message


@pytest.mark.parametrize(("place", "value"), [(0, -1.0), (0, float("nan")), (3, float("inf"))])
def test_forecasts_with_impossible_numbers_are_refused(
    load: Load, place: int, value: float
) -> None:
    surrogate = forecasting(sum_surrogate(hold="first_order"))
    body = bytearray(surrogate.to_bytes()[:-4])
    struct.pack_into("<d", body, body.index(b"MOVE") + 24 + 8 * place, value)
    message = refused(load(surrogate), bytes(body) + struct.pack("<I", zlib.crc32(body)))
    assert "surrogate file" in message


def test_forecast_of_inputs_that_are_held_isrefused(load: Load) -> None:
    surrogate = forecasting(sum_surrogate(hold="first_order"))
    body = bytearray(surrogate.to_bytes()[:-4])
    struct.pack_into("<I", body, body.index(b"SCIN") + 8 + 24, 0)
    message = refused(load(surrogate), bytes(body) + struct.pack("<I", zlib.crc32(body)))
    assert "of inputs with a first-order hold" in message
