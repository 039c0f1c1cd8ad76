"""What studies of several trainings share: data, trainings, statistics."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slide_fmu import pipeline
from slide_fmu.data.sampling import probe, recipe_system
from slide_fmu.data.store import (
    Layout,
    StoreError,
    missing_trajectories,
    open_store,
    read_split,
    write_trajectory,
)
from slide_fmu.learn.fit import fit_surrogate
from slide_fmu.recipe import SPLITS, Recipe
from slide_fmu.signals import Trajectory
from slide_fmu.surrogate import Surrogate


def surrogate_only(recipe: Recipe, train: int | None = None) -> Recipe:
    """The recipe without its error estimator and the estimator's data.

    Args:
        train: number of trajectories to learn from; the recipe's if None.
    """
    data = recipe.data.model_copy(update={"estimator": 0, "estimator_validation": 0})
    return with_train(recipe.model_copy(update={"data": data, "estimator": None}), train)


def with_train(recipe: Recipe, train: int | None) -> Recipe:
    """The recipe with another number of trajectories to learn from; its own if None."""
    if train is None:
        return recipe
    return recipe.model_copy(update={"data": recipe.data.model_copy(update={"train": train})})


def first_trajectories(recipe: Recipe, whole: Path, folder: Path) -> Path:
    """The store of a recipe, its trajectories copied from one that holds more of them.

    What trajectory ``i`` of a split is depends on seed, split and ``i`` alone: these are the
    trajectories that the recipe would generate.

    Args:
        recipe: as the one that made the whole store, but for the numbers of trajectories.
        whole: the store to copy from.
        folder: holds the copy, which is made once.

    Returns:
        Path of the copy.

    Raises:
        StoreError: the whole store has fewer trajectories, or the copy is of another recipe.
    """
    folder.mkdir(parents=True, exist_ok=True)
    store, system = folder / f"train_{recipe.data.train}.zarr", recipe_system(recipe)
    n_samples = round(recipe.data.duration / recipe.window.step)
    layout = Layout(n_samples, len(system.inputs), len(system.outputs))
    open_store(store, recipe, layout, probe(recipe, system))
    for split in SPLITS:
        missing = missing_trajectories(store, split)
        if missing:
            _copy(split, missing, whole, store, system.step)
    return store


def _copy(split: str, indices: list[int], whole: Path, store: Path, step: float) -> None:
    source = read_split(whole, split)
    if len(source.inputs) <= max(indices):
        raise StoreError(
            f"{whole}: {len(source.inputs)} trajectories of split {split!r}; expected at least "
            f"{max(indices) + 1}: ask for fewer, or generate more"
        )
    for index in indices:
        trajectory = Trajectory(step, source.inputs[index], source.outputs[index])
        write_trajectory(store, split, index, trajectory, int(source.kinds[index]))


def trained(recipe: Recipe, store: Path, title: str, bar: pipeline.Bar) -> tuple[Surrogate, float]:
    """Train from the start: checkpoints of earlier trainings would cost nothing.

    Args:
        title: of the progress bars.

    Returns:
        The surrogate, and the CPU time of its training in s.
    """
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as checkpoints:
        fit = fit_surrogate(
            recipe,
            recipe_system(recipe),
            store,
            Path(checkpoints),
            lambda stage: _stage_progress(bar(f"{stage}, {title}")),
        )
    return fit.surrogate, time.process_time() - begin


def _stage_progress(advance: pipeline.Advance) -> Any:
    """Progress of a training on a bar."""
    return lambda done, total, best: advance(done, total, f"validation RMSE {best:.3g}")


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
