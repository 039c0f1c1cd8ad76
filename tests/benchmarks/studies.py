"""What studies of several trainings share: trainings that stay, statistics."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import write_figures
from numpy.typing import ArrayLike

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.data.pool import in_parallel, process_pool
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.fitting.preparation import Work
from slide_fmu.pipeline.run_folder import RunFolder
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.payload import VERSION
from slide_fmu.surrogate.surrogate import Surrogate
from tests.progress import no_stages

LEARNT_FROM = {"window", "data", "network", "training", "estimator"}
"""Tables of a recipe that decide, with the model, what is learnt."""


@dataclass(frozen=True, eq=False)
class Trained:
    """A trained surrogate.

    Attributes:
        recipe: what was trained.
        surrogate: the result.
        cpu_seconds: of its training.
    """

    recipe: Recipe
    surrogate: Surrogate
    cpu_seconds: float


def surrogate_only(recipe: Recipe, train: int | None = None) -> Recipe:
    """The recipe without its error estimator and its data, and without error bound.

    Args:
        train: number of trajectories to learn from; the recipe's if None.
    """
    data = recipe.data.model_copy(update={"estimator": 0, "estimator_validation": 0})
    validation = recipe.validation.model_copy(update={"adversarial": 0})
    changes = {"data": data, "validation": validation, "estimator": None, "bound": None}
    return with_train(recipe.model_copy(update=changes), train)


def with_train(recipe: Recipe, train: int | None) -> Recipe:
    """The recipe with another number of trajectories to learn from; its own if None."""
    if train is None:
        return recipe
    return recipe.model_copy(update={"data": recipe.data.model_copy(update={"train": train})})


def training_key(recipe: Recipe) -> str:
    """Digest of what a training depends on, the code aside."""
    system = recipe.system.model_dump(mode="json", exclude={"reference"})
    tables = recipe.model_dump(mode="json", include=LEARNT_FROM)
    text = json.dumps([system, tables, VERSION], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def trained(
    recipes: Mapping[str, Recipe], folder: RunFolder, workers: int, bar: Stages
) -> list[Trained]:
    """Train what is not in ``trainings`` of the run folder yet; what is finished stays there.

    Args:
        recipes: by title; all read the run folder's trajectories.
        workers: trainings at the same time, one thread each. They slow each other down, and so
            take more CPU time.

    Returns:
        In the order of the recipes.
    """
    missing = {title: one for title, one in recipes.items() if not _is_kept(folder, one)}
    if workers == 1:
        for title, recipe in missing.items():
            _train(recipe, folder, partial(_stages, bar, title))
    elif missing:
        _train_at_once(missing, folder, workers, bar("trainings"))
    return [_finished(recipe, folder) for recipe in recipes.values()]


def _train_at_once(
    recipes: Mapping[str, Recipe],
    folder: RunFolder,
    workers: int,
    advance: Progress,
) -> None:
    """Train in processes of their own, the longest first."""
    order = sorted(recipes, key=lambda title: -recipes[title].data.train)
    with process_pool(workers) as pool:
        advance(0, len(order))
        jobs = [(recipes[title], folder, no_stages) for title in order]
        in_parallel(pool, _train, jobs, lambda done: advance(done, len(order)))


def _train(recipe: Recipe, folder: RunFolder, progress: Stages) -> None:
    torch.set_num_threads(1)
    kept = _kept(folder, recipe)
    kept.parent.mkdir(exist_ok=True)
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as checkpoints:  # earlier ones would cost nothing
        work = Work(case_of(recipe), folder.trajectories, Path(checkpoints), progress)
        fit = fit_surrogate(work)
    fit.surrogate.save(kept.with_suffix(".slide"))
    figures = {
        "training_cpu_seconds": time.process_time() - begin,
        "motion": _motion(recipe, folder),
    }
    staged = kept.with_suffix(f".{os.getpid()}")
    write_figures(figures, str(staged))
    staged.rename(kept)  # last: the sign that it is whole


def _finished(recipe: Recipe, folder: RunFolder) -> Trained:
    kept = _kept(folder, recipe)
    seconds = json.loads(kept.read_text(encoding="utf-8"))["training_cpu_seconds"]
    return Trained(recipe, Surrogate.from_bytes(kept.with_suffix(".slide").read_bytes()), seconds)


def _is_kept(folder: RunFolder, recipe: Recipe) -> bool:
    """Whether this was trained before, on trajectories of the same model."""
    kept = _kept(folder, recipe)
    if not (kept.exists() and kept.with_suffix(".slide").exists()):
        return False
    figures = json.loads(kept.read_text(encoding="utf-8"))
    return bool(figures["motion"] == _motion(recipe, folder))


def _motion(recipe: Recipe, folder: RunFolder) -> str:
    """Digest of the first trajectory that is learnt from: it changes with the model."""
    first = Trajectories.of(case_of(recipe), folder.trajectories).read("train", 1)
    return hashlib.sha256(first.inputs.tobytes() + first.outputs.tobytes()).hexdigest()[:16]


def _kept(folder: RunFolder, recipe: Recipe) -> Path:
    return folder.path / "trainings" / f"{training_key(recipe)}.json"


def _stages(bar: Stages, title: str, stage: str) -> Any:
    """Progress of a stage of a training on a bar."""
    return bar(f"{stage}, {title}")


def positive(text: str) -> int:
    """A number of an option from 1 on; with argparse the option's name is told."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value}; expected 1 or more")
    return value


def simulated_seconds(recipe: Recipe) -> float:
    """Simulated time that a surrogate learns from, in s."""
    return recipe.data.train * recipe.data.duration


def statistics(values: ArrayLike) -> dict[str, float]:
    """Plain statistics of a vector."""
    found = np.asarray(values, dtype=np.float64)
    return {
        "median": float(np.median(found)),
        "mean": float(np.mean(found)),
        "standard_deviation": float(np.std(found, ddof=1)) if len(found) > 1 else 0.0,
        "smallest": float(np.min(found)),
        "largest": float(np.max(found)),
    }
