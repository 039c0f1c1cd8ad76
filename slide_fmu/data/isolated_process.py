"""This module runs work whose libraries may crash in a separate program, which then ends alone."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from slide_fmu.core.files import write_whole
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError

Result = TypeVar("Result")


class EndedError(RuntimeError):
    """The program that did the work ended before it was done: a library crashed."""


def crosses(system: System) -> bool:
    """Tell whether an object can be copied to other processes: objects of a session cannot."""
    try:
        return b"__main__" not in pickle.dumps(system)
    except Exception:  # pickling a user's object may raise any exception
        return False


def call_isolated(function: Callable[..., Result], *arguments: Any) -> Result:
    """Call a function of a module in a program of its own, and return what it returns.

    Function, arguments and result are sent as pickles. The program is not a worker process, which
    would run the user's script again. It ends when this process ends in any way.

    Raises:
        EndedError: the program ended by itself.
        Exception: what the function raises.
    """
    task = pickle.dumps((function, arguments))
    code = f"import sys; from {__name__} import work; work(sys.argv[1])"
    with tempfile.TemporaryDirectory(prefix="slide_fmu_isolated_") as folder:
        result = Path(folder) / "result"
        # what it unpacks lies in this folder, since it removes nothing where it crashes
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), folder)
        python_path = os.pathsep.join(filter(None, sys.path))
        places = {**os.environ, "PYTHONPATH": python_path, **temporary}
        with subprocess.Popen(
            [sys.executable, "-c", code, str(result)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=places,
        ) as program:
            assert program.stdin is not None
            with suppress(BrokenPipeError):  # it has ended already
                program.stdin.write(task)
                program.stdin.flush()
            program.wait()  # its input stays open, and ends when this process does
        if not result.exists():
            raise EndedError(
                f"the program that simulates ended with the code {program.returncode}"
            )
        worked, result_or_error = pickle.loads(result.read_bytes())
    if not worked:
        raise result_or_error
    return result_or_error  # type: ignore[no-any-return]  # the function's result


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


def work(result: str) -> None:
    """Do the work that is read from standard input, and write its result to a file."""
    function, arguments = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, args=[Path(result).parent], daemon=True).start()
    try:
        done = True, function(*arguments)
    except Exception as error:  # it is raised again in the calling process
        done = False, error
    write_whole(Path(result), pickle.dumps(done))


def _end_with_parent(folder: Path) -> None:
    os.read(sys.stdin.fileno(), 1)
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)
