"""The paper's feed-forward network: module, initialisation, freezing."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import torch

from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.base import Float32Array
from slide_fmu.network.feed_forward import FeedForward, Layer
from slide_fmu.recipe.learning import FeedForwardRecipe


class Cubic(torch.nn.Module):
    """Third power; final."""

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        """Values of any shape."""
        return values * values * values


ACTIVATION_MODULES: dict[str, Callable[[], torch.nn.Module]] = {
    "identity": torch.nn.Identity,
    "relu": torch.nn.ReLU,
    "elu": torch.nn.ELU,
    "tanh": torch.nn.Tanh,
    "gelu": lambda: torch.nn.GELU(approximate="tanh"),
    "cubic": Cubic,
}


class FeedForwardModule(torch.nn.Module):
    """A feed-forward module is a trainable network on a flattened window. Final.

    This is the paper's network (section "Feedforward networks (FFN)"), with a linear skip
    connection and a choice of the samples that it looks at as options.

    Args:
        recipe: hidden widths, activation, bias, linear skip.
        n_samples: number of samples of the input sequence.
        features: what the network sees of the inputs at each sample.
        n_values: number of values that it gives.
        ages: ages in samples of those that the network looks at, 0 for the newest, falling from
            n_samples - 1; it looks at all samples if there are none.
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
        self.activation = ACTIVATION_MODULES[recipe.activation]()
        self.skip = torch.nn.Linear(first, n_values, bias=False) if recipe.linear_skip else None

    def initialise(self, generator: torch.Generator) -> None:
        """Draw the weights: Xavier uniform (Glorot and Bengio, 2010), with zero biases.

        The paper does so too (section "Training loss and validation error").

        Args:
            generator: the only source of randomness, on the module's device.
        """
        modules = [*self.linear, *([] if self.skip is None else [self.skip])]
        for module in modules:
            torch.nn.init.xavier_uniform_(module.weight, generator=generator)
            if module.bias is not None:
                torch.nn.init.zeros_(module.bias)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Map windows of features (B, n_samples, n_features) to values (B, n_values)."""
        return self.values_of(self.seen(windows))

    def seen(self, windows: torch.Tensor) -> torch.Tensor:
        """Pick the samples that the network looks at from windows (..., n_samples, n_features).

        Returns:
            Shape (..., n_seen, n_features), the oldest sample first.
        """
        if not self.ages:
            return windows
        return windows[..., [self.n_samples - 1 - age for age in self.ages], :]

    def values_of(self, seen: torch.Tensor) -> torch.Tensor:
        """Map the samples (B, n_seen, n_features) that the network looks at to (B, n_values)."""
        flat = seen.flatten(1)
        hidden = flat
        for index, linear in enumerate(self.linear):
            hidden = linear(hidden)
            if index < len(self.linear) - 1:
                hidden = self.activation(hidden)
        return hidden if self.skip is None else hidden + self.skip(flat)

    def freeze(self) -> FeedForward:
        """Return the trained network as data, in float32.

        Raises:
            ValueError: a weight is not finite.
        """
        names = [self.recipe.activation] * (len(self.linear) - 1) + ["identity"]
        state = {name: _array(tensor) for name, tensor in self.state_dict().items()}
        layers = []
        for index, name in enumerate(names):
            weights = state[f"linear.{index}.weight"]
            bias = state.get(f"linear.{index}.bias", np.zeros(len(weights), np.float32))
            layers.append(Layer(weights, bias, name))
        return FeedForward(
            tuple(layers), self.n_samples, self.features, state.get("skip.weight"), self.ages
        )


def _array(tensor: torch.Tensor) -> Float32Array:
    return np.asarray(tensor.detach().to("cpu", torch.float32).numpy()).copy()
