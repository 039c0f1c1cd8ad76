"""From a recipe and its trajectories to a surrogate with error estimator and error bound."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import torch

from slide_fmu.core.progress import Stages
from slide_fmu.core.scaling import range_scaling
from slide_fmu.data.identity import identity
from slide_fmu.data.store import Split, read_split, require_origin, require_trajectories
from slide_fmu.features.base import Offered
from slide_fmu.fitting.checkpoint_keys import checkpoint_key, content_of, machine_of
from slide_fmu.fitting.companion import STAGE as COMPANION
from slide_fmu.fitting.companion import fit_companion
from slide_fmu.fitting.error_bound import fit_bound, judges_given
from slide_fmu.fitting.estimate_worth import useless_estimate
from slide_fmu.fitting.estimator import fit_estimator
from slide_fmu.fitting.history import History
from slide_fmu.fitting.network import fit_network
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.recipe import FURTHER, Recipe
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source

OF_ESTIMATOR = "estimator_validation"
"""The estimator's weights are chosen by these trajectories."""

BOUND = "error bound"
"""The stage of the head has this name in the progress and in the figures."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit is a surrogate, and how its trainings went, by stage."""

    surrogate: Surrogate
    histories: dict[str, History]


def fit_surrogate(
    recipe: Recipe,
    system: Source,
    store: Path,
    checkpoints: Path,
    progress: Stages,
    known: Surrogate | None = None,
) -> Fit:
    """Train the surrogate of a recipe, then its error estimator and its error bound.

    The store has the recipe's trajectories; the folder ``checkpoints`` holds the states of
    interrupted trainings. The training begins with the state-space network of ``known``, if that
    is given, and keeps its features and scalings.

    Raises:
        RecipeError: the recipe leaves something to be found.
        StoreError: trajectories are missing, or were made from another recipe or model.
        TrainingError: a training diverged.
        UnstableModeError: a mode of the system linearized at rest grows.
        RecipeError, UrdfError: the recipe's serial chain cannot be read, or is not the system's.
        ValueError: signs shall be flipped of signals that are not symmetric, or a signal never
            moves in the training data.
    """
    recipe.require_resolved()
    require_origin(store, recipe, identity(recipe, system))
    require_trajectories(store, recipe)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    scaling = range_scaling(system.inputs) if known is None else known.input_scaling
    offered = offered_features(recipe, system, scaling)
    surrogate, histories = fit_network(
        recipe, (system, offered, known), (store, checkpoints), device, progress
    )
    machine, places = (system, offered, known), (store, checkpoints)
    if recipe.estimator is not None:
        estimator, more = _fit_estimator(recipe, surrogate, offered, places, device, progress)
        with_estimator = dataclasses.replace(surrogate, estimator=estimator)
        useless = useless_estimate(with_estimator, _in_range(recipe, store))
        surrogate = surrogate if useless else with_estimator
        histories |= with_remark(more, useless)
    if recipe.bound is not None:
        error = min(histories["surrogate"].validation_error)
        bound, more = _fit_bound(recipe, surrogate, error, machine, places, device, progress)
        surrogate = dataclasses.replace(surrogate, bound=bound)
        if surrogate.forecast is not None and judges_given(surrogate):
            judged = dataclasses.replace(surrogate.forecast, judged=True)
            surrogate = dataclasses.replace(surrogate, forecast=judged)
        if bound.span is not None:
            calibration = read_split(store, "calibration", recipe.count("calibration"))
            useless = useless_estimate(surrogate, calibration)
            more = with_remark(more, useless)
            if useless:
                surrogate = dataclasses.replace(surrogate, bound=bound.without_estimate())
        histories |= more
    return Fit(surrogate, histories)


def with_remark(histories: dict[str, History], remark: str | None) -> dict[str, History]:
    """Return histories, the last of which carries a remark."""
    *_, last = histories
    return {**histories, last: dataclasses.replace(histories[last], remark=remark)}


def _in_range(recipe: Recipe, store: Path) -> Split:
    """Return the trajectories in range that chose the estimator; all if there are none."""
    assert recipe.estimator is not None
    split = read_split(store, OF_ESTIMATOR, recipe.count(OF_ESTIMATOR))
    beyond = recipe.estimator.draws_beyond
    kept = [i for i in range(len(split.inputs)) if recipe.system.is_record or not beyond(i)]
    parts = {name: values[kept] for name, values in vars(split).items() if values is not None}
    return Split(**parts) if kept else split


def _fit_estimator(
    recipe: Recipe,
    surrogate: Surrogate,
    offered: Offered,
    places: tuple[Path, Path],
    device: torch.device,
    progress: Stages,
) -> tuple[ErrorEstimator, dict[str, History]]:
    """Fit the error estimator; places are the store and the checkpoints."""
    assert recipe.estimator is not None
    store, checkpoints = places
    learnt, validation = (
        read_split(store, name, recipe.count(name)) for name in ("estimator", OF_ESTIMATOR)
    )
    key = checkpoint_key(
        surrogate.to_bytes().hex(),
        machine_of(offered),
        content_of(learnt),
        content_of(validation),
        recipe.estimator.model_dump(mode="json"),
    )
    place, splits = checkpoints / f"estimator-{key}.pt", (learnt, validation)
    return fit_estimator(surrogate, offered, splits, recipe.estimator, place, device, progress)


def _fit_bound(
    recipe: Recipe,
    surrogate: Surrogate,
    error: float,
    machine: tuple[Source, Offered, Surrogate | None],
    places: tuple[Path, Path],
    device: torch.device,
    progress: Stages,
) -> tuple[ErrorBound, dict[str, History]]:
    """Fit the companion, then the bound of a surrogate with a validation error.

    Machine and places are as of ``fit_network``.
    """
    assert recipe.bound is not None
    store, checkpoints = places
    fitted, course = fit_companion(recipe, surrogate, error, machine, places, device, progress)
    companion = fitted.network
    assert isinstance(companion, StateSpace)
    names = "bound", "calibration", *([FURTHER] if recipe.further_kinds() else [])
    splits = [read_split(store, name, recipe.count(name)) for name in names]
    key = checkpoint_key(
        surrogate.to_bytes().hex(),
        fitted.to_bytes().hex(),
        *(content_of(split) for split in splits),
        recipe.bound.model_dump(mode="json"),
    )
    place = checkpoints / f"bound-{key}.pt"
    bound, history = fit_bound(
        surrogate, companion, splits, recipe.bound, place, device, progress(BOUND)
    )
    return bound, {COMPANION: course, BOUND: history}
