"""The baselines evaluate the same networks; what is missing is None with a remark."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from baselines import BaselineError
from baselines.cells import TorchCells
from baselines.layers import Evaluation, onnx_layers, torch_layers
from baselines.numpy_fmu import write_numpy_fmu

from slide_fmu.cosim.run import run_fmu, unpacked
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.build import build_all
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.marks import needs_app
from tests.refusals import refused

pytestmark = pytest.mark.extended

TIMES = (
    *("fmu_step", "fmu_set_step_get", "runtime_step", "kernel", "memory_bound"),
    *("pythonfmu_step", "pythonfmu_set_step_get", "read_gb_per_s"),
)
OTHERS = ("torch", "onnxruntime")
ROUNDING = 1e-5
"""Float32 sums of some ten terms of order 1."""


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_all()


def compared(fmu: Path) -> dict[str, Any]:
    """Return the figures of a short comparison."""
    from comparison import compare_fmu

    from slide_fmu.apps.bench.effort import Effort

    return compare_fmu(fmu, Effort(rounds=1, steps=3, windows=20))


@needs_app("bench")
@pytest.mark.parametrize(
    "shape",
    [
        Shape(activation="elu", n_inputs=2, positions=2, skip=True),
        Shape(cell=CellShape()),
        Shape(n_inputs=2, features="director", cell=CellShape(4, 5, "gated", turned=1, factors=1)),
    ],
    ids=["layers", "cells", "gated"],
)
def test_comparison_times_everything_that_is_there(tmp_path: Path, shape: Shape) -> None:
    figures = compared(export_fmu(random_surrogate(shape), tmp_path / "tiny.fmu"))
    for name in TIMES:
        assert figures[name] > 0, name
    assert figures["batch"]["native"] > 0
    for name in OTHERS:
        assert (figures[name] is None) == (name in figures["remarks"]), name
        assert name in figures["batch"]


@needs_app("bench")
def test_comparison_of_a_surrogate_whose_bound_gives_its_error_estimate(tmp_path: Path) -> None:
    """Its PythonFMU has none."""
    surrogate = with_span(bounded_surrogate(Shape(cell=CellShape())))
    figures = compared(export_fmu(surrogate, tmp_path / "tiny.fmu"))
    assert figures["pythonfmu_set_step_get"] > 0


@needs_app("bench")
def test_missing_packages_are_none_with_a_remark(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("torch", "onnx", "onnxruntime"):
        monkeypatch.setitem(sys.modules, name, None)
    figures = compared(export_fmu(random_surrogate(Shape()), tmp_path / "tiny.fmu"))
    assert [figures[name] for name in OTHERS] == [None, None]
    assert set(figures["remarks"]) == set(OTHERS)


@pytest.mark.parametrize("make", [torch_layers, onnx_layers])
@pytest.mark.parametrize("activation", ["identity", "relu", "elu", "tanh"])
def test_layers_are_those_of_the_network(
    make: Callable[[FeedForward], Evaluation], activation: str
) -> None:
    pytest.importorskip("torch" if make is torch_layers else "onnxruntime")
    network = random_surrogate(Shape(activation=activation, skip=True, hidden=(7, 5))).network
    assert isinstance(network, FeedForward)
    features = np.random.default_rng(1).normal(size=(9, network.n_samples, 1)).astype(np.float32)
    found = make(network)(features.reshape(9, -1))
    np.testing.assert_allclose(found, network.evaluate_features(features), atol=ROUNDING)


def test_unknown_units_are_refused() -> None:
    pytest.importorskip("torch")
    network = random_surrogate(Shape(activation="cubic")).network
    assert isinstance(network, FeedForward)
    with refused(BaselineError, "cubic"):
        torch_layers(network)


@pytest.mark.parametrize("activation", ["tanh", "cubic"])
def test_torch_cells_are_those_of_the_network(activation: str) -> None:
    pytest.importorskip("torch")
    network = random_surrogate(Shape(n_in=6, n_out=2, cell=CellShape(3, 4, activation))).network
    assert isinstance(network, StateSpace)
    record = np.random.default_rng(0).normal(size=(8 * network.n_samples, 1))
    cells, expected = TorchCells(network), network.stream(record[None])[0]
    for row in held_before(record, network.n_samples):
        cells.step(row)
    for row, values in zip(record, expected, strict=True):
        np.testing.assert_allclose(cells.step(row), values, atol=ROUNDING)


def held_before(record: np.ndarray, n_samples: int) -> np.ndarray:
    """What baselines, which begin from zero, take first to be where the others begin."""
    return np.repeat(record[:1], 2 * n_samples - 1, axis=0)


@pytest.mark.parametrize(
    "shape",
    [
        Shape(n_in=5, n_out=2, n_inputs=2, differences=1, activation="elu", skip=True),
        Shape(n_in=6, n_out=2, cell=CellShape(3, 4)),
        Shape(
            n_in=6,
            n_out=2,
            n_inputs=2,
            features="director",
            cell=CellShape(4, 5, "gated", turned=1, factors=1),
        ),
    ],
    ids=["layers", "cells", "gated"],
)
def test_numpy_fmu_gives_the_outputs_of_the_surrogate(tmp_path: Path, shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    rng, n_in = np.random.default_rng(0), surrogate.window.n_in
    record = rng.uniform(0.2, 0.9, (6 * n_in, shape.n_inputs))
    lead = held_before(record, n_in)
    whole = np.concatenate([lead, record])
    inputs = {signal.name: whole[:, k] for k, signal in enumerate(surrogate.inputs)}
    names = [signal.name for signal in surrogate.outputs]
    with unpacked(write_numpy_fmu(surrogate, tmp_path)) as fmu:
        found = run_fmu(fmu, inputs, names, step=surrogate.window.step).values
    expected = surrogate.predict_newest(record)
    np.testing.assert_allclose(found[len(lead) + 1 :], expected, atol=10 * ROUNDING)
