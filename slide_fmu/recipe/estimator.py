"""The recipe's table ``estimator`` describes the error estimator."""

from __future__ import annotations

import itertools
from typing import Any

from pydantic import Field, model_validator

from slide_fmu.excitation.base import PositiveRange
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.learning import (
    FeedForwardRecipe,
    NonNegativeInt,
    PositiveInt,
    Table,
    TrainingRecipe,
)

ROUNDING = 1e-9
"""Added before a share of a number is rounded down, so that a tenth of ten is one."""


BEYOND_FACTOR = (1.0, 3.0)
"""Inputs leave their ranges by a factor from this range, where a recipe asks for that."""

DEFAULTS: Tables = {
    "network": {
        "family": "feed_forward",
        "hidden": [64, 64],
        "activation": "gelu",
        "time_invariant": True,
    },
    "training": {
        "steps": 2000,
        "batch": 6,
        "learning_rate": 3e-4,
        "expert": {"gradient_clip": 1.0},
    },
}
PRETRAINING: Tables = {
    "steps": 4000,
    "batch": 1024,
    "learning_rate": 2.5e-3,
    "expert": {"final_learning_rate": 0.02, "gradient_clip": 1.0},
}
"""Default tables of an estimator: smaller and more quickly trained than in the released FMUs."""


class EstimatorExpert(Table):
    """The table ``estimator.expert`` tunes how an error estimator is learnt.

    Attributes:
        pretraining: training of a time-invariant network at single positions, where it learns mean
            and standard deviation of the error by maximum likelihood.
        pretrained_beyond: whether this network learns from trajectories beyond the range too;
            false where the system has several lasting responses there, so that errors are orders
            of magnitude larger.
        lags: the samples that a time-invariant network sees at each position, by their age, 0 the
            newest, rising; all that the window holds before its oldest output if not given.
        resolution: errors below this fraction of the output's scale count as equal.
        amplitude_factor: range of the factor on the excitation of its trajectories. Without
            ``estimator.beyond`` no factor is above 1.
        in_range: fraction of its trajectories with factor 1.
    """

    pretraining: TrainingRecipe | None = None
    pretrained_beyond: bool = True
    lags: tuple[NonNegativeInt, ...] | None = Field(default=None, min_length=1)
    resolution: float = Field(default=1e-3, gt=0, lt=1)
    amplitude_factor: PositiveRange = BEYOND_FACTOR
    in_range: float = Field(default=0.5, ge=0, le=1)

    @model_validator(mode="after")
    def _lags_rise(self) -> EstimatorExpert:
        if not all(newer < older for newer, older in itertools.pairwise(self.lags or ())):
            raise ValueError(
                f"lags = {list(self.lags or ())}; expected ages of samples, 0 the newest, each "
                "larger than the one before it"
            )
        return self


class EstimatorRecipe(Table):
    """The table ``estimator`` describes the error estimator.

    A table without ``network`` gets a network and trainings that suit most systems.

    Attributes:
        network: its network. With ``time_invariant`` it estimates the error at each sample, and
            the root of the mean square over the last ``span`` samples counts. Otherwise it
            estimates the error over the output window, from the whole window.
        training: its training on the error over the span.
        span: samples over which the error is estimated, as the root of the mean square; the
            samples of the output window if not given.
        beyond: whether it also learns from inputs outside of their declared ranges, which are hard
            limits otherwise.
        expert: settings for users who know the method.
    """

    network: FeedForwardRecipe
    training: TrainingRecipe
    span: PositiveInt | None = None
    beyond: bool = False
    expert: EstimatorExpert = EstimatorExpert()

    @model_validator(mode="before")
    @classmethod
    def _tables_have_defaults(cls, values: Any) -> Any:
        """The network and its trainings are either all given or all left out."""
        if not isinstance(values, dict):
            return values
        expert = values.get("expert", {})
        if not isinstance(expert, dict):
            return values
        factor = BEYOND_FACTOR if values.get("beyond", False) else (1.0, 1.0)
        expert = {"amplitude_factor": factor, **expert}
        if "network" in values:
            return {**values, "expert": expert}
        return {**DEFAULTS, **values, "expert": {"pretraining": PRETRAINING, **expert}}

    def draws_beyond(self, index: int) -> bool:
        """Tell whether trajectory ``index`` is drawn with ``expert.amplitude_factor``.

        Trajectories in range and beyond take turns, the first one in range if any is. So a larger
        number of trajectories does not change the first ones.
        """
        return self.factors(index) != (1.0, 1.0)

    def factors(self, index: int) -> tuple[float, float]:
        """Return the range of the amplitude factor of trajectory ``index``."""
        return drawn_factors(self.expert.amplitude_factor, self.expert.in_range, index)

    @model_validator(mode="after")
    def _ranges_are_limits(self) -> EstimatorRecipe:
        factor = self.expert.amplitude_factor
        if factor[1] > 1.0 and not self.beyond:
            raise ValueError(
                f"expert.amplitude_factor = {list(factor)} drives inputs out of their "
                "declared ranges, which are hard limits; expected beyond = true with it, or no "
                "factor above 1: add beyond = true to [estimator] if the model may be simulated "
                "there, or remove expert.amplitude_factor"
            )
        return self

    @model_validator(mode="after")
    def _parts_fit(self) -> EstimatorRecipe:
        expert = self.expert
        if not self.network.time_invariant and (self.span or expert.lags or expert.pretraining):
            raise ValueError(
                "span, lags or pretraining is set, but the network sees the whole window; "
                "expected none of them, or estimator.network.time_invariant = true"
            )
        if not (expert.pretrained_beyond or (expert.pretraining and not self.draws_beyond(0))):
            raise ValueError(
                f"pretrained_beyond = false with in_range = {expert.in_range:g} and "
                f"{'a' if expert.pretraining else 'no'} pretraining; expected a pretraining, and "
                "trajectories in range to learn from"
            )
        return self


def drawn_factors(
    amplitude_factor: tuple[float, float], in_range: float, index: int
) -> tuple[float, float]:
    """Return the range of the amplitude factor of an estimator's trajectory ``index``."""
    share = 1.0 - in_range
    beyond = int((index + 1) * share + ROUNDING) > int(index * share + ROUNDING)
    return amplitude_factor if beyond else (1.0, 1.0)
