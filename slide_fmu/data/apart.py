"""Where a library may crash, work is done in a program of its own, which then ends alone."""

from __future__ import annotations

import os
import pickle
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
    """Tell whether other processes can be given a copy: not of what a session itself defines."""
    try:
        return b"__main__" not in pickle.dumps(system)
    except Exception:  # a user's object may refuse in any way
        return False


def apart(function: Callable[..., Result], *arguments: Any) -> Result:
    """Call a function of a module in a program of its own, and return what it returns.

    Function, arguments and result cross as pickles. It is no worker process, which would run the
    user's script again. It ends with this process, however that ends.

    Raises:
        EndedError: the program ended by itself.
        Exception: what the function raises.
    """
    task = pickle.dumps((function, arguments))
    places = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    code = f"import sys; from {__name__} import work; work(sys.argv[1])"
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result"
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
        worked, found = pickle.loads(result.read_bytes())
    if not worked:
        raise found
    return found  # type: ignore[no-any-return]  # what the function returned


def guarded(
    system: System, model: tuple[str, str], function: Callable[..., Result], *arguments: Any
) -> Result:
    """Call a function that simulates a system: apart where that may crash, else here.

    Args:
        system: what is simulated.
        model: its model and kind, for messages.
        function: a function of a module, called with the arguments.

    Raises:
        SimulationError: the system ended the program that simulated it.
        Exception: what the function raises.
    """
    if not system.may_crash:
        return function(*arguments)
    try:
        return apart(function, *arguments)
    except EndedError as error:
        raise SimulationError(ended_process(*model)) from error


def ended_process(model: str, kind: str) -> str:
    """Say that a model ended the process that simulated it, as a library does that crashes."""
    return (
        f"system {model!r} (kind {kind!r}) ended the process that simulated it: "
        "its library crashed, or the memory is full. Expected a model that reports errors: narrow "
        "the ranges of its inputs (system.inputs, data.excitation), use fewer workers, or ask who "
        "made it"
    )


def work(result: str) -> None:
    """Do the work that is read from standard input, and write its result to a file."""
    function, arguments = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        done = True, function(*arguments)
    except Exception as error:  # it is raised again where the work was asked for
        done = False, error
    write_whole(Path(result), pickle.dumps(done))


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)
