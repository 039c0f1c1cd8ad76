"""This module runs work in a separate program: what may crash, or what goes on at the same time.

A program whose library crashes ends alone.
"""

from __future__ import annotations

import itertools
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, final

from slide_fmu.core.progress import Progress, Stages, part_of, quiet_stages
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError

Result = TypeVar("Result")


class EndedError(RuntimeError):
    """The program that did the work ended before it was done: a library crashed.

    Attributes:
        code: its exit code; the negative number of a signal that ended it.
    """

    def __init__(self, code: int) -> None:
        super().__init__(f"the program that works in its own ended with the code {code}")
        self.code = code


def crosses(system: System) -> bool:
    """Tell whether an object can be copied to other processes: objects of a session cannot."""
    try:
        return b"__main__" not in pickle.dumps(system)
    except Exception:  # pickling a user's object may raise any exception
        return False


@final
class IsolatedCall(Generic[Result]):
    """A call of a function of a module, in a program of its own, while this one goes on.

    Function, arguments and result are sent as pickles. The program is not a worker process, which
    would run the user's script again. It ends at the end of the ``with`` block, and when this
    process ends in any way. Ctrl-C in a terminal reaches both: the program does not hear it.

    Args:
        function: the function of a module; with ``stages``, its first argument opens progress.
        arguments: its other arguments.
        stages: opens the progress that the function shows, which another thread of this process
            does; None of a function that shows none.
        printed: whether standard error has what the program prints, as of a library that may tell
            more there.
    """

    def __init__(
        self,
        function: Callable[..., Result],
        *arguments: Any,
        stages: Stages | None = None,
        printed: bool = False,
    ) -> None:
        self._task = pickle.dumps((function, arguments, stages is not None))
        self._stages, self._printed = stages or quiet_stages, printed
        self._answer: tuple[bool, Any] | None = None
        self._shows = threading.Thread(target=self._listen, daemon=True)

    def __enter__(self) -> IsolatedCall[Result]:
        code = f"from {__name__} import work; work()"
        self._folder = tempfile.TemporaryDirectory(prefix="slide_fmu_isolated_")
        # what it unpacks lies in this folder, since it removes nothing where it crashes
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self._folder.name)
        python_path = os.pathsep.join(filter(None, sys.path))
        self._program = subprocess.Popen(
            [sys.executable, "-c", code, self._folder.name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if self._printed else subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": python_path, **temporary},
        )
        self._shows.start()
        assert self._program.stdin is not None
        with suppress(BrokenPipeError):  # it has ended already
            self._program.stdin.write(self._task)
            self._program.stdin.flush()
        return self

    def __exit__(self, *raised: object) -> None:
        assert self._program.stdin is not None
        if self._answer is None:
            self._program.kill()  # a library may not listen to milder signals
        with suppress(BrokenPipeError):
            self._program.stdin.close()
        self._program.wait()
        self._shows.join()
        assert self._program.stdout is not None
        self._program.stdout.close()
        self._folder.cleanup()

    @property
    def failed(self) -> bool:
        """Whether the function has raised an error already, which ``result`` raises."""
        return self._answer is not None and not self._answer[0]

    def wait(self, seconds: float) -> bool:
        """Wait for at most a time; return whether the program has answered, or ended."""
        self._shows.join(seconds)
        return not self._shows.is_alive()

    def result(self) -> Result:
        """Wait for the function, and return what it returns.

        Raises:
            EndedError: the program ended by itself.
            Exception: what the function raises.
        """
        self._shows.join()  # the program's input stays open, and ends when this process does
        if self._answer is None:
            code = self._program.wait()
            raise EndedError(code)
        worked, result_or_error = self._answer
        if not worked:
            raise result_or_error
        return result_or_error  # type: ignore[no-any-return]  # the function's result

    def _listen(self) -> None:
        """Show the progress of the program until it answers, or ends."""
        shown: dict[int, Progress] = {}
        assert self._program.stdout is not None
        while True:
            try:
                what, *values = pickle.load(self._program.stdout)
            except (EOFError, pickle.UnpicklingError):  # it has ended, perhaps in the middle
                return
            except Exception as error:  # of an answer that cannot be made here
                self._answer = False, error
                return
            if what == "answer":
                self._answer = values[0], values[1]
                return
            if what == "stage":
                number, name = values
                shown[number] = self._stages(name)
            elif what == "part":
                number, whole, name, at_most = values
                shown[number] = part_of(shown[whole], name, at_most)
            else:
                number, *course = values
                shown[number](*course)


def call_isolated(function: Callable[..., Result], *arguments: Any) -> Result:
    """Call a function of a module in a program of its own, and return what it returns.

    Raises:
        EndedError: the program ended by itself.
        Exception: what the function raises.
    """
    with IsolatedCall(function, *arguments) as call:
        return call.result()


def guarded(
    system: System, model: tuple[str, str], function: Callable[..., Result], *arguments: Any
) -> Result:
    """Call a function that simulates a system, in a separate program if the system may crash.

    Args:
        system: the simulated system.
        model: its model and kind, for messages.
        function: a function of a module, called with the arguments.

    Raises:
        SimulationError: the system ended the program that simulated it.
        Exception: what the function raises.
    """
    if not system.may_crash:
        return function(*arguments)
    try:
        return call_isolated(function, *arguments)
    except EndedError as error:
        raise SimulationError(ended_process(*model)) from error


def ended_process(model: str, kind: str) -> str:
    """Return the message that a model ended its process, since its library crashed."""
    return (
        f"system {model!r} (kind {kind!r}) ended the process that simulated it: "
        "its library crashed, or the memory is full. Expected a model that reports errors: narrow "
        "the ranges of its inputs (system.inputs, data.excitation), use fewer workers, or ask who "
        "made it"
    )


@final
@dataclass(frozen=True)
class _SentProgress:
    """A progress that is sent to the program that shows it; ``send`` numbers what is opened."""

    number: int
    send: Callable[..., int]

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        self.send("progress", self.number, done, total, error)

    def part(self, name: str, at_most: bool) -> Progress:
        return _SentProgress(self.send("part", self.number, name, at_most), self.send)


def work() -> None:
    """Do the work that is read from standard input, and write the answer to standard output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what models and libraries print is no answer
    opened = itertools.count()

    def send(what: str, *values: object) -> int:
        number = next(opened) if what in ("stage", "part") else -1
        numbered = (number, *values) if number >= 0 else values
        pickle.dump((what, *numbered), answers)
        answers.flush()
        return number

    function, arguments, shows = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, args=[Path(sys.argv[1])], daemon=True).start()
    if shows:
        arguments = (lambda name: _SentProgress(send("stage", name), send), *arguments)
    try:
        done = True, function(*arguments)
    except Exception as error:  # it is raised again in the calling process
        done = False, error
    send("answer", *done)


def _end_with_parent(folder: Path) -> None:
    os.read(sys.stdin.fileno(), 1)
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)
