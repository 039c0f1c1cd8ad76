"""The linear state-space model is our state-space family without hidden units, of several
orders."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import torch

from slide_fmu.apps.compare.baselines.base import Baseline, Budget, FittedBaseline, NetworkBaseline
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.apps.compare.baselines.search import search
from slide_fmu.core.progress import Progress, quiet
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.fitting.state_space.subspace import most_states
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

ORDERS = (1, 2, 4, 6, 8, 12, 16, 24)
"""Numbers of states that are tried."""
ITERATIONS = 10
"""Number of iterations that refine a linear model on all data; before, it has some of them."""


def fit_linear_state_space(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Fit linear state-space models; the order is chosen by validation.

    Raises:
        TrainingError: a fit diverged.
    """
    lengths = [len(inputs) for inputs in lesson.training[0]]
    features = lesson.features.along(lesson.training[0][:1])
    most = most_states(lengths, features.shape[2], lesson.n_outputs)
    fitting = [partial(_variant, lesson, order) for order in ORDERS if order <= most]
    return search(fitting, lesson, budget, progress)


def _variant(lesson: Lesson, order: int) -> list[tuple[str, Baseline]]:
    def tensors(inputs: object, outputs: object) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.as_tensor(inputs, dtype=torch.float64), torch.as_tensor(outputs)

    pairs = [
        tensors(lesson.features.along(inputs), outputs)
        for inputs, outputs in (lesson.training, lesson.validation)
    ]
    network = StateSpaceRecipe(order=order, hidden=0)
    training = LeastSquaresRecipe(seed=lesson.seed, iterations=ITERATIONS)
    with TemporaryDirectory() as folder:
        problem = Problem(
            lesson.window, lesson.features, pairs[0], pairs[1], Path(folder) / "linear.pt"
        )
        network_of_order = fit_state_space(problem, network, training, quiet).network
    return [(f"order {order}", NetworkBaseline(network_of_order, lesson.window, lesson.n_outputs))]
