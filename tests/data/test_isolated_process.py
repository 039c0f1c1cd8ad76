"""Work in a program of its own gives its result or its error, and ends alone where it crashes."""

from __future__ import annotations

import errno
import math
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import BrokenExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.files import FullDiskError
from slide_fmu.core.progress import Stages, part_of, quiet_stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.isolated_process import EndedError, IsolatedCall, call_isolated, guarded
from slide_fmu.data.pool import process_pool
from slide_fmu.recipe.case import Case
from slide_fmu.systems.errors import SimulationError
from tests.data.failing_system import FailingSystem
from tests.memory.plain_systems import Lag
from tests.recipes import case_of_object
from tests.refusals import refused


def fail(system: str) -> None:
    raise SimulationError(f"no solution of {system}", 2.5)


def outputs_of(case: Case, inputs: FloatArray) -> FloatArray:
    return case.system.simulate(inputs)


def test_result_and_error_cross() -> None:
    print_is_no_result = call_isolated(print, "what a library prints")
    assert print_is_no_result is None
    assert call_isolated(math.hypot, 3.0, 4.0) == 5.0
    with pytest.raises(SimulationError, match="no solution of pump") as raised:
        call_isolated(fail, "pump")
    assert raised.value.time == 2.5


def test_program_that_ends_by_itself_is_told() -> None:
    with refused(EndedError, "ended with the code 7"):
        call_isolated(os._exit, 7)


def unpack_and_crash() -> None:
    """Stand for the library of an FMU that was unpacked."""
    tempfile.mkdtemp()
    os._exit(7)


@pytest.mark.extended
def test_program_that_crashes_leaves_no_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with refused(EndedError, "ended with the code 7"):
        call_isolated(unpack_and_crash)
    with process_pool(1) as pool:
        assert pool is not None
        with pytest.raises(BrokenExecutor):
            pool.submit(unpack_and_crash).result()
    assert list(tmp_path.iterdir()) == []


def test_system_given_as_an_object_crosses_with_its_case() -> None:
    inputs = np.linspace(0.0, 1.0, 5)[:, None]
    outputs = call_isolated(outputs_of, case_of_object(Lag()), inputs)
    np.testing.assert_array_equal(outputs, Lag().simulate(inputs))


def test_system_that_may_crash_is_named_and_others_are_simulated_here() -> None:
    expected = r"system 'pump.fmu' \(kind 'fmu'\) ended the process that simulated it: its library"
    with pytest.raises(SimulationError, match=expected):
        guarded(FailingSystem(), ("pump.fmu", "fmu"), os._exit, 7)
    assert guarded(Lag(), ("lag", "class"), os.getpid) == os.getpid()
    assert guarded(FailingSystem(), ("pump.fmu", "fmu"), os.getpid) != os.getpid()


@pytest.mark.extended
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_program_ends_with_the_one_that_started_it(tmp_path: Path) -> None:
    place = tmp_path / "pid"
    module = "tests.data.test_isolated_process"
    code = f"from {module} import *; call_isolated(note_and_sleep, {str(place)!r})"
    with subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[2],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    ) as parent:
        wait_until(place.exists)
        child = place.read_text()
        parent.kill()
    wait_until(lambda: not alive(child))


def note_and_sleep(place: str) -> None:
    staged = Path(f"{place}.staged")
    staged.write_text(str(os.getpid()))
    staged.rename(place)
    time.sleep(60)


def alive(process: str) -> bool:
    try:
        return "State:\tZ" not in Path(f"/proc/{process}/status").read_text()
    except OSError:
        return False


def wait_until(happened: object, seconds: float = 20.0) -> None:
    assert callable(happened)
    end = time.monotonic() + seconds
    while not happened():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)


def count_to(stages: Stages, last: int) -> int:
    """Show a stage with a part, and print, which is no part of the answer."""
    progress = stages("counting")
    part = part_of(progress, "by one", at_most=True)
    for number in range(last + 1):
        print(number)
        part(number, last, 0.5)
    progress(1, 1)
    return last


def fail_late(stages: Stages) -> None:
    stages("failing")(0, 1)
    raise FullDiskError(errno.ENOSPC, "full", "net.pt")


@dataclass
class Shown:
    """A progress that keeps what it is called with, and that of its parts."""

    name: str
    calls: list[tuple[object, ...]]

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        self.calls.append((self.name, done, total, error))

    def part(self, name: str, at_most: bool) -> Shown:
        return Shown(f"{self.name}, {name}", self.calls)


def test_progress_of_another_program_is_shown_here_while_this_one_goes_on() -> None:
    calls: list[tuple[object, ...]] = []
    with IsolatedCall(count_to, 2, stages=lambda name: Shown(name, calls)) as call:
        assert call.result() == 2
    parts = [("counting, by one", number, 2, 0.5) for number in range(3)]
    assert calls == [*parts, ("counting", 1, 1, None)]


def test_error_of_another_program_is_known_before_its_result_is_asked_for() -> None:
    with IsolatedCall(fail_late, stages=quiet_stages) as call:
        wait_until(lambda: call.failed)
        with pytest.raises(FullDiskError, match="disk is full"):
            call.result()


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_block_that_is_left_ends_the_program(tmp_path: Path) -> None:
    place = tmp_path / "pid"
    with suppress(KeyboardInterrupt), IsolatedCall(note_and_sleep, str(place)):
        wait_until(place.exists)
        raise KeyboardInterrupt
    assert not alive(place.read_text())
