"""A surrogate is fitted to trajectories: its network, without forecast, estimator and bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slide_fmu.core.progress import Heard, Progress
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.checkpoint import CpuTime
from slide_fmu.fitting.feed_forward import fit_feed_forward
from slide_fmu.fitting.history import History
from slide_fmu.fitting.preparation import Work, prepare, scales_of
from slide_fmu.fitting.problem import FittedNetwork, Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.recipe.learning import FeedForwardRecipe, StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate

FITS: dict[type, Callable[[Problem, Any, Any, Progress], FittedNetwork]] = {
    FeedForwardRecipe: fit_feed_forward,
    StateSpaceRecipe: fit_state_space,
}
"""The fits of all families, by the class of the family's table in the recipe.

They are given a problem, the recipe's tables of the network and of its training, and a progress;
they raise a TrainingError where they diverge."""

SURROGATE = "surrogate"
"""The stage of the surrogate's network has this name in the progress and in the figures."""

MARGIN = 0.01
"""Ranges of outputs in the training are wider by this part of their width at both ends."""


@dataclass(frozen=True)
class Part:
    """A part of a surrogate is a network that is fitted to trajectories.

    Attributes:
        stage: its name in the progress and in the figures.
        split: trajectories that it learns from.
        judged_by: trajectories by which the best of the training is chosen.
        output_scaling: from the standard deviations of these trajectories if None.
    """

    stage: str = SURROGATE
    split: str = "train"
    judged_by: str = "validation"
    output_scaling: Affine | None = None


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit is a surrogate, and how its trainings went.

    Attributes:
        surrogate: what was fitted.
        histories: course of each training by its stage; one for each choice of features too.
        recipe: the recipe, whose table of the network has the features and sizes that were found.
    """

    surrogate: Surrogate
    histories: dict[str, History]
    recipe: Recipe


def fit_network(work: Work, part: Part = Part()) -> Fit:
    """Fit the surrogate without forecast, estimator and bound.

    Raises:
        StoreError: trajectories are missing.
        TrainingError: the training diverged.
        RecipeError, UnstableModeError, ValueError: as of ``scales_of`` and ``prepare``.
    """
    recipe, source, known = work.recipe, work.case.source, work.known
    splits = work.splits(part.split, part.judged_by, *(["beyond"] if recipe.data.beyond else []))
    scales = scales_of(work, splits, part.output_scaling)
    checkpoint = work.checkpoints / f"surrogate-{scales.key}.pt"
    spent = CpuTime(checkpoint.with_suffix(".cpu_seconds"))
    work = replace(work, progress=spent.counted(work.progress))
    prepared = prepare(work, scales, splits)
    even_out = getattr(recipe.training.expert, "even_out", False)
    relative = known is None and scales.noise is None and not even_out
    shown = Heard(work.progress(part.stage), with_error=relative)
    problem = prepared.problem(splits, checkpoint)
    found = FITS[type(recipe.network)](problem, prepared.table, recipe.training, shown)
    history = replace(found.history, cpu_seconds=spent.keep(), relative=relative)
    surrogate = Surrogate(
        recipe.name,
        recipe.window.as_window,
        source.inputs,
        source.outputs,
        work.offered.scaling,
        scales.outputs,
        found.network,
        output_ranges=learnt_ranges(splits[0].outputs),
    )
    resolved = recipe.model_copy(update={"network": found.table})
    histories = {**prepared.tried, part.stage: history}
    return Fit(surrogate, histories, resolved)


def learnt_ranges(outputs: FloatArray) -> FloatArray:
    """Return the ranges of outputs, (n_trajectories, N, n_outputs), as (n_outputs, 2) values.

    They are ``MARGIN`` of their width wider, for what a surrogate errs by.
    """
    low, high = (found(outputs, axis=(0, 1)) for found in (np.nanmin, np.nanmax))
    margin = MARGIN * (high - low)
    return np.stack([low - margin, high + margin], axis=1)
