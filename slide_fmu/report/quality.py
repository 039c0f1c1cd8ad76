"""This module judges whether a surrogate is accurate enough, and how to improve it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.units import behind
from slide_fmu.fitting.history import History, SizeTrial
from slide_fmu.recipe.learning import LeastSquaresRecipe
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import FAR_OFF
from slide_fmu.validation.task import IN_RANGE

LINEAR_DOES = 1.2
"""A linear model would do where its error is at most this factor above the best other one."""
LAST, FELL = 0.2, 0.1
"""A training that still lowered its validation error by this part (``FELL``) in its last steps
(the share ``LAST`` of all) would go on to lower it."""

Measured = Mapping[str, ValidationFigures]
"""Figures by the name of the validation."""


FLAT = 0.02
"""A surrogate predicts a constant where its output moves by less than this part of what it should
follow. The best constant is off by the whole motion, however small the error on a scale is."""


class QualityError(ValueError):
    """A surrogate is less accurate than its recipe requires, or predicts a constant."""


def remedy(recipe: Recipe) -> str:
    """Return the remedy for a large error, by what the kind of the recipe's system may have."""
    more = rules_of(recipe).words.more_data
    return f"give {more}, a larger network (network.hidden), or a longer training"


def require_motion(in_range: Validation) -> None:
    """Refuse a surrogate that predicts a constant where its reference moves.

    Raises:
        QualityError: the message names the outputs, and the remedy.
    """
    given = np.concatenate([c.surrogate for c in in_range.comparisons])
    truth = np.concatenate([c.reference for c in in_range.comparisons])
    moves, wanted = given.std(axis=0), truth.std(axis=0)
    flat = [
        f"output {signal.name!r} stays near {np.mean(given[:, k]):.4g}{behind(signal.unit)}, with "
        f"a standard deviation of {moves[k]:.3g} where the reference has {wanted[k]:.3g}"
        for k, signal in enumerate(in_range.surrogate.outputs)
        if moves[k] < FLAT * wanted[k]
    ]
    if flat:
        raise QualityError(
            f"surrogate {in_range.recipe.name!r} is not exported, since it predicts a constant: "
            f"{'; '.join(flat)} on unseen trajectories; expected at least {percent(FLAT)} of it: "
            f"{remedy(in_range.recipe)}{rules_of(in_range.recipe).words.where_flat}"
        )


def require_quality(recipe: Recipe, figures: RunFigures) -> None:
    """Refuse a surrogate whose error is larger than ``validation.require``.

    Args:
        recipe: the recipe with the requirement.
        figures: the figures of the report.

    Raises:
        QualityError: the message names the outputs, their errors, and the remedy.
    """
    most = recipe.validation.require
    worse = [] if most is None else _above(figures.validation, most)
    if most is not None and worse:
        raise QualityError(
            f"surrogate {recipe.name!r} is not accurate enough: {', '.join(worse)} on unseen "
            f"trajectories; expected at most {percent(most)} (validation.require = {most:g}): "
            f"{remedy(recipe)}, or require less"
        )


def remark_on_error(recipe: Recipe, measured: Measured) -> str | None:
    """Say that outputs are far off, where the recipe requires nothing; None otherwise."""
    worse = [] if recipe.validation.require is not None else _above(measured, FAR_OFF)
    if not worse:
        return None
    return (
        f"the surrogate is far off on unseen trajectories: {', '.join(worse)}; {remedy(recipe)}; "
        "validation.require refuses a surrogate whose error is larger than its value"
    )


def _above(measured: Measured, most: float) -> list[str]:
    """Return the outputs whose relative RMSE in range is above ``most``, each with its error."""
    return [
        f"output {output.name!r} has an error of {percent(output.relative_rmse)}"
        for output in measured[IN_RANGE].outputs
        if not output.relative_rmse <= most
    ]


def remark_on_training(recipe: Recipe, history: History) -> str | None:
    """Say that the validation error still fell when a training ended; None if it did not.

    Args:
        recipe: the recipe that the network was trained by.
        history: the course of the training.
    """
    steps, errors = history.step, history.validation_error
    until = (1 - LAST) * steps[-1]
    before = [error for step, error in zip(steps, errors, strict=True) if step <= until]
    if not before or min(errors) > (1 - FELL) * min(before):
        return None
    fallen = 100 * (1 - min(errors) / min(before))
    return (
        f"the validation error still fell by {fallen:.2g} % in the last fifth of the training: "
        f"a longer one would pay ({_longer(recipe)})"
    )


def linear_size_remark(sizes: Sequence[SizeTrial], error: float) -> str | None:
    """Say that a linear network would do, of the sizes that a search has tried; else None.

    ``error`` is the validation error of the chosen network, in scaled units.
    """
    linear = [
        (size.validation_error, size.order)
        for size in sizes
        if size.units == 0 and size.validation_error
    ]
    best, order = min(linear, default=(float("inf"), 0))
    if not best <= LINEAR_DOES * error:
        return None
    return (
        f"a linear model would do: a linear network of order {order} has an error "
        f"{best / error:.3g} times as large in validation (network.hidden = 0)"
    )


def _longer(recipe: Recipe) -> str:
    """Return the recipe key that sets the length of a training, with its present value."""
    training = recipe.training
    if isinstance(training, LeastSquaresRecipe):
        return f"training.iterations, now {training.iterations}"
    return f"training.steps, now {training.steps}"
