"""A surrogate's network is fitted to trajectories, without forecast, estimator and bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slide_fmu.core.progress import Progress, ProgressListener
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.checkpoint import CpuTime
from slide_fmu.fitting.feed_forward import fit_feed_forward
from slide_fmu.fitting.history import History
from slide_fmu.fitting.preparation import Work, prepare, scales_of
from slide_fmu.fitting.problem import FittedNetwork, Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.memory.cube_limits import with_stable_cubes
from slide_fmu.recipe.learning import FeedForwardRecipe, NetworkTable, StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate

FITS: dict[type, Callable[[Problem, Any, Any, Progress], FittedNetwork]] = {
    FeedForwardRecipe: fit_feed_forward,
    StateSpaceRecipe: fit_state_space,
}
"""The fits of all families, by the class of the family's table in the recipe.

Arguments are a problem, the recipe's tables of the network and of its training, and a progress. A
fit that diverges raises a TrainingError."""

SURROGATE = "surrogate"
"""Name of the network's stage in the progress and in the figures."""

RANGE_MARGIN = 0.01
"""Margin of the trained ranges of outputs at both ends, relative to their width."""


@dataclass(frozen=True)
class Part:
    """A Part is a network of a surrogate that is fitted to trajectories.

    Attributes:
        stage: its name in the progress and in the figures.
        split: name of the training trajectories.
        judged_by: name of the trajectories that select the best weights.
        output_scaling: scaling of the outputs; from their standard deviations here if None.
    """

    stage: str = SURROGATE
    split: str = "train"
    judged_by: str = "validation"
    output_scaling: Affine | None = None


@dataclass(frozen=True, eq=False)
class Fit:
    """A Fit is a surrogate, and the histories of its trainings.

    Attributes:
        surrogate: the fitted surrogate.
        histories: course of each training by its stage, and of each choice of features.
        recipe: the recipe, whose table of the network has the features and sizes found.
    """

    surrogate: Surrogate
    histories: dict[str, History]
    recipe: Recipe


def fit_network(
    work: Work,
    part: Part = Part(),
    begin: Callable[[Recipe, Affine], None] = lambda recipe, outputs: None,
) -> Fit:
    """Fit the surrogate without forecast, estimator and bound.

    ``begin`` is called as soon as all is known that the fit of another network takes from this
    one, if that is before the end: the recipe for it, and the scaling of the outputs. If features
    were searched, the other one searches for features and sizes of its own.

    Raises:
        TrajectoryError: trajectories are missing.
        TrainingError: the training diverged.
        RecipeError, UnstableModeError, ValueError: as for ``scales_of`` and ``prepare``.
    """
    recipe, source, known = work.recipe, work.case.source, work.known
    splits = work.splits(part.split, part.judged_by, *(["beyond"] if recipe.data.beyond else []))
    scales = scales_of(work, splits, part.output_scaling)
    checkpoint = work.checkpoints / f"surrogate-{scales.training_key}.pt"
    spent = CpuTime(checkpoint.with_suffix(".cpu_seconds"))
    work = replace(work, progress=spent.counted(work.progress))
    prepared = prepare(work, scales, splits)
    even_out = getattr(recipe.training.expert, "even_out", False)
    relative = known is None and scales.noise is None and not even_out
    shown = ProgressListener(work.progress(part.stage), with_error=relative)
    problem = prepared.problem(splits, checkpoint)
    if prepared.tried:
        begin(recipe, scales.outputs)
    else:

        def sized(table: NetworkTable) -> None:
            begin(recipe.model_copy(update={"network": table}), scales.outputs)

        problem = replace(problem, sized=sized)
    fitted = FITS[type(recipe.network)](problem, prepared.table, recipe.training, shown)
    history = replace(fitted.history, cpu_seconds=spent.keep(), relative=relative)
    surrogate = Surrogate(
        recipe.name,
        recipe.window.as_window,
        source.inputs,
        source.outputs,
        work.offered.scaling,
        scales.outputs,
        fitted.network,
        output_ranges=learnt_ranges(splits[0].outputs),
    )
    resolved = recipe.model_copy(update={"network": fitted.table})
    histories = {**prepared.tried, part.stage: history}
    return Fit(with_stable_cubes(surrogate, work.case), histories, resolved)


def learnt_ranges(outputs: FloatArray) -> FloatArray:
    """Return the ranges of outputs, (n_trajectories, N, n_outputs), as (n_outputs, 2) values.

    They are wider by ``RANGE_MARGIN`` of their width, for the errors of a surrogate.
    """
    low, high = (extreme(outputs, axis=(0, 1)) for extreme in (np.nanmin, np.nanmax))
    margin = RANGE_MARGIN * (high - low)
    return np.stack([low - margin, high + margin], axis=1)
