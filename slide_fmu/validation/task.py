"""A task names the unseen trajectories of a validation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from slide_fmu.core.shown import shown

if TYPE_CHECKING:  # the command line reads the seed without what a recipe needs
    from slide_fmu.recipe.recipe import Recipe

IN_RANGE, BEYOND, HELD_OUT = "in range", "beyond the range", "kinds that were held out"
"""Names of the groups of trajectories that a released FMU is measured on; its figures use them."""

UNSEEN_SEED = 20_260_000
"""Seed of validation trajectories; their stream of seeds is used for nothing else."""


def entropy_of(seed: int) -> int:
    """Return the entropy that a validation's seed adds to draws of further inputs; 0 by default.

    Entropy of 0 at the end changes no draw of numpy.
    """
    return seed ^ UNSEEN_SEED


@dataclass(frozen=True)
class Task:
    """A task names the unseen trajectories of a validation.

    Attributes:
        seed: entropy of the trajectories; no training, tuning or selection uses their stream.
        trajectories: number of unseen trajectories; the recipe's if None.
        amplitude: range of the factor on the excitation's amplitude; (1, 1) is in range.
        duration: length of a trajectory in s; the recipe's if None.
        held_out: whether the motions are of the kinds of excitation that the recipe holds out.

    Raises:
        ValueError: a value is out of its range.
    """

    seed: int
    trajectories: int | None = None
    amplitude: tuple[float, float] = (1.0, 1.0)
    duration: float | None = None
    held_out: bool = False

    def __post_init__(self) -> None:
        if self.trajectories is not None and self.trajectories < 1:
            raise ValueError(f"trajectories = {self.trajectories}; expected at least 1")
        if self.duration is not None and not 0 < self.duration < math.inf:
            raise ValueError(f"duration = {self.duration} s; expected a positive, finite time")
        if not 0 < self.amplitude[0] <= self.amplitude[1] < math.inf:
            raise ValueError(
                f"amplitude = {shown(self.amplitude)}; expected two positive factors, smaller one "
                "first"
            )

    def duration_of(self, recipe: Recipe) -> float:
        """Return the length of a trajectory in s."""
        return self.duration or recipe.measured_duration()
