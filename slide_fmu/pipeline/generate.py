"""The trajectories of a recipe are made by one program, or by several that share a store."""

from __future__ import annotations

from contextlib import nullcontext

from slide_fmu.data.workplace import Workplace
from slide_fmu.pipeline.job import Job, checked
from slide_fmu.pipeline.stages import DataFigures, check_window, choose_numbers, generate_data


def generate_recipe(
    job: Job, workers: int | None, executor: str | None, overwrite: bool
) -> DataFigures:
    """Make the trajectories of a recipe, and return the figures of ``generate_data``.

    Several programs may do so in one run folder. To find numbers that the recipe leaves open, or
    to remove a store, a program must be alone there.

    Args:
        job: the recipe and its run folder.
        workers: number of processes of this machine; one per core if None.
        executor: address of a cluster, ``dask://HOST:PORT``; None for this machine.
        overwrite: whether data that are there are made again.

    Raises:
        ClaimError: the disk cannot lock files.
        ClusterError: the cluster cannot be used.
        LoadError, RecipeError, ShortWindowError, SimulationError, StoreError, TrainingError: as
            of ``check_window``, ``choose_numbers`` and ``generate_data``.
        StageError: another program works in the run folder alone.
        ValueError: workers and executor do not go together, or the address is of another form.
    """
    place = Workplace(workers, executor)
    job = checked(job)
    check_window(job)
    is_open = "data.train" in job.recipe.automatic
    with job.folder.alone() if is_open or overwrite else nullcontext():
        job = choose_numbers(job, place, overwrite)
    with job.folder.together(job.bar):
        return generate_data(job, place)
