"""What a network family is: a recipe's table and data in, a frozen network out.

A second family joins with its own final class of ``Family`` in ``FAMILIES``, its table in
``recipe.py`` and its final class of ``slide_fmu.network.Network``.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from pathlib import Path

import torch

from slide_fmu.learn.feed_forward import FeedForwardModule
from slide_fmu.learn.training import History, TrainingProgress, train
from slide_fmu.learn.windows import WindowData
from slide_fmu.network import Network
from slide_fmu.recipe import FeedForwardRecipe, TrainingRecipe
from slide_fmu.window import Window


@dataclass(frozen=True, eq=False)
class Problem:
    """One regression: from scaled input windows to scaled outputs.

    Attributes:
        window: the surrogate's window.
        training: inputs and outputs to learn from, each (n_trajectories, samples, channels).
        validation: inputs and outputs to choose the weights by.
        checkpoint: file that holds the state of an interrupted fit.
    """

    window: Window
    training: tuple[torch.Tensor, torch.Tensor]
    validation: tuple[torch.Tensor, torch.Tensor]
    checkpoint: Path


class Family(abc.ABC):
    """A network family. Interface: never instantiated."""

    @abc.abstractmethod
    def fit(
        self,
        problem: Problem,
        network: FeedForwardRecipe,
        training: TrainingRecipe,
        progress: TrainingProgress,
    ) -> tuple[Network, History]:
        """Fit a network of this family.

        Raises:
            TrainingError: the training diverged.
        """


class FeedForwardFamily(Family):
    """The paper's feed-forward network, trained by Adam. Final."""

    def fit(
        self,
        problem: Problem,
        network: FeedForwardRecipe,
        training: TrainingRecipe,
        progress: TrainingProgress,
    ) -> tuple[Network, History]:
        window = problem.window
        if network.time_invariant:
            window = Window(window.step, window.receptive_field, 1)
        data = WindowData(*problem.training, window)
        n_inputs, n_outputs = data.inputs.shape[2], data.targets.shape[2]
        module = FeedForwardModule(network, window.n_in, n_inputs, window.n_out * n_outputs)
        module.to(data.inputs.device, data.inputs.dtype)
        module.initialise(seeded_generator(training.seed, data.inputs.device))
        history = train(
            module,
            data,
            WindowData(*problem.validation, window),
            training,
            problem.checkpoint,
            progress,
        )
        return module.freeze(), history


FAMILIES: dict[str, Family] = {"feed_forward": FeedForwardFamily()}


def seeded_generator(seed: int, device: torch.device) -> torch.Generator:
    """A random generator of the device."""
    generator = torch.Generator(device=device)
    generator.manual_seed(seed)
    return generator
