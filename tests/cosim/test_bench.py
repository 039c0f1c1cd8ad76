"""The verb ``bench``: its keys, on both families; what is missing is None with a remark."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from slide_fmu.cli import app
from slide_fmu.cosim.rivals import RivalError, onnx_layers, torch_layers
from slide_fmu.cosim.synthetic import synthetic_surrogate
from slide_fmu.features.differences import Differences
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.build import build_all
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.network.feed_forward import FeedForward
from tests.fmu.samples import CellShape, Shape, random_surrogate

TIMES = ("fmu_step", "fmu_set_step_get", "numpy", "pythonfmu_set_step_get")
RIVALS = ("torch", "onnxruntime")
LITTLE = ["--rounds", "1", "--steps", "3", "--json", "-"]


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_all()


def _bench(path: Path) -> dict[str, object]:
    result = CliRunner().invoke(app, ["bench", str(path), *LITTLE])
    assert result.exit_code == 0, result.output
    return dict(json.loads(result.stdout))


@pytest.mark.parametrize(
    ("shape", "fmi"),
    [
        (Shape(activation="elu", n_inputs=2, positions=2, skip=True), 2),
        (Shape(cell=CellShape()), 2),
        (Shape(cell=CellShape()), 3),
    ],
    ids=["layers", "cells", "FMI 3.0"],
)
def test_keys(tmp_path: Path, shape: Shape, fmi: FmiVersion) -> None:
    figures = _bench(export_fmu(random_surrogate(shape), tmp_path / "tiny.fmu", fmi=fmi))
    for name in TIMES:
        assert isinstance(figures[name], float), name
        assert figures[name] > 0, name
    batch, remarks = figures["batch"], figures["remarks"]
    assert isinstance(batch, dict)
    assert isinstance(remarks, dict)
    assert batch["native"] > 0
    for name in RIVALS:
        assert (figures[name] is None) == (name in remarks), name
        assert name in batch


def test_missing_rivals_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("torch", "onnx", "onnxruntime"):
        monkeypatch.setitem(sys.modules, name, None)
    figures = _bench(export_fmu(random_surrogate(Shape()), tmp_path / "tiny.fmu"))
    assert [figures[name] for name in RIVALS] == [None, None]
    remarks = figures["remarks"]
    assert isinstance(remarks, dict)
    assert set(remarks) == set(RIVALS)


@pytest.mark.parametrize("make", [torch_layers, onnx_layers])
@pytest.mark.parametrize("activation", ["identity", "relu", "elu", "tanh"])
def test_rivals_evaluate_the_same_network(make: object, activation: str) -> None:
    pytest.importorskip("torch" if make is torch_layers else "onnxruntime")
    network = random_surrogate(Shape(activation=activation, skip=True, hidden=(7, 5))).network
    assert isinstance(network, FeedForward)
    features = np.random.default_rng(1).normal(size=(9, network.n_samples, 1)).astype(np.float32)
    found = make(network)(features.reshape(9, -1))  # type: ignore[operator]
    np.testing.assert_allclose(found, network.evaluate_features(features), atol=1e-5)


def test_rivals_refuse_what_they_do_not_know() -> None:
    pytest.importorskip("torch")
    network = random_surrogate(Shape(activation="cubic")).network
    assert isinstance(network, FeedForward)
    with pytest.raises(RivalError, match="cubic"):
        torch_layers(network)


def test_synthetic_robot_has_the_size_of_three_networks() -> None:
    network = synthetic_surrogate("robot").network
    assert isinstance(network, FeedForward)
    assert isinstance(network.features.features, Differences)
    three = 3 * (720 * 180 + 2 * 180 * 180 + 180 * 60)
    found = sum(layer.weights.size for layer in network.layers)
    assert found == pytest.approx(three, rel=0.01)


@pytest.mark.parametrize("arguments", [[], ["x.fmu", "--synthetic", "robot"]])
def test_either_an_fmu_or_a_synthetic_network(arguments: list[str]) -> None:
    result = CliRunner().invoke(app, ["bench", *arguments])
    assert result.exit_code == 1
    assert "either" in result.stderr


def test_unknown_synthetic_network_is_refused() -> None:
    result = CliRunner().invoke(app, ["bench", "--synthetic", "crane"])
    assert result.exit_code == 1
    assert "robot" in result.stderr
