"""What a network family is: its recipe's tables and data in, a frozen network out.

A family joins with its tables in ``slide_fmu.recipe.learning``, its fit here, and its final class
of ``slide_fmu.network.base.Network``.
"""

from __future__ import annotations

import torch

from slide_fmu.core.progress import Progress
from slide_fmu.core.window import Window
from slide_fmu.learn.feed_forward import FeedForwardModule
from slide_fmu.learn.problem import Problem
from slide_fmu.learn.state_space.fit import fit_state_space
from slide_fmu.learn.training import History, block_mean_square, train
from slide_fmu.learn.windows import WindowData
from slide_fmu.network.base import Network
from slide_fmu.recipe.learning import (
    FeedForwardRecipe,
    LeastSquaresRecipe,
    StateSpaceRecipe,
    TrainingRecipe,
)


def fit_network(
    problem: Problem,
    network: FeedForwardRecipe | StateSpaceRecipe,
    training: TrainingRecipe | LeastSquaresRecipe,
    progress: Progress,
) -> tuple[Network, History]:
    """Fit a network of the family that the recipe names.

    Raises:
        TrainingError: the training diverged.
        TypeError: the training is not that of the family; recipes cannot say so.
    """
    if isinstance(network, StateSpaceRecipe) and isinstance(training, LeastSquaresRecipe):
        return fit_state_space(problem, network, training, progress)
    if isinstance(network, FeedForwardRecipe) and isinstance(training, TrainingRecipe):
        return fit_feed_forward(problem, network, training, progress)
    raise TypeError(f"no training {training.method!r} of the family {network.family!r}")


def fit_feed_forward(
    problem: Problem,
    network: FeedForwardRecipe,
    training: TrainingRecipe,
    progress: Progress,
) -> tuple[Network, History]:
    """Train the paper's feed-forward network by Adam.

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
    module.initialise(seeded_generator(training.seed, data.inputs.device))
    validation = WindowData(*problem.validation, window)
    objective = block_mean_square(window.n_out, training.newest_weight)
    history = train(module, data, validation, training, problem.checkpoint, progress, objective)
    return module.freeze(), history


def seeded_generator(seed: int, device: torch.device) -> torch.Generator:
    """A random generator of the device."""
    generator = torch.Generator(device=device)
    generator.manual_seed(seed)
    return generator
