"""The figures of a comparison of models, as JSON files hold them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slide_fmu.core.figures import optional


@dataclass(frozen=True, kw_only=True)
class ModelOutput:
    """This is a model's RMSE on an output over the standard deviation of the truth.

    Attributes:
        rmse_over_deviation: None of a model that has diverged on a motion.
        bounded_rmse_over_deviation: on the motions on which it has not, if there are any.
    """

    name: str
    unit: str
    rmse_over_deviation: float | None
    bounded_rmse_over_deviation: float | None


@dataclass(frozen=True, kw_only=True)
class ModelFigures:
    """These are the figures of one model; one that could not be trained has the first ones alone.

    Attributes:
        structure: its size in words.
        cut: whether its training was cut by the budget.
        failed: why it could not be trained; None if it was.
        cpu_seconds: CPU time of its training; None where nobody measured it.
        diverged: number of motions on which it diverged.
        step_us: time of a step.
        time_ratio: of that to the time of a step of the recipe's own network.
    """

    title: str
    linear: bool
    structure: str
    cut: bool = False
    failed: str | None = None
    cpu_seconds: float | None
    parameters: int | None = optional()
    diverged: int | None = optional()
    outputs: tuple[ModelOutput, ...] = optional(())
    step_us: float | None = optional()
    time_ratio: float | None = optional()

    @property
    def error(self) -> float:
        """The error, of several outputs the largest; infinite if the model has diverged."""
        errors = [o.rmse_over_deviation for o in self.outputs if o.rmse_over_deviation is not None]
        return max(errors) if errors and len(errors) == len(self.outputs) else math.inf


@dataclass(frozen=True, kw_only=True)
class ComparisonFigures:
    """These are the figures of a comparison of models.

    Attributes:
        trajectories, seed: number and seed of the unseen motions.
        budget_s: CPU time that each model was trained for.
        training_seed: seed of the recipe's training.
        remark: that a linear model would do; None if none would.
    """

    name: str
    trajectories: int
    budget_s: float
    seed: int
    training_seed: int
    models: tuple[ModelFigures, ...]
    remark: str | None
