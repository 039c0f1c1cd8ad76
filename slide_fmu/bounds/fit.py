"""A recipe and its trajectories are fitted to a surrogate with error estimator and error bound.

The companion of a bound is the same network again, or a larger one, trained on other trajectories.
It shows the scale of the surrogate's error only if it is about as accurate; otherwise the
difference of both is its own error. If it is more accurate, the difference is the surrogate's
error. So a recipe may give it more hidden units and a longer training
(``bound.expert.companion``). Sizes that the recipe leaves open are those found for the surrogate.
A training may end in a worse minimum, so there are several attempts (``bound.expert.attempts``).
Where the training begins with an FMU, the companion begins with that FMU's, once.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from slide_fmu.bounds.error_bound import BOUND, fit_bound
from slide_fmu.bounds.estimate_use import useless_estimate
from slide_fmu.bounds.estimator import fit_estimator
from slide_fmu.bounds.input_forecast import fit_forecast
from slide_fmu.bounds.known_start import companion_start
from slide_fmu.data.trajectories import Split
from slide_fmu.fitting.checkpoint import checkpoint_key
from slide_fmu.fitting.feature_search import STAGE as FEATURES
from slide_fmu.fitting.history import History
from slide_fmu.fitting.network import SURROGATE, Fit, Part, fit_network
from slide_fmu.fitting.preparation import Work, eigenvalues_at_rest
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import FURTHER, SPLITS, Recipe, tables_of_training
from slide_fmu.surrogate.surrogate import Surrogate

OF_ESTIMATOR = "estimator_validation"
"""Name of the split whose trajectories select the estimator's weights."""

COMPANION = "companion"
"""Name of the companion's stage in the progress and in the figures."""

ACCURATE = 1.3
"""Largest ratio of the validation errors of companion and surrogate. A less accurate companion
makes bounds wider, since its own error is most of the disagreement."""


def fit_surrogate(work: Work) -> Fit:
    """Train the surrogate of a recipe, then its error estimator and its error bound.

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
    fit = _with_forecast(work, fit_network(work))
    if recipe.estimator is not None:
        fit = _with_estimator(work, fit)
    return fit if recipe.bound is None else _with_bound(work, fit)


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
    """Fit the error estimator of a surrogate; omit it if a constant estimates as well."""
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
    estimator, more = fit_estimator(
        surrogate, work.offered, (learnt, validation), recipe, place, work.device, work.progress
    )
    with_estimator = replace(surrogate, estimator=estimator)
    useless = useless_estimate(with_estimator, _in_range(work.recipe, validation))
    histories = fit.histories | _with_remark(more, useless)
    return replace(fit, surrogate=surrogate if useless else with_estimator, histories=histories)


def _in_range(recipe: Recipe, split: Split) -> Split:
    """Return the trajectories in range that selected the estimator; all if there are none."""
    assert recipe.estimator is not None
    beyond = partial(rules_of(recipe).draws_beyond, recipe.estimator)
    kept = [i for i in range(len(split.inputs)) if not beyond(i)]
    parts = {name: values[kept] for name, values in vars(split).items() if values is not None}
    return Split(**parts) if kept else split


def _with_bound(work: Work, fit: Fit) -> Fit:
    """Fit the companion, then the bound of a surrogate; omit an error estimate without use."""
    recipe, surrogate = work.recipe, fit.surrogate
    assert recipe.bound is not None
    fitted, course = _fit_companion(work, fit)
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


def _fit_companion(work: Work, fit: Fit) -> tuple[Surrogate, History]:
    """Fit the companion of a surrogate; return the most accurate of all attempts."""
    recipe, surrogate = work.recipe, fit.surrogate
    assert recipe.bound is not None
    split = "train" if recipe.data.companion == "train" else "companion"
    accurate = ACCURATE * min(fit.histories[SURROGATE].validation_error)
    # if features were searched, the companion searches them too, with its own sizes
    searched = any(name.startswith(FEATURES) for name in fit.histories)
    sized = recipe if searched else fit.recipe
    attempts: list[tuple[float, Surrogate, History]] = []
    known = None if work.known is None else companion_start(work.known)
    for attempt in range(recipe.bound.expert.attempts if known is None else 1):
        stage = COMPANION if attempt == 0 else f"{COMPANION}, attempt {attempt + 1}"
        part = Part(stage, split, "validation", surrogate.output_scaling)
        case = work.case.with_recipe(sized.of_companion(attempt))
        other = fit_network(replace(work, case=case, known=known), part)
        history = other.histories[stage]
        error = min(history.validation_error)
        attempts.append((error, other.surrogate, history))
        if error <= accurate:
            break
    _, companion, history = min(attempts, key=lambda one: one[0])
    return companion, history
