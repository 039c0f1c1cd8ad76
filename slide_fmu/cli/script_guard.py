"""Worker processes run the script again that Python was started with, unless a guard keeps them.

So a public function that simulates asks here how many processes may do that.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Mapping
from pathlib import Path
from types import FrameType
from typing import Any

from slide_fmu.data.isolated_process import crosses
from slide_fmu.recipe.model_rules import rules_of_tables
from slide_fmu.systems.base import System

ALONE = (
    "simulating in this process alone: worker processes would run this script again ({place}). "
    'Put the call under if __name__ == "__main__": for several'
)
AGAIN = (
    "slide.{call} with workers = {workers} stands in {place}, outside of "
    'if __name__ == "__main__":; expected it under that line, since worker processes run all the '
    "rest of the script again: put it there, or say workers = 0, which simulates in this process "
    "alone"
)
NOT_DEFINED_HERE = (
    "simulating in this process alone: the system has parts that this session defines itself. Put "
    "its functions or classes into a module for several worker processes"
)


def simulating_processes(
    system: System | Mapping[str, Any], workers: int | None, call: str = "learn"
) -> tuple[int | None, str | None]:
    """Return how many processes simulate, and what to say about that.

    The call is the public function by which the user came here.

    Raises:
        ValueError: there shall be some, which would run the user's script again.
    """
    if isinstance(system, Mapping) and not rules_of_tables({"system": system}).simulated:
        return 0, None
    if isinstance(system, System) and not crosses(system):
        return 0, None if workers == 0 else NOT_DEFINED_HERE
    place = unguarded_place()
    if place is None or workers == 0:
        return workers, None
    if workers is None:
        return 0, ALONE.format(place=place)
    raise ValueError(AGAIN.format(call=call, workers=workers, place=place))


def unguarded_place() -> str | None:
    """Say which line of the script that runs leads here, if no guard keeps workers from it.

    Worker processes import the script that Python was started with. What stands under
    ``if __name__ == "__main__":`` they leave out. The result is None there, and where there is no
    script: in notebooks, and where a module of another program calls.
    """
    main = sys.modules["__main__"]
    path, line = getattr(main, "__file__", None), _line_in(vars(main), sys._getframe())
    if path is None or line is None:
        return None
    try:
        script = ast.parse(Path(path).read_bytes())
    except (OSError, SyntaxError, ValueError):  # it is no longer what runs
        return None
    if any(_guards(node, line) for node in ast.walk(script)):
        return None
    return f"{Path(path).name}, line {line}"


def _line_in(names: dict[str, object], frame: FrameType | None) -> int | None:
    """Return the line of a module, of these global names, that is running; None if none is."""
    while frame is not None:
        if frame.f_globals is names and frame.f_code.co_name == "<module>":
            return frame.f_lineno
        frame = frame.f_back
    return None


def _guards(node: ast.AST, line: int) -> bool:
    """Tell whether a statement runs a line only in the script that Python was started with."""
    if not isinstance(node, ast.If) or not any(
        isinstance(name, ast.Name) and name.id == "__name__" for name in ast.walk(node.test)
    ):
        return False
    return node.body[0].lineno <= line <= (node.body[-1].end_lineno or 0)
