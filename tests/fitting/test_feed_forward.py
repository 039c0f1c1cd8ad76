"""The trainable network is the frozen one, and begins as the paper says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.core.scaling import Affine
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import COSINE, SINE, Director
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feed_forward import FeedForwardModule
from slide_fmu.fitting.feed_forward import activation as activation_of
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.recipe.learning import FeedForwardRecipe
from tests.refusals import refused

SAMPLES, CHANNELS, VALUES = 20, 2, 6

CRANK = Director((COSINE, SINE), Affine(np.zeros(2), np.ones(2)))
INPUTS = FeatureMap(Differences(CHANNELS))
"""Features that are the inputs."""

TORCH_IS_NUMPY = 2e-6
"""Of the output's range; the bound of the project for torch = numpy = C = FMU."""


def module_of(seed: int = 0, features: FeatureMap = INPUTS, **table: Any) -> FeedForwardModule:
    recipe = FeedForwardRecipe.model_validate({"family": "feed_forward", "hidden": (16,), **table})
    module = FeedForwardModule(recipe, SAMPLES, features, VALUES)
    module.initialise(torch.Generator().manual_seed(seed))
    return module


def windows(count: int) -> torch.Tensor:
    shape = (count, SAMPLES, CHANNELS)
    return 2 * torch.rand(shape, generator=torch.Generator().manual_seed(1)) - 1


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_activation_and_its_derivative_are_those_of_the_shared_table(name: str) -> None:
    values = torch.linspace(-4, 4, 81, dtype=torch.float64).requires_grad_()
    found = activation_of(name)(values)
    (slope,) = torch.autograd.grad(found.sum(), values)
    activation, seen = ACTIVATIONS[name], values.detach()
    expected = activation.value(seen, torch)
    torch.testing.assert_close(found.detach(), expected, rtol=1e-12, atol=1e-12)
    torch.testing.assert_close(
        slope, activation.slope(seen, expected, torch), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("hidden", [(), (16,), (32, 24, 16)])
@pytest.mark.parametrize("linear_skip", [True, False])
def test_frozen_network_is_the_module(
    activation: str, hidden: tuple[int, ...], linear_skip: bool
) -> None:
    module = module_of(activation=activation, hidden=hidden, linear_skip=linear_skip)
    generator = torch.Generator().manual_seed(2)
    for linear in module.linear:  # biases begin with zeros
        torch.nn.init.uniform_(linear.bias, -0.5, 0.5, generator=generator)
    inputs = windows(200)
    with torch.no_grad():
        expected = module(inputs).numpy()
    network = module.freeze()
    found = network.evaluate(inputs.numpy())
    assert np.max(np.abs(found - expected)) <= TORCH_IS_NUMPY * np.ptp(expected)
    assert network.count_parameters() == sum(p.numel() for p in module.parameters())


@pytest.mark.parametrize(
    "features",
    [
        FeatureMap(
            Differences(CHANNELS, 2),
            scaling=Affine.of_channels([0, 0, 0, 0, 0, 0], [1, 1, 0.5, 0.25, 0.5, 2]),
        ),
        FeatureMap(Differences(CHANNELS, 1), (2, 1), Affine.of_channels([0.0, 0.25], [1.0, 1.0])),
        FeatureMap(CRANK, (3, 0)),
    ],
)
def test_frozen_network_forms_the_features_itself(features: FeatureMap) -> None:
    module = module_of(features=features, linear_skip=True, activation="tanh")
    assert module.linear[0].in_features == SAMPLES * features.n_signals
    inputs = windows(200).numpy()
    with torch.no_grad():
        expected = module(torch.from_numpy(features.along(inputs))).numpy()
    network = module.freeze()
    found = network.evaluate(inputs)
    assert np.max(np.abs(found - expected)) <= TORCH_IS_NUMPY * np.ptp(expected)
    assert (network.features, network.n_channels) == (features, CHANNELS)


def test_frozen_network_is_a_copy() -> None:
    module = module_of(linear_skip=True)
    network, inputs = module.freeze(), windows(3).numpy()
    before = network.evaluate(inputs)
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.add_(1.0)
    assert np.array_equal(network.evaluate(inputs), before)


def test_weights_are_xavier_uniform_and_biases_zero() -> None:
    """U(-a, a) with a = sqrt(6 / (n_in + n_out)): within, and filling it."""
    module = module_of(hidden=(64, 32), linear_skip=True)
    assert module.skip is not None
    for layer in (*module.linear, module.skip):
        n_out, n_in = layer.weight.shape
        bound = math.sqrt(6 / (n_in + n_out))
        weights = layer.weight.detach().numpy()
        assert 0.95 * bound < np.max(np.abs(weights)) <= bound * (1 + 1e-6)
        assert np.std(weights) == pytest.approx(bound / math.sqrt(3), rel=0.1)
        if layer.bias is not None:
            assert not layer.bias.any()


def test_initialisation_depends_on_the_seed_alone() -> None:
    def weights(seed: int) -> list[np.ndarray]:
        return [p.detach().numpy() for p in module_of(seed, linear_skip=True).parameters()]

    torch.manual_seed(99)
    first = weights(5)
    torch.manual_seed(100)
    assert all(np.array_equal(a, b) for a, b in zip(first, weights(5), strict=True))
    assert not np.array_equal(first[0], weights(6)[0])


@pytest.mark.parametrize("linear_skip", [True, False])
def test_without_biases_tanh_gives_an_odd_network(linear_skip: bool) -> None:
    module = module_of(hidden=(32, 16), activation="tanh", bias=False, linear_skip=linear_skip)
    inputs = windows(50)
    assert torch.equal(module(-inputs), -module(inputs))
    network = module.freeze()
    values = network.evaluate(inputs.numpy())
    assert np.array_equal(network.evaluate(-inputs.numpy()), -values)
    assert not any(layer.bias.any() for layer in network.layers)


def test_network_that_diverged_is_not_frozen() -> None:
    module = module_of()
    with torch.no_grad():
        module.linear[0].weight[0, 0] = math.nan
    with refused(ValueError, "not finite"):
        module.freeze()
