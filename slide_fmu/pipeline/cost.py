"""What very many simulations will cost, from a short measurement of a few."""

from __future__ import annotations

import math
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from slide_fmu.core.files import writing
from slide_fmu.core.signals import Trajectory
from slide_fmu.data.claims import claimed
from slide_fmu.data.draws import draw, simulate_draw, split_stream
from slide_fmu.data.generation import job_size, shapes_of
from slide_fmu.data.identity import identity
from slide_fmu.data.parameter_draws import as_row, drawn_parameters, system_at
from slide_fmu.data.pool import as_done
from slide_fmu.data.store import is_done, missing_trajectories, open_store, write_trajectory
from slide_fmu.data.workplace import Workplace
from slide_fmu.memory.failing import Tolerance
from slide_fmu.pipeline.checks import check_recipe, guarded_recipe
from slide_fmu.pipeline.job import Job
from slide_fmu.pipeline.numbers import least_numbers
from slide_fmu.recipe.reading import with_resolved
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.recipe.systems import recipe_source, recipe_system
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError

TIMED = 3.0
"""Trajectories are simulated for at least this CPU time in s; one that takes longer is enough."""
WRITTEN = 40
"""So many trajectories are written, to say how long one takes."""
HANDED_OUT = 400
"""So many empty jobs are handed out, to say how long one takes."""


@dataclass(frozen=True)
class Cost:
    """The cost of one trajectory, as it was measured here.

    Attributes:
        simulated_time_s: its length in s, with the lead-in.
        simulate_s: CPU time of its simulation in s.
        write_s: time in s to claim and write it.
        look_s: time in s to see that it is in the store, when a generation goes on.
        job_s: time in s of the one process that hands out jobs, for each job.
        bytes: size in the store.
        files: files and folders in the store.
    """

    simulated_time_s: float
    simulate_s: float
    write_s: float
    look_s: float
    job_s: float
    bytes: float
    files: float

    @property
    def core_s(self) -> float:
        """Time of a core in s that a trajectory takes, on as many cores as there are."""
        return self.simulate_s + self.write_s

    def serial_s(self, simulations: int) -> float:
        """Time in s of who hands out jobs, for each of so many trajectories."""
        return self.job_s / job_size(simulations)

    def wall_time_s(self, simulations: int, cores: int) -> float:
        """Time in s that so many simulations take: of the cores, or of who hands them out."""
        each = max(self.core_s / cores, self.serial_s(simulations))
        return simulations * each + self.core_s  # until the last one has ended


def cost_figures(cost: Cost, simulations: int, cores: int) -> dict[str, Any]:
    """Return what so many simulations cost on so many cores, as plain values.

    Returns:
        The cost of one trajectory; wall time in s, hours of cores that are to be paid, the part
        of them in which they work; size of the store in bytes and its files, of which the disk
        makes so many in a second; the time in s to see
        what is there, should the generation go on when all are; and where it stops scaling: the
        cores that one process keeps busy, those for which so many parts are made (``--shard``),
        and the cores that keep a disk busy that writes one trajectory at a time.
    """
    wall, serial = cost.wall_time_s(simulations, cores), cost.serial_s(simulations)
    return {
        "simulations": simulations,
        "cores": cores,
        "trajectory": asdict(cost),
        "wall_time_s": wall,
        "core_hours": cores * wall / 3600,
        "useful": simulations * cost.core_s / (cores * wall),
        "store_bytes": simulations * cost.bytes,
        "store_files": round(simulations * cost.files),
        "files_per_s": simulations * cost.files / wall,
        "look_again_s": simulations * cost.look_s,
        "stops_scaling": {
            "handing_out_cores": int(cost.core_s / serial),
            "shards_for_all_cores": math.ceil(cores * serial / cost.core_s),
            "serial_disk_cores": int(cost.core_s / cost.write_s),
        },
    }


def measure_cost(job: Job, executor: str | None) -> Cost:
    """Measure what a trajectory of a recipe costs here, on the disk of its run folder.

    Nothing of it is kept. Empty jobs are handed out to the workers of an executor,
    ``dask://HOST:PORT``, or to a process of this machine if None.

    Raises:
        ClusterError: the cluster cannot be used.
        LoadError, RecipeError: as of ``check_recipe``; or the recipe is of records.
        SimulationError: too many trajectories could not be simulated.
    """
    place = Workplace(None if executor else 1, executor)
    source = recipe_source(job.recipe)
    if not isinstance(source, System):
        raise RecipeError(
            f"recipe {job.recipe.name!r} is of records, which cost no simulation; expected one of "
            "a model: slide-fmu try RECIPE tells what its records hold"
        )
    check_recipe(job.recipe)
    name = f"recipe {job.recipe.name!r}"
    recipe = with_resolved(job.recipe, least_numbers(job.recipe, 0.0), name)
    data = recipe.data.model_copy(update={"train": WRITTEN})
    recipe = recipe.model_copy(update={"data": data})
    with _own_folder(job.folder.path) as folder:
        store = str(folder / "data.zarr")
        trajectory = guarded_recipe(recipe, source, _trajectory_cost, store)
    return Cost(**trajectory, job_s=_job_seconds(place))


@contextmanager
def _own_folder(beside: Path) -> Iterator[Path]:
    """Make a folder for the block on the disk of a run folder, which need not be there."""
    with writing(beside):
        beside.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=".cost.", dir=beside))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _trajectory_cost(recipe: Recipe, store: str) -> dict[str, float]:
    """Return what a trajectory costs but for its job, with the names of ``Cost``."""
    system, path = recipe_system(recipe), Path(store)
    open_store(path, recipe, shapes_of(recipe, system), identity(recipe, system))
    empty = _size(path)
    trajectories, simulate_s = _simulated(recipe, system)
    values = as_row(drawn_parameters(recipe, split_stream(recipe, "train", 0), 0))
    begin = time.perf_counter()
    for index in range(WRITTEN):
        with claimed(path, "train", index):
            is_done(path, "train", index)
            trajectory = trajectories[index % len(trajectories)]
            row = values if recipe.parameters else None
            write_trajectory(path, "train", index, trajectory, 0, row)
    write_s = (time.perf_counter() - begin) / WRITTEN
    begin = time.perf_counter()
    missing_trajectories(path, "train", WRITTEN)
    look_s = (time.perf_counter() - begin) / WRITTEN
    full = _size(path)
    return {
        "simulated_time_s": recipe.data.burn_in + recipe.data.duration,
        "simulate_s": simulate_s,
        "write_s": write_s,
        "look_s": look_s,
        "bytes": (full[0] - empty[0]) / WRITTEN,
        "files": (full[1] - empty[1]) / WRITTEN,
    }


def _simulated(recipe: Recipe, system: System) -> tuple[list[Trajectory], float]:
    """Simulate some trajectories to learn from; return them, and the CPU time of one in s.

    Those that fail cost time too.
    """
    tolerance, spent = Tolerance(recipe.data.most_failures), 0.0
    found: list[Trajectory] = []
    while not found or spent < TIMED:
        index, begin = tolerance.tried, time.process_time()
        stream = split_stream(recipe, "train", index)
        parameters = drawn_parameters(recipe, stream, index)
        tolerance.tried += 1
        try:
            at = system_at(recipe, system, parameters)
            found.append(simulate_draw(at, draw(recipe, at, stream, index)))
        except SimulationError as error:
            tolerance.hear(error)
        spent += time.process_time() - begin
    return found, spent / len(found)


def _size(folder: Path) -> tuple[int, int]:
    """Return the bytes of all files in a folder, and the number of files and folders."""
    places = list(folder.rglob("*"))
    return sum(place.stat().st_size for place in places if place.is_file()), len(places)


def _job_seconds(place: Workplace) -> float:
    """Return the time in s that one process needs to hand out a job to one worker process."""
    with place.open() as executor:
        for jobs in (1, HANDED_OUT):  # the first one waits until there is a worker
            begin = time.perf_counter()
            with closing(as_done(executor, _nothing, [()] * jobs)) as answers:
                for _ in answers:
                    pass
    return (time.perf_counter() - begin) / HANDED_OUT


def _nothing() -> None:
    """Do a job that costs nothing."""
