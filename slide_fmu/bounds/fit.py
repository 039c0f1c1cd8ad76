"""A recipe and its trajectories are fitted to a surrogate with error estimator and error bound."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from slide_fmu.bounds.companion import COMPANION, Attempt, Companion
from slide_fmu.bounds.error_bound import BOUND, fit_bound
from slide_fmu.bounds.estimate_use import useless_estimate
from slide_fmu.bounds.estimator import NothingToEstimateError, fit_estimator
from slide_fmu.bounds.input_forecast import fit_forecast
from slide_fmu.data.trajectories import Split
from slide_fmu.fitting.checkpoint import checkpoint_key
from slide_fmu.fitting.history import History
from slide_fmu.fitting.network import Fit, fit_network
from slide_fmu.fitting.preparation import Work, eigenvalues_at_rest
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import FURTHER, SPLITS, Recipe, tables_of_training

OF_ESTIMATOR = "estimator_validation"
"""Name of the split whose trajectories select the estimator's weights."""


def fit_surrogate(work: Work, side_by_side: bool = False) -> Fit:
    """Train the surrogate of a recipe, then its error estimator and its error bound.

    The companion of the bound may be trained next to the surrogate, with the same result
    (``side_by_side``).

    Raises:
        RecipeError: the recipe has open values.
        TrajectoryError: trajectories are missing.
        TrainingError: a training diverged.
        UnstableModeError: a mode of the system linearized at rest grows.
        RecipeError, UrdfError: the recipe's serial chain cannot be read, or is not the system's.
        ValueError: signs are to be flipped of signals that are not symmetric, or a signal never
            moves in the training data.
    """
    recipe = work.recipe
    work.trajectories.require()
    if recipe.bound is None:
        return _fit_alone(work, fit_network(work))
    with Companion(work, side_by_side) as companion:
        fit = _fit_alone(companion.work, fit_network(companion.work, begin=companion.begin))
        return _with_bound(work, fit, companion.of(fit))


def _fit_alone(work: Work, fit: Fit) -> Fit:
    """Complete a fitted network by what needs no bound: forecast and error estimator."""
    fit = _with_forecast(work, fit)
    return fit if work.recipe.estimator is None else _with_estimator(work, fit)


def key_of_surrogate(work: Work) -> str:
    """Return the key of all that decides the result of ``fit_surrogate``.

    Raises:
        TrajectoryError, RecipeError, UrdfError, UnstableModeError: as of ``fit_surrogate``.
    """
    recipe, source, model = work.recipe, work.case.source, work.trajectories.model
    return checkpoint_key(
        tables_of_training(recipe.model_dump(mode="json")),
        (model, source.inputs, source.outputs, source.noise_at_rest, source.sampled_only),
        str(eigenvalues_at_rest(source)) if work.linearized else None,
        work.offered.geometry,
        [checkpoint_key(work.splits(split)) for split in SPLITS if recipe.count(split)],
        work.known and work.known.to_bytes(),
    )


def _with_forecast(work: Work, fit: Fit) -> Fit:
    """Fit the forecast of moving inputs."""
    recipe, source = work.recipe, work.case.source
    (learnt,) = work.splits("train")
    forecast = fit_forecast(source.inputs, learnt.inputs, recipe.window.planned)
    if forecast is None:
        return fit
    sampled = source.sampled_only or recipe.data.substeps > 1
    forecast = replace(forecast, sampled=sampled, jumps=recipe.data.jumps)
    return replace(fit, surrogate=replace(fit.surrogate, forecast=forecast))


def _with_remark(histories: dict[str, History], remark: str | None) -> dict[str, History]:
    """Return histories with a remark in the last one."""
    *_, last = histories
    return {**histories, last: replace(histories[last], remark=remark)}


def _with_estimator(work: Work, fit: Fit) -> Fit:
    """Fit the error estimator of a surrogate.

    It is omitted if a constant estimates as well, or if there are no errors that matter.
    """
    recipe, surrogate = work.recipe.estimator, fit.surrogate
    assert recipe is not None
    learnt, validation = work.splits("estimator", OF_ESTIMATOR)
    key = checkpoint_key(
        surrogate.to_bytes(),
        work.offered.geometry,
        (learnt, validation),
        recipe.model_dump(mode="json"),
    )
    place = work.checkpoints / f"estimator-{key}.pt"
    splits = learnt, validation
    try:
        estimator, more = fit_estimator(
            surrogate, work.offered, splits, recipe, place, work.device, work.progress
        )
    except NothingToEstimateError as error:
        *_, (last, history) = fit.histories.items()
        told = "; ".join(text for text in (history.remark, str(error)) if text is not None)
        return replace(fit, histories={**fit.histories, last: replace(history, remark=told)})
    with_estimator = replace(surrogate, estimator=estimator)
    useless = useless_estimate(with_estimator, _in_range(work.recipe, validation))
    histories = fit.histories | _with_remark(more, useless)
    return replace(fit, surrogate=surrogate if useless else with_estimator, histories=histories)


def _in_range(recipe: Recipe, split: Split) -> Split:
    """Return the trajectories in range that selected the estimator; all if there are none."""
    assert recipe.estimator is not None
    beyond = partial(rules_of(recipe).draws_beyond, recipe.estimator)
    kept = [i for i in range(len(split.inputs)) if not beyond(i)]
    return split.chosen(kept) if kept else split


def _with_bound(work: Work, fit: Fit, attempt: Attempt) -> Fit:
    """Fit the bound of a surrogate and its companion; omit an error estimate without use."""
    recipe, surrogate = work.recipe, fit.surrogate
    assert recipe.bound is not None
    fitted, course = attempt.companion, attempt.history
    companion = fitted.network
    assert isinstance(companion, StateSpace)
    splits = work.splits("bound", "calibration", *([FURTHER] if recipe.further_kinds() else []))
    key = checkpoint_key(
        (surrogate.to_bytes(), fitted.to_bytes()),
        splits,
        recipe.bound.model_dump(mode="json"),
    )
    place = work.checkpoints / f"bound-{key}.pt"
    bound, history = fit_bound(
        surrogate, companion, splits, recipe.bound, place, work.device, work.progress
    )
    surrogate, more = replace(surrogate, bound=bound), {COMPANION: course, BOUND: history}
    if bound.span is not None:
        useless = useless_estimate(surrogate, splits[1])
        more = _with_remark(more, useless)
        if useless:
            surrogate = replace(surrogate, bound=bound.without_estimate())
    return replace(fit, surrogate=surrogate, histories=fit.histories | more)
