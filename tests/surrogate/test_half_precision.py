"""Rounding weights to float16: what is rounded, what it costs, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from slide_fmu.cli import app
from slide_fmu.cosim.check import check_fmu
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.network.feed_forward import FeedForward, Layer, rounded_to_half
from slide_fmu.surrogate.half_precision import rounding_loss, with_weights
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.libraries import build_libraries

LAYERS = Shape(n_inputs=2, n_outputs=2, hidden=(40,), activation="elu", skip=True, positions=2)


def test_halves_take_half_the_bytes_and_come_back() -> None:
    surrogate = random_surrogate(LAYERS)
    rounded = with_weights(surrogate, "float16")
    assert len(rounded.to_bytes()) < 0.7 * len(surrogate.to_bytes())
    again = Surrogate.from_bytes(rounded.to_bytes())
    assert isinstance(again.network, FeedForward)
    assert again.network.half
    record = np.random.default_rng(0).uniform(-2, 3, (50, 2))
    np.testing.assert_array_equal(again.predict(record), rounded.predict(record))
    widened = with_weights(rounded, "float32")
    np.testing.assert_array_equal(widened.predict(record), rounded.predict(record))
    assert len(widened.to_bytes()) == len(surrogate.to_bytes())


def test_loss_is_that_of_half_precision() -> None:
    surrogate = random_surrogate(LAYERS)
    loss = rounding_loss(surrogate, with_weights(surrogate, "float16"))
    for output in loss["outputs"]:
        assert 1e-5 < output["relative_rms_change"] < 2e-3
    assert loss["predictor_rounded"]
    assert loss["estimator_rounded"]
    assert 0 < loss["relative_estimate_change"] < 1e-2


def test_cells_stay_as_they_are() -> None:
    surrogate = random_surrogate(Shape(cell=CellShape(), positions=2))
    rounded = with_weights(surrogate, "float16")
    loss = rounding_loss(surrogate, rounded)
    assert rounded.network is surrogate.network
    assert not loss["predictor_rounded"]
    assert loss["outputs"][0]["rms_change"] == 0
    assert loss["estimator_rounded"]


def test_unknown_precisions_and_large_weights_are_refused() -> None:
    with pytest.raises(ValueError, match="float16"):
        with_weights(random_surrogate(Shape()), "bfloat16")
    with pytest.raises(ValueError, match="at most 65504"):
        rounded_to_half(np.float32([[1.0, -7e4]]))


def test_weights_that_are_no_halves_are_refused() -> None:
    network = random_surrogate(Shape()).network
    assert isinstance(network, FeedForward)
    layers = tuple(Layer(y.weights + np.float32(1e-5), y.bias, "relu") for y in network.layers)
    with pytest.raises(ValueError, match="round it"):
        FeedForward(layers, network.n_samples, network.features, half=True)


def test_export_says_what_rounding_costs(tmp_path: Path) -> None:
    build_libraries()
    source = export_fmu(random_surrogate(LAYERS), tmp_path / "source.fmu")
    target = tmp_path / "half.fmu"
    arguments = ["export", str(source), "--weights", "float16", "-o", str(target), "--json", "-"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["rounding"]["outputs"][0]["relative_rms_change"] > 0
    assert "y0 changes by" in result.stderr
    surrogate, _ = read_fmu(target)
    assert isinstance(surrogate.network, FeedForward)
    assert surrogate.network.half
    assert check_fmu(target) == []


def test_export_refuses_other_precisions(tmp_path: Path) -> None:
    build_libraries()
    source = export_fmu(random_surrogate(LAYERS), tmp_path / "source.fmu")
    arguments = ["export", str(source), "--weights", "int8", "-o", str(tmp_path / "x.fmu")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 1
    assert "float32" in result.stderr
