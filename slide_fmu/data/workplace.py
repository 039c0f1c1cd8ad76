"""A workplace makes trajectories by processes of this machine, or by a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.data import pool
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.cluster import cluster, scheduler_of
from slide_fmu.data.generation import generate
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System


@dataclass(frozen=True)
class Workplace:
    """A workplace makes trajectories, with processes of this machine or with a cluster.

    Attributes:
        workers: number of processes of this machine; one per core if None, 0 for no processes.
        executor: address of a cluster, ``dask://HOST:PORT``; None for this machine.
    """

    workers: int | None = None
    executor: str | None = None

    def __post_init__(self) -> None:
        if self.executor is None:
            return
        scheduler_of(self.executor)
        if self.workers is not None:
            raise ValueError(
                f"--workers {self.workers} and --executor {self.executor}; expected one of them, "
                "since a cluster has its own workers: leave --workers out"
            )

    @contextmanager
    def open(self) -> Iterator[Executor | None]:
        """Open the processes, or the connection to the cluster, for the block.

        Raises:
            ClusterError: the cluster cannot be used.
        """
        if self.executor is None:
            with pool.process_pool(self.workers) as executor:
                yield executor
        else:
            with cluster(self.executor) as executor:
                yield executor

    def make(
        self, case: Case, recipe_folder: Path | None, trajectories: Path, progress: Progress
    ) -> int:
        """Make a recipe's trajectories in a folder, and return how many were made here.

        Args:
            case: the recipe whose trajectories are made.
            recipe_folder: folder of the recipe; None for a recipe that is not a file.
            trajectories: folder of the trajectories.
            progress: shows how many are there.

        Raises:
            ClusterError: the cluster cannot be used.
            RecipeError: as in ``require_work_elsewhere``.
            SimulationError: as in ``generate``.
        """
        elsewhere = self.executor is not None
        if self.executor is not None:
            require_work_elsewhere(case.source, case.recipe, self.executor)
        with self.open() as executor:
            folder = (recipe_folder or Path()) if elsewhere else None
            return generate(case, trajectories, executor, progress, folder)


@asked_of_sources
def require_work_elsewhere(system: System, recipe: Recipe, executor: str) -> None:
    """Refuse a cluster, by its address, for trajectories that no other machine can make.

    Raises:
        RecipeError: the recipe has records, which are not simulated.
    """
