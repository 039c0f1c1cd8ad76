"""Draw the rooms of the house from the code itself: ``python docs/rooms.py``.

A room is a package directly below ``slide_fmu``, or ``mbs_models``. A floor is a row of the import
contract in ``pyproject.toml``; ``mbs_models``, which has a contract of its own, stands on the
lowest floor above all that it imports. An arrow leads from a room to a room that one of its files
imports, wherever in the file that is. A circle is a group of rooms, or of files, that import each
other. Imports for type checkers alone count as arrows, but close no circle of files.

Without options it writes ``docs/rooms.svg``; ``--json PATH`` writes the figures instead, ``-`` to
standard output.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import grimp
from rooms_drawing import draw

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "rooms.svg"
MODELS = "mbs_models"
PACKAGES = ("slide_fmu", MODELS)


def main() -> None:
    """Run the command line: write the picture or the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", metavar="PATH", help="write the figures here; - is stdout")
    path = parser.parse_args().json
    figures = measure()
    if path is None:
        PICTURE.write_text(draw(figures), encoding="utf-8")
        print(f"{PICTURE}: {summary(figures)}")
    elif path == "-":
        print(json.dumps(figures, indent=2))
    else:
        Path(path).write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


def measure() -> dict[str, Any]:
    """Return rooms, floors, arrows and circles, as plain values."""
    sys.path.insert(0, str(ROOT))
    edges = _imports(type_checking=True)
    pairs = [(_room(a), _room(b)) for a, b in edges]
    arrows = sorted({(a, b) for a, b in pairs if a and b and a != b})
    floors = _floors()
    below = {floor for a, b in arrows if a == MODELS for floor in floors if b in floors[floor]}
    floors[max(below) + 1].append(MODELS)
    rooms = [
        {"name": name, "floor": floor, **_contents(ROOT / _folder(name))}
        for floor in sorted(floors, reverse=True)
        for name in floors[floor]
    ]
    return {
        "counts": {"rooms": len(rooms), "floors": len(floors), "arrows": len(arrows)},
        "rooms": rooms,
        "arrows": [{"from": a, "to": b, "imports": pairs.count((a, b))} for a, b in arrows],
        "circles of rooms": circles(arrows),
        "circles of files": circles(_imports(type_checking=False)),
    }


def summary(figures: dict[str, Any]) -> str:
    """Return the counts of rooms, floors, arrows and circles as one line."""
    counts = ", ".join(f"{number} {name}" for name, number in figures["counts"].items())
    of_rooms, of_files = figures["circles of rooms"], figures["circles of files"]
    return f"{counts}, {len(of_rooms)} circles of rooms, {len(of_files)} of files"


def _imports(type_checking: bool) -> list[tuple[str, str]]:
    """Return pairs of modules, the first of which imports the second."""
    graph = grimp.build_graph(
        *PACKAGES, exclude_type_checking_imports=not type_checking, cache_dir=None
    )
    found = graph.find_modules_directly_imported_by
    return sorted((module, other) for module in graph.modules for other in found(module))


def _room(module: str) -> str | None:
    """Return the room that a module lies in; None for the doors, ``__init__`` and ``__main__``."""
    parts = module.split(".")
    if parts[0] == MODELS:
        return MODELS
    return parts[1] if len(parts) > 1 and not parts[1].startswith("__") else None


def _folder(room: str) -> str:
    return room if room == MODELS else f"slide_fmu/{room}"


def _floors() -> dict[int, list[str]]:
    """Return the rooms by floor, 1 the ground, from the first import contract."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    rows = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    names = [[n for n in re.split(r"\s*[|:]\s*", row) if not n.startswith("__")] for row in rows]
    return dict(enumerate(reversed(names), start=1))


def _contents(folder: Path) -> dict[str, Any]:
    """Return what is in a room: its docstring, and its files and lines, of Python and of C."""
    python = sorted(folder.rglob("*.py"))
    c = sorted([*folder.rglob("*.c"), *folder.rglob("*.h")])
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    return {
        "says": text or "",
        "files": len(python),
        "lines": _lines(python),
        "c_files": len(c),
        "c_lines": _lines(c),
    }


def _lines(paths: list[Path]) -> int:
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def circles(edges: list[tuple[str, str]]) -> list[list[str]]:
    """Return the groups of more than one node that can be reached from each other."""
    reach: dict[str, set[str]] = {}
    for a, b in edges:
        reach.setdefault(a, set()).add(b)
        reach.setdefault(b, set())

    def reached(start: str) -> set[str]:
        found: set[str] = set()
        waiting = [*reach[start]]
        while waiting:
            node = waiting.pop()
            if node not in found:
                found.add(node)
                waiting += reach[node]
        return found

    ahead = {node: reached(node) for node in reach}
    groups = {
        tuple(sorted(other for other in ahead[node] if node in ahead[other]))
        for node in reach
        if node in ahead[node]
    }
    return [list(group) for group in sorted(groups)]


if __name__ == "__main__":
    main()
