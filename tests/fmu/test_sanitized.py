"""The C runtime under address and undefined-behaviour sanitizers; its reader under damage."""

from __future__ import annotations

import struct
import subprocess
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.features.base import BEFORE
from slide_fmu.network.state_space.cell import in_double
from slide_fmu.network.state_space.equations import ByRole, Equations
from slide_fmu.network.state_space.initial_state import initial_state
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.driver import build_driver, required_sanitizer
from tests.fmu.native import Load
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.fmu.small_shapes import (
    BOUNDED,
    CELLS,
    DIRECTOR,
    GATED,
    JUMPING,
    MOVING,
    ONE_SAMPLE,
    PARAMETRIC,
    RAMP,
    ROLES,
    SMALL,
    SPANNED,
    small_surrogate,
)
from tests.limits import HANGS

pytestmark = pytest.mark.extended

TELLING = [0, 1, 2, 3, 0x7F, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000, 0x40000000, 1 << 20]
"""Words that hurt readers: off by one, signs, NaN, infinity, sizes that overflow."""


ALL_UNTIL, SHARE = 400, 0.3
"""Every word of the first bytes is damaged, and this part of those after them, drawn at random."""


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("driver")
    compiler = required_sanitizer(folder)
    return build_driver(*compiler, folder / "driver")


def _run(driver: Path, *arguments: str) -> list[str]:
    result = subprocess.run(
        [driver, *arguments], capture_output=True, text=True, check=False, timeout=HANGS
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.splitlines()


def _sealed(body: bytes) -> bytes:
    """With a checksum that fits, so that the damage gets past it."""
    return body + struct.pack("<I", zlib.crc32(body))


def _damaged(data: bytes, rng: np.random.Generator) -> Iterator[bytes]:
    body = data[:-4]
    yield data
    yield from (data[:length] for length in (0, 7, 11, 15, 16, 40, len(data) - 1))
    yield data + b"more"
    yield bytes([data[0] ^ 1]) + data[1:]
    for length in rng.integers(12, len(body), 40):
        yield _sealed(body[:length])
    words = np.arange(8, len(body) - 3, 4)
    for position in words[(words < ALL_UNTIL) | (rng.random(len(words)) < SHARE)]:
        word = struct.pack("<I", TELLING[rng.integers(len(TELLING))])
        yield _sealed(body[:position] + word + body[position + 4 :])
    for position in rng.integers(8, len(body), 200):
        changed = bytearray(body)
        changed[position] ^= 1 << int(rng.integers(8))
        yield _sealed(bytes(changed))
    for start, length in zip(
        rng.integers(12, len(body), 40), rng.integers(1, 60, 40), strict=True
    ):
        yield _sealed(body[:start] + body[start + length :])
        yield _sealed(body[: start + length] + body[start:])


OF_METADATA = ("utf-8", "metadata", "surrogate name", "of an angle in the ranges")
"""What Python says of names and ranges of signals."""


def _python_accepts(data: bytes) -> bool | None:
    """None when it is the metadata that is bad: the C reader skips it."""
    try:
        Surrogate.from_bytes(data)
    except PayloadError as error:
        return None if any(word in str(error) for word in OF_METADATA) else False
    return True


@pytest.mark.parametrize(
    "shape",
    [SMALL, ONE_SAMPLE, CELLS, MOVING, GATED, DIRECTOR, ROLES, PARAMETRIC, BOUNDED, SPANNED],
)
def test_damaged_payloads_are_read_within_their_arrays(
    driver: Path, tmp_path: Path, shape: Shape
) -> None:
    rng = np.random.default_rng(5)
    contents = list(_damaged(small_surrogate(shape).to_bytes(), rng))
    paths = [tmp_path / str(index) for index in range(len(contents))]
    for path, content in zip(paths, contents, strict=True):
        path.write_bytes(content)
    lines = _run(driver, "read", *map(str, paths))
    verdicts = [line == "ok" for line in lines]
    for line, verdict, content in zip(lines, verdicts, contents, strict=True):
        assert _python_accepts(content) in (verdict, None), (line, content)
    assert 20 < verdicts.count(False) < len(verdicts) - 20
    assert all(line == "ok" or "surrogate file" in line for line in lines)


def test_every_kernel_of_this_processor_is_accurate(driver: Path) -> None:
    """Largest absolute and relative errors; gelu cancels, relative to small results."""
    bounds = {
        "affine": (1e-6, 1e-6),
        "gelu": (5e-7, np.inf),
        "cell": (1e-6, np.inf),
        "gated": (1e-6, np.inf),
    }
    for line in _run(driver, "kernels"):
        kernel, what, error, relative, special = line.split()
        absolute_bound, relative_bound = bounds.get(what, (1.5e-7, 3e-7))
        assert float(error) < absolute_bound, (kernel, what)
        assert float(relative) < relative_bound, (kernel, what)
        assert special == "1", (kernel, what)


@pytest.mark.parametrize(
    "shape", [SMALL, CELLS, GATED, MOVING, PARAMETRIC, BOUNDED, SPANNED, JUMPING]
)
def test_sequences_of_calls_stay_in_their_arrays(driver: Path, load: Load, shape: Shape) -> None:
    loaded = load(small_surrogate(shape))
    _run(driver, "calls", loaded.uri, loaded.guid)
    assert len(_run(driver, "run", loaded.uri, loaded.guid, "10")) == 10


@pytest.mark.parametrize(
    "shape", [SMALL, CELLS, RAMP, GATED, DIRECTOR, PARAMETRIC, BOUNDED, SPANNED, JUMPING]
)
def test_damaged_states_stay_in_their_arrays(driver: Path, load: Load, shape: Shape) -> None:
    loaded = load(small_surrogate(shape))
    _run(driver, "damage", loaded.uri, loaded.guid)


@pytest.mark.parametrize("shape", [SMALL, CELLS, RAMP, GATED, DIRECTOR])
def test_adjoint_derivatives_are_the_transposed_directional_ones(
    driver: Path, load: Load, shape: Shape
) -> None:
    """They are the transposed directional ones, before the first step and after each."""
    loaded = load(random_surrogate(shape))
    sizes = (str(shape.n_inputs), str(shape.n_outputs))
    lines = _run(driver, "adjoint", loaded.uri, loaded.guid, "10", *sizes)
    assert len(lines) == 11
    for line in lines:
        worst, largest = map(float, line.split())
        assert worst <= 1e-12 * largest
        assert largest > 1e-6


@pytest.mark.parametrize("differences", [0, 2])
@pytest.mark.parametrize("units", ["tanh", "gated"])
def test_three_ways_to_evaluate_a_window_give_what_numpy_gives(
    driver: Path, tmp_path: Path, differences: int, units: str
) -> None:
    """In the network's units. What two of them lost may add up, and differs from time to time."""
    turned = 2 if units == "gated" else 0
    cell = CellShape(states=5, units=9, activation=units, contraction=0.8, turned=turned)
    shape = Shape(n_in=20, n_out=6, differences=differences, cell=cell)
    surrogate = random_surrogate(shape)
    network, path = surrogate.network, tmp_path / "cell.slide"
    assert isinstance(network, StateSpace)
    surrogate.save(path)
    lines = _run(driver, "three", str(path), "400")
    exact, recursive, ping_pong = np.array([line.split() for line in lines], dtype=float).T
    record = surrogate.input_scaling.apply(np.sin(0.7 * np.arange(400))[:, None] + 0.5)
    lead = network.n_samples + 1
    padded = np.concatenate([np.repeat(record[:1], lead, axis=0), record])
    seen = network.features.along(padded[None])[0]
    endless, _ = network.run(seen[None, 2:])
    features = np.lib.stride_tricks.sliding_window_view(seen, 20, 0)
    windows, _ = network.run(np.ascontiguousarray(np.moveaxis(features, -1, 1)))
    values, errors = network.ping_pong(record[None])
    for found, expected in (
        (exact, windows[2:, -1, 0]),
        (recursive, endless[0, lead - 2 :, 0]),
        (ping_pong, values[0, :, 0]),
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=OUTPUT_TOLERANCE * 2)
    largest = 3 * np.max(errors)
    for one, other in ((exact, recursive), (exact, ping_pong), (recursive, ping_pong)):
        assert 1e-4 < np.max(np.abs(one - other)) < largest


STEADY = CellShape(contraction=0.97)
OF_SEARCHES = 1e-8
"""Of the largest number of a state. The search of scipy ends where the squared error no longer
changes in double precision: there, the state has half of its digits. The runtime goes on."""


@pytest.mark.parametrize(
    ("shape", "cell"),
    [
        (Shape(), replace(STEADY, units=0)),
        (Shape(n_outputs=3), replace(STEADY, states=9, units=7)),
        (Shape(n_inputs=2, n_outputs=2, differences=2), STEADY),
        (Shape(n_inputs=2, n_outputs=2), replace(STEADY, activation="gated")),
        (
            Shape(n_inputs=3, n_outputs=2, features="director"),
            replace(STEADY, states=9, activation="gated", turned=2, factors=2),
        ),
        (Shape(n_inputs=2, n_outputs=2), replace(STEADY, activation="mixed", substeps=3)),
    ],
    ids=["linear", "three_outputs", "differences", "gated", "turned", "substeps"],
)
def test_state_that_outputs_show_is_that_of_numpy_in_double_precision(
    driver: Path, tmp_path: Path, shape: Shape, cell: CellShape
) -> None:
    count, rng = 20, np.random.default_rng(3)
    surrogate = random_surrogate(replace(shape, n_in=24, n_out=8, cell=cell))
    network, path = surrogate.network, tmp_path / "cell.slide"
    assert isinstance(network, StateSpace)
    surrogate.save(path)
    inputs = rng.uniform(-1, 1, (60, shape.n_inputs))
    values, _ = network.run(network.features.along(inputs[None]))
    known = values[0, -count:] + 1e-2 * rng.standard_normal((count, shape.n_outputs))
    known[rng.random(known.shape) < 0.3] = np.nan
    known[0] = np.nan
    seen = np.concatenate([np.repeat(inputs[-count:][:1], BEFORE, axis=0), inputs[-count:]])
    numbers = np.concatenate([seen[::-1].ravel(), known.astype(np.float64).ravel()])
    numbers.tofile(tmp_path / "numbers")
    lines = _run(driver, "first", str(path), str(tmp_path / "numbers"), str(count))
    features = network.features.exactly_along(inputs[None, -count:])[0]
    state = initial_state(network, features, known)
    first = ByRole.of(network.roles, features[:1, None])
    [[after]] = Equations(in_double(network.cell), first, network.turned, np).run(state[None])
    size = np.max(np.abs(after))
    assert size > 0.1
    np.testing.assert_allclose(np.array(lines, float), after, rtol=0, atol=OF_SEARCHES * size)
