"""What a state-space network sees where its recipe leaves that open: tried, and the best kept.

Every choice is fitted shortly to a part of the data, with one size of the network for all.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.core.progress import Heard, Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.store import Split
from slide_fmu.features.base import Offered
from slide_fmu.features.director import OTHER, kinds_of
from slide_fmu.fitting.checkpoint_keys import checkpoint_key, content_of, machine_of
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.family import FITS
from slide_fmu.fitting.feature_choice import choose_features
from slide_fmu.fitting.history import History
from slide_fmu.fitting.problem import Problem
from slide_fmu.recipe.learning import (
    LeastSquaresRecipe,
    NetworkTable,
    StateSpaceRecipe,
    TrainingTable,
)

STAGE = "choice of features"
"""Its progress, and the start of the names of its histories."""
WORTHWHILE = 0.8
"""A later, richer choice is taken when its error is below this part of the one taken before."""
SAMPLES = 6_000
"""A choice is judged on trajectories of about so many samples."""
ORDER, UNITS = 8, 8
"""The networks that are compared have at most this size."""
TURNED_ORDER, TURNED_PAIRS = 12, 4
"""The order of a network in turning axes, where the recipe gives none, and its pairs at most."""
SHORT = {
    "starts": 1,
    "start_iterations": 12,
    "kept": 1,
    "kept_iterations": 1,
    "iterations": 6,
    "part": 2,
}
"""The training of each."""

Values = tuple[FloatArray, FloatArray]
"""Scaled inputs (n_trajectories, N, n_inputs) and outputs (n_trajectories, N + 1, n_outputs)."""


@dataclass(frozen=True, eq=False)
class Trials:
    """This says what the choices are tried on.

    Attributes:
        offered: what features can be formed of.
        window: the surrogate's window.
        splits: trajectories to learn from, and others to judge by; the first ones are used.
        eigenvalues: as of ``Problem``.
        folder: place of the checkpoints.
    """

    offered: Offered
    window: Window
    splits: tuple[Split, Split]
    eigenvalues: NDArray[np.complex128] | None
    folder: Path


def choices(network: StateSpaceRecipe, offered: Offered, n_outputs: int) -> list[StateSpaceRecipe]:
    """Return the tables of a network whose features are left open, one for each choice.

    Angles are taken by their directions first; of a serial chain, the loads on its base come
    next. A network that must be odd sees the inputs as they are.
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
    network: StateSpaceRecipe, offered: Offered, n_outputs: int
) -> list[StateSpaceRecipe]:
    """Choices of a machine whose serial chain is known, the richest last."""
    assert offered.chain is not None
    loads = {"drive": ("wrench_change",), "static": ("wrench",)}
    found = [network.model_copy(update=loads)]
    if network.units != StateSpaceRecipe().units:
        return found
    scheduled = {
        **loads,
        "units": "gated",
        "gated": ("turned_wrench_change",),
        "schedule": ("turned_inertia", "turned_momentum"),
    }
    found.append(network.model_copy(update={**scheduled}))
    found.append(network.model_copy(update={**scheduled, "readout": ("position",)}))
    order = TURNED_ORDER if network.order == "auto" else int(network.order)
    pairs = min(TURNED_PAIRS, order // 2)
    if n_outputs % 3 == 0 and pairs and not offered.chain.prismatic[0]:
        turning = {"readout": ("position",), "turned_pairs": pairs, "order": order, "padding": 0}
        found.append(network.model_copy(update={**scheduled, **turning}))
    return found


def search_features(
    network: NetworkTable, training: TrainingTable, trials: Trials, progress: Stages
) -> tuple[NetworkTable, dict[str, History]]:
    """Return the table with its features chosen, and how each choice did by its name.

    There are no trials where there is but one choice. Trials that were done are read from their
    checkpoints, whatever else has been learnt since from more trajectories.

    Raises:
        TrainingError: no choice has a finite error.
    """
    if not (isinstance(network, StateSpaceRecipe) and isinstance(training, LeastSquaresRecipe)):
        return network, {}
    tables = choices(network, trials.offered, trials.splits[0].outputs.shape[2])
    if training.flip_signs and network.drive is None:
        tables = [table for table in tables if table.drive == ("inputs",)]
    if len(tables) == 1:
        return tables[0], {}
    few = [_first(split) for split in trials.splits]
    about = {"window": dataclasses.asdict(trials.window), "training": training.model_dump()}
    contents = [content_of(split) for split in few]
    key = checkpoint_key(about, contents, machine_of(trials.offered), str(trials.eigenvalues))
    values = _scaled(few, trials.offered)
    show, best = Heard(progress(STAGE), with_error=not training.even_out), math.inf
    taken, histories = tables[0], dict[str, History]()
    for index, table in enumerate(tables):
        show(index, len(tables), best)
        place = trials.folder / f"choice-{key}-{index}.pt"
        history = _try(table, training, (trials, values, place))
        if history is None:
            continue
        histories[f"{STAGE}: {described(table)}"] = history
        error = min(history.validation_error)
        if error < WORTHWHILE * best:
            taken, best = table, error
    show(len(tables), len(tables), best)
    if not histories:
        raise TrainingError(
            f"training diverged: none of {len(tables)} choices of features has a finite error; "
            "name the features in the recipe ([network], drive)"
        )
    return taken, histories


def described(table: StateSpaceRecipe) -> str:
    """Say which features have which part in a network."""
    parts = {
        "drive": table.drive or (),
        "static": table.static or (),
        "schedule": table.schedule,
        "readout": table.readout,
    }
    words = [f"{part} {', '.join(names)}" for part, names in parts.items() if names]
    return "; ".join([*words, *(["in turning axes"] if table.turned_pairs else [])])


def _try(
    table: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    on: tuple[Trials, list[Values], Path],
) -> History | None:
    """Fit a choice shortly; give its best error as a history of one entry, None if it diverges."""
    trials, (learnt, judged), place = on
    most = {"order": ORDER, "hidden": UNITS}
    given = {key: getattr(table, key) for key in most}
    sizes = {k: n if given[k] == "auto" else min(n, given[k]) for k, n in most.items()}
    table, short = table.model_copy(update=sizes), training.model_copy(update=SHORT)
    features = choose_features(table.feature_names(), trials.offered, learnt[0])

    def seen(values: Values) -> tuple[torch.Tensor, torch.Tensor]:
        parts = features.along(values[0]), values[1]
        one, other = (torch.as_tensor(part, dtype=torch.float64) for part in parts)
        return one, other

    data = seen(learnt), seen(judged)
    problem = Problem(trials.window, features, *data, place, trials.eigenvalues)
    try:
        _, history = FITS[StateSpaceRecipe].fit(problem, table, short, _silent)
    except TrainingError:
        return None
    best = int(np.argmin(history.validation_error))
    steps, errors = history.step[best : best + 1], history.training_error[best : best + 1]
    return History(steps, errors, history.validation_error[best : best + 1])


def _first(split: Split) -> Split:
    """The first trajectories, of about ``SAMPLES`` samples."""
    count = -(-SAMPLES // split.inputs.shape[1])
    return Split(split.inputs[:count], split.outputs[:count], split.kinds[:count])


def _scaled(few: list[Split], offered: Offered) -> list[Values]:
    """Values of the splits, outputs about their mean over their standard deviation."""
    outputs = few[0].outputs.reshape(-1, few[0].outputs.shape[2])
    outputs = outputs[np.isfinite(outputs).all(axis=1)]
    mean, deviation = outputs.mean(0), outputs.std(0)
    return [
        (offered.scaling.apply(split.inputs), (split.outputs - mean) / deviation) for split in few
    ]


def _silent(done: int, total: int, error: float | None = None) -> None:
    """Take in a progress that is not shown: that of the trials is."""
