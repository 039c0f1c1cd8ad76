"""Workers of a Dask cluster make the same trajectories, whatever happens to them."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import distributed
import pytest

from slide_fmu.data import cluster as cluster_module
from slide_fmu.data import generation
from slide_fmu.data.cluster import ClusterError, cluster, scheduler_of
from slide_fmu.data.generation import Order, make_ordered
from slide_fmu.data.model_answers import identity, model_key
from slide_fmu.data.workplace import Workplace
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.errors import SimulationError
from tests.data.logging_system import LOG
from tests.data.test_failures import failing
from tests.data.test_generation import LONG, PROBED, SMALL, identities, made_in, wait_until
from tests.folder_digest import folder_digest
from tests.limits import HANGS
from tests.own_records import RECIPE, write_record
from tests.progress import silent
from tests.refusals import refused

Program = subprocess.Popen[bytes]

NOBODY = "dask://127.0.0.1:9"
"""Nothing listens there."""


@pytest.fixture(scope="module")
def log_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("log")


@pytest.fixture(scope="module")
def scheduler(log_folder: Path) -> Iterator[Any]:
    """A cluster of two worker processes, started once, which log what they simulate."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(LOG, str(log_folder / "log"))
        with distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            silence_logs="CRITICAL",
        ) as local_cluster:
            yield local_cluster


def address_of(local_cluster: Any) -> str:
    return str(local_cluster.scheduler_address).replace("tcp://", "dask://")


def logged(folder: Path) -> list[str]:
    """Trajectories that were simulated, without the motion that shows a changed model."""
    return [line for line in (folder / "log").read_text().splitlines() if line != PROBED]


@pytest.mark.parametrize(
    "text", ["127.0.0.1:8786", "tcp://127.0.0.1:8786", "dask://host", "dask://:1", "dask://a:b"]
)
def test_address_of_another_form_is_refused(text: str) -> None:
    with refused(ValueError, "expected dask://HOST:PORT"):
        Workplace(executor=text)


def test_address_is_that_of_the_scheduler() -> None:
    assert scheduler_of("dask://node-1.cluster:8786") == "tcp://node-1.cluster:8786"
    assert scheduler_of("dask://[::1]:8786") == "tcp://[::1]:8786"


def test_number_of_workers_of_a_cluster_is_refused() -> None:
    with refused(ValueError, "--workers 2 and --executor", "leave --workers out"):
        Workplace(workers=2, executor=NOBODY)


def test_records_are_not_made_elsewhere(tmp_path: Path) -> None:
    file = write_record(tmp_path / "bench.csv")
    records = parse_open_recipe(RECIPE.replace("bench.csv", str(file)), "bench.toml").guess
    with refused(RecipeError, "is of records", "no --executor"):
        Workplace(executor=NOBODY).make(case_of(records), None, tmp_path / "trajectories", silent)


def test_missing_package_is_named_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    expected = r"needs the package 'distributed'.*pip install 'slide-fmu\[cluster\]'"
    with pytest.raises(ClusterError, match=expected), cluster(NOBODY):
        pass


@pytest.mark.extended
def test_scheduler_that_is_not_there_is_told_in_a_bounded_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cluster_module, "CONNECT", 1.0)
    begin = time.monotonic()
    expected = r"127\.0\.0\.1:9' does not answer within 1 s .*start one \(dask scheduler"
    with pytest.raises(ClusterError, match=expected), cluster(NOBODY):
        pass
    assert time.monotonic() - begin < 30.0


def order_of(folder: Path, factor: float) -> Order:
    """An order for workers elsewhere; the model may have answered otherwise where it was made."""
    recipe, trajectories = SMALL, folder / "trajectories"
    case = case_of(recipe)
    model = model_key(trajectories, factor * identity(case.source, recipe))
    return Order(pickle.dumps(case), str(trajectories), model, str(folder))


def test_worker_with_another_model_makes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))
    same, other = (order_of(tmp_path / name, f) for name, f in (("a", 1.0), ("b", 1.1)))
    assert make_ordered(same, (("train", 0),)).made == 1
    with refused(ClusterError, "the worker on", "simulates another motion than"):
        make_ordered(other, (("train", 0),))


def test_worker_that_does_not_see_the_disk_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(generation, "APPEARS", 0.0)
    place = str(tmp_path / "trajectories")
    order = Order(pickle.dumps(case_of(SMALL)), place, "model", str(tmp_path))
    with refused(ClusterError, "does not see", "trajectories'; expected a disk"):
        make_ordered(order, (("train", 0),))


@pytest.mark.extended
def test_mistake_in_a_worker_is_told_here(tmp_path: Path, scheduler: Any) -> None:
    with refused(SimulationError, "1 may fail", "be simulated"):
        Workplace(executor=address_of(scheduler)).make(
            case_of(failing(0.02, fail=0.9)), None, tmp_path / "trajectories", silent
        )


@pytest.mark.extended
def test_killed_worker_repeats_nothing_that_was_finished(
    tmp_path: Path, log_folder: Path, scheduler: Any
) -> None:
    killed: list[int] = []
    at_kill: list[int] = []

    def kill_in_the_midst(done: int, total: int) -> None:
        if done == 20:
            nanny = next(iter(scheduler.workers.values()))
            killed.append(nanny.pid)
            os.kill(killed[0], signal.SIGKILL)
            at_kill.append(len(logged(log_folder)))

    folder = tmp_path / "cluster" / "trajectories"
    Workplace(executor=address_of(scheduler)).make(case_of(LONG), None, folder, kill_in_the_midst)
    assert killed
    lines = logged(log_folder)
    assert 20 <= at_kill[0] < 60
    assert set(lines) == set(identities().values())
    assert len(lines) - len(set(lines)) <= 1  # what it simulated when it was killed

    Workplace(2).make(case_of(LONG), None, tmp_path / "pool" / "trajectories", silent)
    assert folder_digest(folder) == folder_digest(tmp_path / "pool" / "trajectories")


@pytest.mark.extended
def test_model_that_ends_its_workers_is_told(
    tmp_path: Path, scheduler: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "ALONE", 20.0)  # a busy machine may not start them again
    with refused(ClusterError, "workers", "a model that does not end its process"):
        Workplace(executor=address_of(scheduler)).make(
            case_of(failing(crash=0.99)), None, tmp_path / "trajectories", silent
        )


@pytest.mark.extended
def test_scheduler_that_dies_ends_the_work_with_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(LOG, str(tmp_path / "log"))
    with programs_of_dask(tmp_path) as (address, scheduler, _):

        def kill_scheduler(done: int, total: int) -> None:
            if done == 5:
                scheduler.kill()

        with refused(ClusterError, "the connection", "again"):
            Workplace(executor=address).make(
                case_of(LONG), None, tmp_path / "trajectories", kill_scheduler
            )
    assert len(made_in(tmp_path / "trajectories").missing()) <= 65


@pytest.mark.extended
def test_workers_that_all_went_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LOG, str(tmp_path / "log"))
    monkeypatch.setattr(cluster_module, "ALONE", 2.0)
    monkeypatch.setattr(cluster_module, "LOOK", 0.5)
    with programs_of_dask(tmp_path) as (address, _, worker_program):

        def kill_worker(done: int, total: int) -> None:
            if done == 5:
                os.killpg(worker_program.pid, signal.SIGKILL)

        with refused(ClusterError, "none came within 2 s", "start workers", "made stay"):
            Workplace(executor=address).make(
                case_of(LONG), None, tmp_path / "trajectories", kill_worker
            )
    assert len(made_in(tmp_path / "trajectories").missing()) <= 65


@contextmanager
def programs_of_dask(folder: Path) -> Iterator[tuple[str, Program, Program]]:
    """A scheduler and a worker as users start them, and the scheduler's address."""
    file = folder / "scheduler.json"
    common = ("--scheduler-file", str(file), "--no-dashboard")
    with ExitStack() as programs:
        scheduler, worker_program = (
            programs.enter_context(running("dask", name, *common, *options))
            for name, options in (
                ("scheduler", ("--host", "127.0.0.1", "--port", "0")),
                ("worker", ("--nthreads", "1")),
            )
        )
        wait_until(lambda: file.exists() and _is_json(file), "no scheduler")
        address = json.loads(file.read_text())["address"].replace("tcp://", "dask://")
        yield address, scheduler, worker_program


def _is_json(file: Path) -> bool:
    """Say whether a file is written to its end, which Dask does in several steps."""
    try:
        json.loads(file.read_text())
    except json.JSONDecodeError:
        return False
    return True


@contextmanager
def running(*module: str) -> Iterator[Program]:
    """Run a module of Python, and what it starts, during the block."""
    program = subprocess.Popen(
        [sys.executable, "-m", *module], stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        yield program
    finally:
        with suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)
        program.wait(HANGS)
