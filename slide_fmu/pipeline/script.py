"""Whether worker processes would run the call again that a user's script makes."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from types import FrameType


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
