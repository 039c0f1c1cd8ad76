"""The fits of the network families, each registered in one row: data in, a frozen network out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from slide_fmu.core.progress import Progress
from slide_fmu.learn.feed_forward import fit_feed_forward
from slide_fmu.learn.problem import Problem
from slide_fmu.learn.state_space.fit import fit_state_space
from slide_fmu.learn.training import History
from slide_fmu.network.base import Network
from slide_fmu.recipe.learning import (
    FeedForwardRecipe,
    LeastSquaresRecipe,
    NetworkTable,
    StateSpaceRecipe,
    TrainingRecipe,
    TrainingTable,
)


@dataclass(frozen=True)
class FamilyFit:
    """A family's fit says how its networks are fitted.

    Attributes:
        network: class of the family's table in the recipe.
        training: class of the table of its training.
        fit: gives the network and its history for a problem, the two tables and a progress.
        linearized: whether the fit begins with the eigenvalues of the linearized system, and is
            given its data in double precision whatever the training's precision.
    """

    network: type
    training: type
    fit: Callable[[Problem, Any, Any, Progress], tuple[Network, History]]
    linearized: bool = False


FITS = (
    FamilyFit(FeedForwardRecipe, TrainingRecipe, fit_feed_forward),
    FamilyFit(StateSpaceRecipe, LeastSquaresRecipe, fit_state_space, linearized=True),
)
"""The fits of all families."""


def fit_of(network: NetworkTable) -> FamilyFit:
    """Return the fit of the family that a table names.

    Raises:
        TypeError: the family has none.
    """
    for found in FITS:
        if isinstance(network, found.network):
            return found
    raise TypeError(f"no fit of the network family {network.family!r}; register one in FITS")


def fit_network(
    problem: Problem, network: NetworkTable, training: TrainingTable, progress: Progress
) -> tuple[Network, History]:
    """Fit a network of the family that the recipe names, and return it with its history.

    Raises:
        TrainingError: the training diverged.
        TypeError: the training is not that of the family; recipes cannot say so.
    """
    found = fit_of(network)
    if not isinstance(training, found.training):
        raise TypeError(f"no training {training.method!r} of the family {network.family!r}")
    return found.fit(problem, network, training, progress)
