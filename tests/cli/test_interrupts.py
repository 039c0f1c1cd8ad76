"""Ctrl-C ends the program with one line, however early it comes, and workers do not hear it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from slide_fmu.cli.console import GOES_ON, INTERRUPTED, KILLED, STOPPED
from slide_fmu.data.pool import in_parallel, process_pool
from tests.limits import HANGS
from tests.recipes import TINY

posix_alone = pytest.mark.skipif(sys.platform == "win32", reason="signals of process groups")
WHERE = """
import signal
import sys
class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            signal.raise_signal({number})
sys.meta_path.insert(0, Interrupts())
from slide_fmu.cli import main
sys.argv[:] = ["slide-fmu", "run", "tiny.toml"]
main()
"""


@pytest.fixture(autouse=True)
def _interrupts_are_heard() -> Iterator[None]:
    """Set the usual handler, which programs that a test starts begin with too.

    Shells start programs in the background, as ``make test &`` in a script, with SIGINT ignored.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("module", ["typer", "slide_fmu.cli.app", "slide_fmu.pipeline.job"])
def test_interrupt_of_an_import_is_told_in_one_line(module: str, tmp_path: Path) -> None:
    done = signalled(module, signal.SIGINT, tmp_path)
    assert done.stderr == f"{STOPPED}\n"
    assert done.returncode == INTERRUPTED == 128 + signal.SIGINT


@posix_alone
def test_killed_program_says_the_same_with_another_code(tmp_path: Path) -> None:
    done = signalled("slide_fmu.pipeline.job", signal.SIGTERM, tmp_path)
    assert done.stderr == f"{STOPPED}\n"
    assert done.returncode == KILLED == 128 + signal.SIGTERM


def signalled(
    module: str, number: signal.Signals, folder: Path
) -> subprocess.CompletedProcess[str]:
    """Run a program that gets a signal when it imports a module."""
    (folder / "tiny.toml").write_text(TINY, encoding="utf-8")
    program = [sys.executable, "-c", WHERE.format(module=module, number=int(number))]
    return subprocess.run(program, cwd=folder, capture_output=True, text=True, timeout=HANGS)


def children(process: int) -> list[int]:
    """Processes that a process has started and that run."""
    listed = subprocess.run(["ps", "-A", "-o", "pid=,ppid="], capture_output=True, text=True)
    rows = (row.split() for row in listed.stdout.splitlines())
    return [int(pid) for pid, parent in rows if int(parent) == process]


@pytest.mark.extended
@posix_alone
@pytest.mark.parametrize("after", [0.0, 0.3])
def test_interrupt_while_workers_start_is_told_in_one_line(after: float, tmp_path: Path) -> None:
    """Workers import for a second or two, in which the whole group is interrupted."""
    (tmp_path / "tiny.toml").write_text(TINY, encoding="utf-8")
    command = [sys.executable, "-m", "slide_fmu", "generate", "tiny.toml", "--workers", "3"]
    program = subprocess.Popen(
        command,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + HANGS
    while len(children(program.pid)) < 2 and time.monotonic() < end:  # a tracker is one of them
        time.sleep(0.01)
    started = children(program.pid)
    time.sleep(after)
    os.killpg(program.pid, signal.SIGINT)
    _, said = program.communicate(timeout=HANGS)
    assert program.returncode == INTERRUPTED
    assert "Traceback" not in said, said
    assert said.splitlines()[-1] == GOES_ON
    assert len(said.splitlines()) < 8
    assert started
    while any(Path(f"/proc/{one}").exists() for one in started) and time.monotonic() < end:
        time.sleep(0.01)
    assert not any(Path(f"/proc/{one}").exists() for one in started)


def heeds() -> bool:
    """Tell whether this process hears Ctrl-C."""
    return signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def nap(seconds: float) -> None:
    time.sleep(seconds)


def test_workers_do_not_hear_an_interrupt_and_their_parent_does() -> None:
    with process_pool(1) as pool:
        assert in_parallel(pool, heeds, [()], lambda _: None) == [False]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if hasattr(signal, "pthread_sigmask"):
        assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, set())


def test_interrupted_pool_does_not_wait_for_what_its_workers_do() -> None:
    with pytest.raises(KeyboardInterrupt):
        _interrupt_a_nap()
    end = time.monotonic() + 0.5 * HANGS
    while multiprocessing.active_children() and time.monotonic() < end:
        time.sleep(0.01)
    assert not multiprocessing.active_children()


def _interrupt_a_nap() -> None:
    with process_pool(1) as pool:
        assert pool is not None
        running = pool.submit(nap, 0.0), pool.submit(nap, HANGS)
        running[0].result()
        raise KeyboardInterrupt
