"""Before the training the recipe is checked, the window sized, and the data made."""

from __future__ import annotations

import time
from typing import Any

from slide_fmu.memory.sizing import Sizing, require_window, size_window
from slide_fmu.pipeline.job import Job
from slide_fmu.recipe.against_system import require_features
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.recipe.systems import recipe_system, reference_system


def check_recipe(recipe: Recipe) -> None:
    """Refuse what can be found wrong without data, before any are made.

    Raises:
        LoadError: one of the recipe's systems cannot be made.
        RecipeError: they do not fit each other or the excitation, or a network sees what the
            system has not.
    """
    reference_system(recipe)
    require_features(recipe, recipe_system(recipe))


def size_recipe(job: Job, seed: int | None = None) -> Sizing:
    """Return the decay times of the recipe's system along its motions, of a seed or the data's.

    Raises:
        LoadError, RecipeError: as of ``check_recipe``.
    """
    check_recipe(job.recipe)
    return size_window(job.recipe, recipe_system(job.recipe), seed)


def check_window(job: Job) -> Sizing:
    """Check the recipe, compute the decay times, and refuse a window that is too short.

    Raises:
        LoadError, RecipeError: as of ``check_recipe``.
        ShortWindowError: the window is too short for the system.
    """
    sizing = size_recipe(job)
    require_window(job.recipe, sizing)
    return sizing


def generate_data(job: Job, workers: int | None, overwrite: bool) -> dict[str, Any]:
    """Make all trajectories that are not in the store yet.

    Returns:
        Numbers of trajectories by split, the simulated time in s, and how many of them were made
        now in which time.

    Raises:
        LoadError, RecipeError: as of ``check_recipe``.
        StoreError: the store was made from other values.
    """
    from slide_fmu.data.generation import generate
    from slide_fmu.data.pool import process_pool
    from slide_fmu.data.store import remove_store

    check_recipe(job.recipe)
    if overwrite:
        remove_store(job.folder.store)
    job.folder.path.mkdir(parents=True, exist_ok=True)
    progress = job.bar("trajectories")
    begin = time.monotonic()
    with process_pool(workers) as pool:
        made = generate(job.recipe, job.folder.store, pool, progress)
    counts = {split: job.recipe.count(split) for split in SPLITS}
    simulated = sum(counts.values()) * (job.recipe.data.duration + job.recipe.data.burn_in)
    return {
        "trajectories": counts,
        "simulated_time_s": simulated,
        "made_now": made,
        "wall_time_s": time.monotonic() - begin,
        "seed": job.recipe.data.seed,
    }
