"""The figures of a comparison of models are dataclasses for JSON files."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slide_fmu.core.figures import optional


@dataclass(frozen=True, kw_only=True)
class ModelOutput:
    """A ModelOutput has a model's RMSE of an output over the standard deviation of the truth.

    Attributes:
        rmse_over_deviation: None if the model has diverged on a motion.
        bounded_rmse_over_deviation: on motions without divergence, if any.
    """

    name: str
    unit: str
    rmse_over_deviation: float | None
    bounded_rmse_over_deviation: float | None


@dataclass(frozen=True, kw_only=True)
class ModelFigures:
    """ModelFigures are the figures of one model; a failed training has the first ones only.

    Attributes:
        structure: its size in words.
        cut: whether the budget cut its training short.
        failed: why it could not be trained; None if it was.
        cpu_seconds: CPU time of its training; None if not measured.
        diverged: number of motions on which it diverged.
        step_us: time of a step.
        time_ratio: ratio of that time to the step time of the recipe's own network.
        validation_error: of a network that was trained for the budget, an RMS in scaled units.
        error_half_way: the same at half of its time; None if none was known then.
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
    validation_error: float | None = optional()
    error_half_way: float | None = optional()

    @property
    def error(self) -> float:
        """The error, the largest one of several outputs; infinite if the model has diverged."""
        errors = [o.rmse_over_deviation for o in self.outputs if o.rmse_over_deviation is not None]
        return max(errors) if errors and len(errors) == len(self.outputs) else math.inf


@dataclass(frozen=True, kw_only=True)
class ComparisonFigures:
    """ComparisonFigures are the figures of a comparison of models.

    Attributes:
        trajectories, seed: number and seed of the unseen motions.
        budget_s: CPU time that each model was trained for.
        training_seed: seed of the recipe's training.
        remark: that a linear model is enough; None if it is not.
    """

    name: str
    trajectories: int
    budget_s: float
    seed: int
    training_seed: int
    models: tuple[ModelFigures, ...]
    remark: str | None
