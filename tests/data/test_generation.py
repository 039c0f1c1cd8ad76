"""Generation on any executor, broken at any moment."""

from __future__ import annotations

import functools
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data.draws import draw, probe_draws, simulate_draw, split_stream
from slide_fmu.data.generation import generate
from slide_fmu.data.pool import process_pool
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import SPLITS, Recipe
from tests.data import generate_logged
from tests.data.logging_system import LOG, identity
from tests.folder_digest import folder_digest
from tests.limits import HANGS
from tests.own_models.quarter_car import build_in_c
from tests.progress import silent
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe, whole_recipe

WORKERS = 2

SMALL = tiny_state_space_recipe(
    data={"train": 4, "validation": 2, "estimator": 4, "estimator_validation": 2, "beyond": 2},
    estimator=ESTIMATOR,
)
SMALL_OTHER_SEED = SMALL.model_copy(update={"data": SMALL.data.model_copy(update={"seed": 8})})
LONG = tiny_recipe(
    system={"model": "tests.data.logging_system:LoggingSystem"},
    data={"train": 60, "validation": 10, "duration": 15.0},
)
"""70 trajectories of some 30 ms each: long enough to be killed in their midst."""


class Inline(Executor):
    """Runs everything at once, in the caller."""

    def submit(self, function, /, *args, **kwargs):  # type: ignore[no-untyped-def]
        future: Future = Future()
        future.set_result(function(*args, **kwargs))
        return future


def assert_complete(recipe: Recipe, path: Path) -> None:
    """Check that a folder holds what each trajectory gives when it is made alone."""
    case = case_of(recipe)
    trajectories, system = Trajectories.of(case, path), case.system
    for name in SPLITS:
        if not recipe.count(name):
            continue
        split = trajectories.read(name)
        assert len(split.inputs) == recipe.count(name)
        for index in range(len(split.inputs)):
            drawn = draw(recipe, system, split_stream(recipe, name, index), index)
            expected = simulate_draw(system, drawn)
            assert np.array_equal(split.inputs[index], expected.inputs), (name, index)
            assert np.array_equal(split.outputs[index], expected.outputs), (name, index)
            assert split.kinds[index] == drawn.kind


def test_outputs_of_an_fmu_keep_the_order_of_the_recipe(tmp_path: Path) -> None:
    """An order that is neither that of the FMU nor that of the alphabet."""
    fmu = build_in_c(tmp_path / "car.fmu")
    values = tiny_recipe().model_dump(mode="json")
    values["window"]["step"], values["data"]["burn_in"] = 0.01, 0.1
    values["data"]["duration"], values["estimator"] = 0.6, None
    outputs = ("tyre_deflection", "body_acceleration", "suspension_travel")
    values["system"] = {
        "kind": "fmu",
        "model": str(fmu),
        "inputs": {"road": {"range": [-0.1, 0.1]}},
        "outputs": {name: {"range": [-9, 9]} for name in outputs},
    }
    recipe = whole_recipe(values)
    generate(case_of(recipe), tmp_path / "s", None, silent)
    assert_complete(recipe, tmp_path / "s")


def test_threads_do_not_disturb_each_other(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    request.addfinalizer(functools.partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-5)  # threads take turns within every simulation
    calls: list[tuple[int, int]] = []
    with ThreadPoolExecutor(4) as pool:
        generate(case_of(SMALL), tmp_path / "s", pool, lambda *numbers: calls.append(numbers))
    assert calls == [(done, 14) for done in range(15)]
    assert_complete(SMALL, tmp_path / "s")


@pytest.mark.extended
def test_process_pool_generates_every_trajectory_once(tmp_path: Path) -> None:
    with process_pool(WORKERS) as pool:
        assert generate(case_of(SMALL), tmp_path / "s", pool, silent) == 14
        assert generate(case_of(SMALL), tmp_path / "s", pool, silent) == 0
    assert_complete(SMALL, tmp_path / "s")


@pytest.mark.extended
def test_more_trajectories_leave_the_first_ones(tmp_path: Path) -> None:
    """Those of the error estimator too, in range or not."""
    path = tmp_path / "s"
    fewer = {"train": 2, "validation": 1, "estimator": 3, "estimator_validation": 1, "beyond": 1}
    small = SMALL.model_copy(update={"data": SMALL.data.model_copy(update=fewer)})
    assert generate(case_of(small), path, Inline(), silent) == 8
    assert_complete(small, path)
    assert generate(case_of(SMALL), path, Inline(), silent) == 6
    assert_complete(SMALL, path)
    assert generate(case_of(small), path, Inline(), silent) == 0


def test_broken_generation_goes_on_where_it_was(tmp_path: Path) -> None:
    class Enough(Exception):
        pass

    def until_five(done: int, total: int) -> None:
        if done == 5:
            raise Enough

    path = tmp_path / "s"
    with ThreadPoolExecutor(1) as pool, pytest.raises(Enough):
        generate(case_of(SMALL), path, pool, until_five)
    left = len(Trajectories.of(case_of(SMALL), path).missing())
    assert 0 < left <= 9
    calls: list[tuple[int, int]] = []
    generate(case_of(SMALL), path, Inline(), lambda *numbers: calls.append(numbers))
    assert calls == [(done, 14) for done in range(14 - left, 15)]
    assert_complete(SMALL, path)
    generate(case_of(SMALL), path, Inline(), lambda *numbers: calls.append(numbers))
    assert calls[-1] == (14, 14)


def test_recipes_of_other_values_share_a_folder(tmp_path: Path) -> None:
    for recipe in (SMALL, SMALL_OTHER_SEED):
        assert generate(case_of(recipe), tmp_path / "s", None, silent) == 14
    for recipe in (SMALL, SMALL_OTHER_SEED):
        assert generate(case_of(recipe), tmp_path / "s", None, silent) == 0
        assert_complete(recipe, tmp_path / "s")


def probed() -> str:
    """Line in the log of the motion that shows a changed model."""
    return identity(next(probe_draws(LONG, case_of(LONG).system)).initial)


PROBED = probed()


@dataclass(frozen=True)
class Scene:
    """Where the killed generation takes place."""

    folder: Path
    name: str = "log"

    @property
    def trajectories(self) -> Path:
        return self.folder / "trajectories"

    @property
    def log(self) -> Path:
        return self.folder / self.name

    def lines(self) -> list[str]:
        """Simulated trajectories, without the short motion that shows a changed model."""
        logged = self.log.read_text().splitlines() if self.log.exists() else []
        return [line for line in logged if line != PROBED]

    def start(self) -> subprocess.Popen[bytes]:
        recipe = self.folder / f"{self.name}.json"
        recipe.write_text(LONG.model_dump_json())
        script = generate_logged.__name__
        return subprocess.Popen(
            [sys.executable, "-m", script, str(recipe), str(self.trajectories), str(WORKERS)],
            cwd=Path(__file__).parents[2],
            env={**os.environ, LOG: str(self.log)},
            stderr=subprocess.DEVNULL,  # of the processes that lose their parent
        )

    def processes(self) -> list[int]:
        """Ids of living processes that were started here; they inherit the environment."""
        mark = f"{LOG}={self.log}".encode()
        processes = []
        for folder in Path("/proc").iterdir():
            try:
                if folder.name.isdigit() and mark in (folder / "environ").read_bytes():
                    processes.append(int(folder.name))
            except OSError:
                continue
        return processes

    def done(self) -> set[str]:
        """Identities of the trajectories that are there."""
        missing = set(made_in(self.trajectories).missing())
        return {name for key, name in identities().items() if key not in missing}


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    scene = Scene(tmp_path)
    yield scene
    for process in scene.processes():  # of a test that failed
        os.kill(process, signal.SIGKILL)


def made_in(folder: Path) -> Trajectories:
    """The long recipe's trajectories; its model logs what it is simulated on."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(LOG, os.devnull)
        return Trajectories.of(case_of(LONG), folder)


def identities() -> dict[tuple[str, int], str]:
    system = case_of(LONG).system
    return {
        (split, index): identity(
            draw(LONG, system, split_stream(LONG, split, index), index).initial
        )
        for split in SPLITS
        for index in range(LONG.count(split))
    }


def wait_until(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + HANGS
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.002)


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill the parent alone; its workers are to notice."""
    assert process.poll() is None, "killed too late: the generation had ended"
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL


@pytest.mark.extended
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for workers in /proc")
def test_killed_generation_repeats_nothing_that_was_done(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed while it starts, and twice in its midst; then left alone."""
    moments, unbroken = random.Random(0), scene.folder / "unbroken"
    log_before, done_before = 0, set()
    for kills, new_lines in enumerate((0, 3, 25)):
        process = scene.start()
        if new_lines:
            wanted = log_before + new_lines
            wait_until(lambda wanted=wanted: len(scene.lines()) >= wanted, "no simulations")
            time.sleep(moments.uniform(0.0, 0.04))
        else:
            time.sleep(moments.uniform(0.0, 1.0))
        kill(process)
        wait_until(lambda: not scene.processes(), "workers outlive their parent")
        lines, done = scene.lines(), scene.done()
        assert not done_before & set(lines[log_before:]), "a finished trajectory was repeated"
        assert done_before <= done
        assert len(set(lines) - done) <= WORKERS * (kills + 1)
        assert len(lines) - len(set(lines)) <= WORKERS * kills
        log_before, done_before = len(lines), done
    assert 0 < len(done_before) < len(identities())

    process = scene.start()
    assert process.wait(timeout=HANGS) == 0
    assert not done_before & set(scene.lines()[log_before:])
    assert set(scene.lines()) == set(identities().values())
    assert len(scene.lines()) - len(identities()) <= WORKERS * 3

    monkeypatch.setenv(LOG, str(scene.folder / "unbroken_log"))
    generate(case_of(LONG), unbroken, Inline(), silent)
    for name in SPLITS:
        if not LONG.count(name):
            continue
        broken, whole = (made_in(path).read(name) for path in (scene.trajectories, unbroken))
        assert np.array_equal(broken.inputs, whole.inputs)
        assert np.array_equal(broken.outputs, whole.outputs)
        assert np.array_equal(broken.kinds, whole.kinds)


@pytest.mark.extended
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for workers in /proc")
@pytest.mark.parametrize("killed", [False, True])
def test_two_programs_share_the_work_of_one_folder_also_where_one_is_killed(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, killed: bool
) -> None:
    """They log into files of their own. Some trajectories may be made twice, none is missing."""
    other = replace(scene, name="other")
    processes = [scene.start(), other.start()]
    if killed:
        wait_until(lambda: len(scene.lines()) >= 5, "no simulations")
        kill(processes.pop(0))
    assert [process.wait(HANGS) for process in processes] == [0] * len(processes)
    lines = scene.lines(), other.lines()
    assert min(map(len, lines)) >= 5
    assert set(lines[0]) | set(lines[1]) == set(identities().values())
    assert len(lines[0]) + len(lines[1]) < 1.5 * len(identities())
    monkeypatch.setenv(LOG, str(scene.folder / "unbroken_log"))
    generate(case_of(LONG), scene.folder / "unbroken", None, silent)
    assert folder_digest(scene.trajectories) == folder_digest(scene.folder / "unbroken")
