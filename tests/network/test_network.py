"""Networks against a loop in plain Python, and against torch."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np
import pytest
import torch
from hypothesis import given
from torch.nn import functional

from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.network.state_space.bytes import NUMBERS
from slide_fmu.network.state_space.cell import CELL_ACTIVATIONS
from tests.fmu.plain import plain_features
from tests.fmu.samples import Shape, random_surrogate
from tests.refusals import refused
from tests.strategies import surrogate_shapes

ROUNDING = 1e-5
"""Sums of up to 30 float32 products of order 1, three layers deep."""

PLAIN: dict[str, Callable[[float], float]] = {
    "identity": lambda x: x,
    "relu": lambda x: x if x > 0 else 0.0,
    "elu": lambda x: x if x > 0 else math.exp(x) - 1.0,
    "tanh": math.tanh,
    "gelu": lambda x: 0.5 * x * (1 + math.tanh(math.sqrt(2 / math.pi) * (x + 0.044715 * x**3))),
    "cubic": lambda x: x**3,
}

TORCH: dict[str, Callable[[torch.Tensor], torch.Tensor]] = {
    "identity": lambda x: x,
    "relu": functional.relu,
    "elu": functional.elu,
    "tanh": torch.tanh,
    "gelu": lambda x: functional.gelu(x, approximate="tanh"),
    "cubic": lambda x: x**3,
}


def plain_evaluation(network: FeedForward, sequence: np.ndarray) -> list[float]:
    ages = network.ages or range(network.n_samples - 1, -1, -1)
    first = [float(value) for age in ages for value in sequence[-1 - age]]
    hidden = first
    for layer in network.layers:
        hidden = [
            PLAIN[layer.activation](
                sum(float(w) * x for w, x in zip(row, hidden, strict=True)) + float(bias)
            )
            for row, bias in zip(layer.weights, layer.bias, strict=True)
        ]
    if network.skip is None:
        return hidden
    extra = [sum(float(w) * x for w, x in zip(row, first, strict=True)) for row in network.skip]
    return [a + b for a, b in zip(hidden, extra, strict=True)]


@given(surrogate_shapes())
def test_evaluation_is_the_plain_loop(shape: Shape) -> None:
    network = random_surrogate(shape).network
    assert isinstance(network, FeedForward)
    batch = np.random.default_rng(shape.seed).normal(
        size=(3, network.n_samples, network.n_channels)
    )
    found = network.evaluate(batch)
    assert found.dtype == np.float32
    assert found.shape == (3, network.n_values)
    for row, sequence in zip(found, batch, strict=True):
        expected = plain_evaluation(network, plain_features(network.features, sequence))
        assert row == pytest.approx(expected, abs=ROUNDING, rel=ROUNDING)


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_activation_is_that_of_torch(name: str) -> None:
    values = np.linspace(-20, 20, 4001, dtype=np.float32)
    expected = TORCH[name](torch.from_numpy(values)).numpy()
    found = ACTIVATIONS[name].value(values, np)
    assert found == pytest.approx(expected, abs=1e-6, rel=1e-6)
    assert found.dtype == np.float32
    of_tensors = ACTIVATIONS[name].value(torch.from_numpy(values), torch)
    assert of_tensors.dtype == torch.float32
    assert of_tensors.numpy() == pytest.approx(expected, abs=1e-6, rel=1e-6)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("name", ACTIVATIONS)
def test_activation_slope_is_the_derivative_that_torch_finds(
    name: str, dtype: torch.dtype
) -> None:
    values = torch.linspace(-6, 6, 601, dtype=torch.float64).to(dtype).requires_grad_()
    (expected,) = torch.autograd.grad(TORCH[name](values).sum(), values)
    allowed = 1e-5 if dtype == torch.float32 else 1e-12
    activation, seen = ACTIVATIONS[name], values.detach()
    found = activation.slope(seen, activation.value(seen, torch), torch)
    torch.testing.assert_close(found, expected, rtol=allowed, atol=allowed)
    rows = seen.numpy()
    of_rows = activation.slope(rows, activation.value(rows, np), np)
    assert of_rows.dtype == rows.dtype
    assert of_rows == pytest.approx(expected.numpy(), rel=allowed, abs=allowed)


def test_activations_keep_their_numbers() -> None:
    """The payload stores their order."""
    assert list(ACTIVATIONS) == ["identity", "relu", "elu", "tanh", "gelu", "cubic"]


def test_numbers_of_hidden_units_of_cells_are_those_of_the_c_runtime() -> None:
    assert NUMBERS == {"tanh": 3, "cubic": 5, "gated": 6, "mixed": 7}
    assert tuple(NUMBERS) == CELL_ACTIVATIONS


def layer(n_in: int, n_out: int) -> Layer:
    return Layer(np.zeros((n_out, n_in), np.float32), np.zeros(n_out, np.float32), "relu")


ONE, TWO = FeatureMap(Differences(1)), FeatureMap(Differences(2))


def test_parameters_are_counted() -> None:
    skip = np.zeros((2, 6), np.float32)
    assert FeedForward((layer(6, 4), layer(4, 2)), 3, TWO).count_parameters() == 28 + 10
    assert FeedForward((layer(6, 4), layer(4, 2)), 3, TWO, skip).count_parameters() == 50


def test_sizes_that_do_not_fit_are_refused() -> None:
    with refused(ValueError, "without layers"):
        FeedForward((), 3, TWO)
    with refused(ValueError, "expected 6", "0 takes 5"):
        FeedForward((layer(5, 4),), 3, TWO)
    with refused(ValueError, "expected 4", "1 takes 3"):
        FeedForward((layer(6, 4), layer(3, 2)), 3, TWO)
    with refused(ValueError, "expected (4", "linear skip"):
        FeedForward((layer(6, 4),), 3, TWO, np.zeros((4, 5), np.float32))
    with refused(ValueError, "on 0 samples"):
        FeedForward((layer(0, 4),), 0, TWO)
    for ages in [(1, 0), (2, 2), (0, 2), (2, -1), (3, 0)]:
        with pytest.raises(ValueError, match=re.escape(f"ages {list(ages)}; expected them to")):
            FeedForward((layer(2 * len(ages), 4),), 3, TWO, ages=ages)
    with refused(ValueError, "expected 4", "0 takes 6"):
        FeedForward((layer(6, 4),), 3, TWO, ages=(2, 0))


def test_network_sees_the_samples_of_its_ages() -> None:
    """The same as one that sees all, with zero weights at the others."""
    weights = np.random.default_rng(0).normal(size=(4, 3, 2)).astype(np.float32)
    bias = np.ones(4, np.float32)
    whole = weights.copy()
    whole[:, 1] = 0
    every = FeedForward((Layer(whole.reshape(4, 6), bias, "tanh"),), 3, TWO)
    seen = Layer(weights[:, [0, 2]].reshape(4, 4), bias, "tanh")
    some = FeedForward((seen,), 3, TWO, ages=(2, 0))
    record = np.random.default_rng(1).normal(size=(2, 9, 2))
    assert np.array_equal(some.stream(record), every.stream(record))


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_weights_are_finite(value: float) -> None:
    bad, good = np.array([[value]], np.float32), np.ones((1, 1), np.float32)
    with refused(ValueError, "not finite"):
        Layer(bad, np.zeros(1, np.float32), "relu")
    with refused(ValueError, "not finite"):
        Layer(good, bad[0], "relu")
    with refused(ValueError, "skip", "not finite"):
        FeedForward((layer(1, 1),), 1, ONE, bad)


def test_layer_needs_a_known_activation_and_fitting_bias() -> None:
    weights = np.zeros((2, 3), np.float32)
    with refused(ValueError, "'sigmoid'; expected one of"):
        Layer(weights, np.zeros(2, np.float32), "sigmoid")
    with refused(ValueError, "bias of shape (3,)"):
        Layer(weights, np.zeros(3, np.float32), "relu")
