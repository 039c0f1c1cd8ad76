"""The paper's feed-forward network is a torch module, trained with Adam."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from typing import final

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.core.window import Window
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.problem import FittedNetwork, Problem
from slide_fmu.fitting.training import train
from slide_fmu.fitting.windows import WindowData
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.recipe.learning import FeedForwardRecipe, TrainingRecipe

FUSED: dict[str, Callable[[torch.Tensor], torch.Tensor]] = {
    "relu": torch.nn.functional.relu,
    "elu": torch.nn.functional.elu,
    "gelu": functools.partial(torch.nn.functional.gelu, approximate="tanh"),
}
"""Activations that torch computes in a single kernel, with their derivative.

The formulas shared by numpy and torch need several passes, which would make the training of small
layers 1.3 to 2 times slower."""


def activation(name: str) -> Callable[[torch.Tensor], torch.Tensor]:
    """Return an activation for tensors of any shape, in its fastest form in torch."""
    return FUSED.get(name) or (lambda values: ACTIVATIONS[name].value(values, torch))


@final
class FeedForwardModule(torch.nn.Module):
    """A FeedForwardModule is a trainable network on a flattened window.

    This is the paper's network (section "Feedforward networks (FFN)"), with a linear skip
    connection and a selection of samples as options.

    Args:
        recipe: hidden widths, activation, bias, linear skip.
        n_samples: number of samples of the input sequence.
        features: the features formed at each sample.
        n_values: number of values of the network.
        ages: ages of the samples that the network takes, 0 for the newest, falling from n_samples
            - 1; if empty, it takes all samples.
    """

    def __init__(
        self,
        recipe: FeedForwardRecipe,
        n_samples: int,
        features: FeatureMap,
        n_values: int,
        ages: tuple[int, ...] = (),
    ) -> None:
        super().__init__()
        self.recipe = recipe
        self.n_samples, self.features, self.ages = n_samples, features, ages
        first = (len(ages) or n_samples) * features.n_signals
        widths = (first, *recipe.hidden, n_values)
        self.linear = torch.nn.ModuleList(
            torch.nn.Linear(n_in, n_out, bias=recipe.bias)
            for n_in, n_out in itertools.pairwise(widths)
        )
        self.activation = activation(recipe.activation)
        self.skip = torch.nn.Linear(first, n_values, bias=False) if recipe.linear_skip else None

    def initialise(self, generator: torch.Generator) -> None:
        """Draw the weights: Xavier uniform (Glorot and Bengio, 2010), with zero biases.

        This is also the paper's choice (section "Training loss and validation error").
        """
        modules = [*self.linear, *([] if self.skip is None else [self.skip])]
        for module in modules:
            torch.nn.init.xavier_uniform_(module.weight, generator=generator)
            if module.bias is not None:
                torch.nn.init.zeros_(module.bias)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Map windows of features (B, n_samples, n_features) to values (B, n_values)."""
        return self.values_of(self.picked(windows))

    def picked(self, windows: torch.Tensor) -> torch.Tensor:
        """Pick the samples that the network takes, (..., n_seen, n_features), the oldest first."""
        if not self.ages:
            return windows
        return windows[..., [self.n_samples - 1 - age for age in self.ages], :]

    def values_of(self, seen: torch.Tensor) -> torch.Tensor:
        """Map the picked samples (B, n_seen, n_features) to values (B, n_values)."""
        flat = seen.flatten(1)
        hidden = flat
        for index, linear in enumerate(self.linear):
            hidden = linear(hidden)
            if index < len(self.linear) - 1:
                hidden = self.activation(hidden)
        return hidden if self.skip is None else hidden + self.skip(flat)

    def freeze(self) -> FeedForward:
        """Return the trained network as data, in float32."""
        names = [self.recipe.activation] * (len(self.linear) - 1) + ["identity"]
        tensors = self.state_dict().items()
        state = {key: t.to("cpu", torch.float32).numpy().copy() for key, t in tensors}
        layers = []
        for index, name in enumerate(names):
            weights = state[f"linear.{index}.weight"]
            bias = state.get(f"linear.{index}.bias", np.zeros(len(weights), np.float32))
            layers.append(Layer(weights, bias, name))
        return FeedForward(
            tuple(layers), self.n_samples, self.features, state.get("skip.weight"), self.ages
        )


def fit_feed_forward(
    problem: Problem,
    network: FeedForwardRecipe,
    training: TrainingRecipe,
    progress: Progress,
) -> FittedNetwork:
    """Train the paper's feed-forward network with Adam.

    Raises:
        TrainingError: the training diverged.
    """
    window = problem.window
    if network.time_invariant:
        window = Window(window.step, window.memory_length, 1)
    data = WindowData(*problem.training, window)
    n_values = window.n_out * data.targets.shape[2]
    module = FeedForwardModule(network, window.n_in, problem.features, n_values)
    module.to(data.inputs.device, data.inputs.dtype)
    module.initialise(torch.Generator(data.inputs.device).manual_seed(training.seed))
    validation = WindowData(*problem.validation, window)
    history = train(module, data, validation, training, problem.checkpoint, progress)
    return FittedNetwork(module.freeze(), history, network)
