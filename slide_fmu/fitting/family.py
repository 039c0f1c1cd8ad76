"""The fits of the network families, each registered in one row: data in, a frozen network out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.feed_forward import fit_feed_forward
from slide_fmu.fitting.history import History
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.network.base import Network
from slide_fmu.recipe.learning import FeedForwardRecipe, StateSpaceRecipe


@dataclass(frozen=True)
class FamilyFit:
    """A family's fit says how its networks are fitted.

    Attributes:
        fit: gives the network and its history for a problem, the recipe's tables of the network
            and of its training, and a progress. It raises a TrainingError where it diverges.
        linearized: whether the fit begins with the eigenvalues of the linearized system, and is
            given its data in double precision whatever the training's precision.
    """

    fit: Callable[[Problem, Any, Any, Progress], tuple[Network, History]]
    linearized: bool = False


FITS: dict[type, FamilyFit] = {
    FeedForwardRecipe: FamilyFit(fit_feed_forward),
    StateSpaceRecipe: FamilyFit(fit_state_space, linearized=True),
}
"""The fits of all families, by the class of the family's table in the recipe."""
