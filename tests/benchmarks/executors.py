"""How much faster two workers make trajectories than one, as processes and in a Dask cluster.

    PYTHONPATH=. python tests/benchmarks/executors.py training/slider_crank.toml

Each case makes the same trajectories in a folder of its own, with workers that have made some
before, so that starting them does not count; given are wall time in s and speed-up over one worker
of the same kind. In the last case one of two workers is killed in the midst. All folders must have
the same hash. On a machine that does other work the times say little.
"""

from __future__ import annotations

import argparse
import os
import signal
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed
from figures_out import write_figures

from slide_fmu.data.generation import generate
from slide_fmu.data.workplace import Workplace
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.recipe.recipe import Recipe
from tests.folder_digest import folder_digest

CASES = {
    "one process": (1, False, False),
    "two processes": (2, False, False),
    "one Dask worker": (1, True, False),
    "two Dask workers": (2, True, False),
    "two Dask workers, one killed": (2, True, True),
}
"""Number of workers, whether they are those of a cluster, whether one is killed."""
WARM = 4
"""So many trajectories of another folder are made before."""


def with_trajectories(recipe: Recipe, count: int) -> Recipe:
    """Return a recipe with so many trajectories, of which one is to validate with."""
    data = recipe.data.model_copy(update={"train": count - 1, "validation": 1, "beyond": 0})
    validation = recipe.validation.model_copy(update={"adversarial": 0})
    changes = {"data": data, "validation": validation, "estimator": None, "bound": None}
    return recipe.model_copy(update=changes)


@contextmanager
def opened(workers: int, is_cluster: bool) -> Iterator[tuple[Executor | None, Any]]:
    """Open an executor, with the cluster that it belongs to or None."""
    if not is_cluster:
        with Workplace(workers).open() as executor:
            yield executor, None
        return
    with distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        silence_logs="CRITICAL",
    ) as cluster:
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        with Workplace(executor=address).open() as executor:
            yield executor, cluster


def measure(recipe: Recipe, beside: Path, count: int, name: str, folder: Path) -> dict[str, Any]:
    """Make the trajectories as a case does; return its time, and the hash of its folder."""
    workers, is_cluster, is_killed = CASES[name]
    here = beside if is_cluster else None
    with opened(workers, is_cluster) as (executor, cluster):
        warm = folder / "warm" / "trajectories"
        generate(
            case_of(with_trajectories(recipe, WARM)),
            warm,
            executor,
            lambda *_: None,
            recipe_folder=here,
        )

        def kill_one(done: int, total: int) -> None:
            if is_killed and done == total // 2:
                os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)

        begin, made_here = time.perf_counter(), folder / "made" / "trajectories"
        made = generate(
            case_of(with_trajectories(recipe, count)),
            made_here,
            executor,
            kill_one,
            recipe_folder=here,
        )
        seconds = time.perf_counter() - begin
    return {
        "workers": workers,
        "wall_time_s": seconds,
        "made": made,
        "hash": folder_digest(made_here),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--trajectories", type=int, default=12)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    recipe, beside = load_recipe(arguments.recipe), arguments.recipe.parent
    found: dict[str, dict[str, Any]] = {}
    for name in CASES:
        with tempfile.TemporaryDirectory() as folder:
            found[name] = measure(recipe, beside, arguments.trajectories, name, Path(folder))
        alone = found["one Dask worker" if CASES[name][1] else "one process"]
        found[name]["speed_up"] = alone["wall_time_s"] / found[name]["wall_time_s"]
    hashes = {case.pop("hash") for case in found.values()}
    figures = {
        "recipe": str(arguments.recipe),
        "trajectories": arguments.trajectories,
        "cases": found,
        "same_hash": len(hashes) == 1,
        "load": os.getloadavg()[0],
        "cores": os.cpu_count(),
    }
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
