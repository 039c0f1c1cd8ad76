"""Trajectories are made by processes of this machine, or by a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.data import pool
from slide_fmu.data.cluster import cluster, scheduler_of
from slide_fmu.data.generation import generate
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.records.either import either


@dataclass(frozen=True)
class Workplace:
    """A workplace makes trajectories, with processes of this machine or with a cluster.

    Attributes:
        workers: number of processes of this machine; one per core if None, none if 0.
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

    def make(self, case: Case, beside: Path | None, store: Path, progress: Progress) -> int:
        """Make a recipe's trajectories in a store, and return how many were made here.

        Args:
            case: the recipe whose trajectories are made.
            beside: folder of the recipe; None where it lies in none.
            store: place of the store.
            progress: shows how many are there.

        Raises:
            ClusterError: the cluster cannot be used.
            RecipeError: records are asked to be made elsewhere.
            StoreError, SimulationError: as of ``generate``.
        """
        elsewhere = self.executor is not None
        if elsewhere and either(case.source, lambda _: False, lambda _: True):
            raise RecipeError(
                f"recipe {case.recipe.name!r} is of records, which are cut and not simulated; "
                f"expected no --executor {self.executor}: leave it out"
            )
        with self.open() as executor:
            folder = (beside or Path()) if elsewhere else None
            return generate(case, store, executor, progress, folder)
