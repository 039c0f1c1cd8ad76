"""The features of a state-space network are searched if its recipe leaves them open.

Every choice is briefly fitted to a part of the data, with the same size of network, and the best
is taken.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.progress import ProgressListener, Stages, quiet
from slide_fmu.core.scaling import Affine
from slide_fmu.core.window import Window
from slide_fmu.data.trajectories import Split
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.director import OTHER, kinds_of
from slide_fmu.fitting.checkpoint import checkpoint_key
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.feature_choice import choose_features
from slide_fmu.fitting.history import History
from slide_fmu.fitting.ladder import WORTHWHILE, Ladder
from slide_fmu.fitting.problem import Problem, features_and_outputs
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.recipe.learning import (
    LeastSquaresRecipe,
    NetworkTable,
    StateSpaceRecipe,
    TrainingTable,
)

STAGE = "choice of features"
"""Name of the search in the progress; the names of its histories begin with it."""
SAMPLES = 6_000
"""Approximate number of samples of the trajectories that judge a choice."""
ORDER, HIDDEN = 8, 8
"""Largest order and number of hidden units of the compared networks."""
TURNED_ORDER, TURNED_PAIRS = 12, 4
"""Order of a network in turning axes if the recipe gives none, and its largest number of pairs."""
SHORT = {"starts": 1, "iterations": 6}
SHORT_EXPERT = {"start_iterations": 12, "kept": 1, "kept_iterations": 1, "part": 2}
"""Keys of the training's table ``expert`` that differ from the recipe in these trials."""


@dataclass(frozen=True, eq=False)
class Trials:
    """Trials have the data on which choices of features are tried.

    Attributes:
        offered: the values that features can be formed from.
        window: the surrogate's window.
        splits: trajectories to train on, and others to judge by; the first ones are used, about
            ``SAMPLES`` samples.
        eigenvalues: as in ``Problem``.
        folder: folder of the checkpoints.
    """

    offered: FeatureOffer
    window: Window
    splits: tuple[Split, Split]
    eigenvalues: NDArray[np.complex128] | None
    folder: Path


def choices(
    network: StateSpaceRecipe, offered: FeatureOffer, n_outputs: int
) -> list[StateSpaceRecipe]:
    """Return a network's tables with its open features chosen, one table for each choice.

    For angles, their directions come first; for a serial chain, the loads on its base come next. A
    network that must be odd takes the inputs as they are.
    """
    plain = network.model_copy(update={"drive": ("inputs",)})
    if network.roles_are_named or not network.bias:
        return [network if network.drive else plain]
    tables = [plain]
    kinds = kinds_of(offered.inputs)
    if set(kinds) != {OTHER}:
        others = ("others",) if OTHER in kinds else ()
        drive = ("direction", "turn", "turn_change", *others)
        tables.insert(0, network.model_copy(update={"drive": drive}))
    return tables if offered.chain is None else [*tables, *_of_chain(network, offered, n_outputs)]


def _of_chain(
    network: StateSpaceRecipe, offered: FeatureOffer, n_outputs: int
) -> list[StateSpaceRecipe]:
    """Return choices for a machine with a known serial chain, the richest last."""
    assert offered.chain is not None
    loads = {"drive": ("wrench_change",), "static": ("wrench",)}
    tables = [network.model_copy(update=loads)]
    if network.units != StateSpaceRecipe().units:
        return tables
    scheduled = {
        **loads,
        "units": "gated",
        "gated": ("turned_wrench_change",),
        "schedule": ("turned_inertia", "turned_momentum"),
    }
    tables.append(network.model_copy(update={**scheduled}))
    tables.append(network.model_copy(update={**scheduled, "readout": ("position",)}))
    order = TURNED_ORDER if network.order == "auto" else int(network.order)
    pairs = min(TURNED_PAIRS, order // 2)
    if n_outputs % 3 == 0 and pairs and not offered.chain.prismatic[0]:
        turning = {"readout": ("position",), "turned_pairs": pairs, "order": order, "padding": 0}
        tables.append(network.model_copy(update={**scheduled, **turning}))
    return tables


def search_features(
    network: NetworkTable, training: TrainingTable, trials: Trials, progress: Stages
) -> tuple[NetworkTable, dict[str, History]]:
    """Return the table with its features chosen, and the result of each choice by its name.

    With only one choice there are no trials. Finished trials are read from their checkpoints, also
    if more trajectories were used since.

    Raises:
        TrainingError: no choice has a finite error.
    """
    if not (isinstance(network, StateSpaceRecipe) and isinstance(training, LeastSquaresRecipe)):
        return network, {}
    tables = choices(network, trials.offered, trials.splits[0].outputs.shape[2])
    if len(tables) == 1:
        return tables[0], {}
    learnt, judged = (_first(split) for split in trials.splits)
    trials = dataclasses.replace(trials, splits=(learnt, judged))
    offered = trials.offered.scaling, trials.offered.geometry, str(trials.eigenvalues)
    key = checkpoint_key(trials.window, network, training, offered, learnt, judged)
    show = ProgressListener(progress(STAGE), with_error=not training.expert.even_out)
    tried: dict[int, History | None] = {}

    def error(index: int) -> float:
        """Return the error of a choice, which is infinite if its training diverged."""
        if index not in tried:
            best = min(map(_least_error, tried.values()), default=math.inf)
            show(index, len(tables), best)
            place = trials.folder / f"choice-{key}-{index}.pt"
            tried[index] = _try(tables[index], training, trials, place)
        return _least_error(tried[index])

    ladder = Ladder(
        error=error,
        dearer=lambda index: [index + 1] if index + 1 < len(tables) else [],
        worth=WORTHWHILE,
        named=lambda index: f"'{described(tables[index])}'",
        ahead=lambda index: len(tables),  # a choice says nothing about richer ones: all are tried
    )
    climb = ladder.climb(0)
    show(len(tables), len(tables), error(climb.chosen))
    histories = {
        f"{STAGE}: {described(tables[index])}": history
        if index != climb.chosen
        else dataclasses.replace(history, explanations=(climb.explanation,))
        for index, history in tried.items()
        if history is not None
    }
    if not histories:
        raise TrainingError(
            f"training diverged: none of {len(tables)} choices of features has a finite error; "
            "name the features in the recipe ([network], drive)"
        )
    return tables[climb.chosen], histories


def _least_error(history: History | None) -> float:
    return math.inf if history is None else min(history.validation_error)


def described(table: StateSpaceRecipe) -> str:
    """Describe the features of a network and their roles, for users."""
    parts = {
        "drive": table.drive or (),
        "static": table.static or (),
        "schedule": table.schedule,
        "readout": table.readout,
    }
    words = [f"{part} {', '.join(names)}" for part, names in parts.items() if names]
    return "; ".join([*words, *(["in turning axes"] if table.turned_pairs else [])])


def _try(
    table: StateSpaceRecipe, training: LeastSquaresRecipe, trials: Trials, place: Path
) -> History | None:
    """Fit a choice briefly; return its best error as a history of one entry, or None."""
    most = {"order": ORDER, "hidden": HIDDEN}
    given = {key: getattr(table, key) for key in most}
    sizes = {k: n if given[k] == "auto" else min(n, given[k]) for k, n in most.items()}
    table = table.model_copy(update=sizes)
    expert = training.expert.model_copy(update=SHORT_EXPERT)
    short = training.model_copy(update={**SHORT, "expert": expert})
    learnt, judged = (trials.offered.scaling.apply(split.inputs) for split in trials.splits)
    features = choose_features(table.feature_names(), trials.offered, learnt)
    scaling = _scaling(trials.splits[0])
    training_data, validation = (
        features_and_outputs(features, inputs, scaling.apply(split.outputs))
        for inputs, split in zip((learnt, judged), trials.splits, strict=True)
    )
    problem = Problem(
        trials.window, features, training_data, validation, place, trials.eigenvalues
    )
    try:
        history = fit_state_space(problem, table, short, quiet).history
    except TrainingError:
        return None
    best = int(np.argmin(history.validation_error))
    steps, errors = history.step[best : best + 1], history.training_error[best : best + 1]
    return History(steps, errors, history.validation_error[best : best + 1])


def _first(split: Split) -> Split:
    count = -(-SAMPLES // split.inputs.shape[1])
    return split.chosen(slice(count))


def _scaling(split: Split) -> Affine:
    """Scale outputs by their mean and standard deviation; measured outputs may have gaps."""
    outputs = split.outputs.reshape(-1, split.outputs.shape[2])
    outputs = outputs[np.isfinite(outputs).all(axis=1)]
    return Affine(outputs.mean(0), outputs.std(0))
