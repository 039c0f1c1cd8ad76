"""Draw the rooms of the house and what they import: ``python docs/rooms.py`` writes ``rooms.svg``.

A room is a package directly below ``slide_fmu``, or ``mbs_models``. A floor is a row of the import
contract in ``pyproject.toml``; ``mbs_models``, which has a contract of its own, stands on the
lowest floor above all that it imports. An arrow leads from a room to a room that one of its files
imports, wherever in the file that is. Arrows that follow from others (a room below that is reached
through another one as well) would cover the picture, so they are left out.

The picture changes only where a room, a floor or an arrow does.
"""

from __future__ import annotations

import itertools
import re
import tomllib
from pathlib import Path

import grimp
from theme import themed

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "rooms.svg"
MODELS = "mbs_models"

BOX, GAP, FLOOR, TOP, LEFT = (160, 44), 64, 94, 90, 70
HUES = ("#f6e9d8", "#e6eef6")
INK, SOFT, ARROW, PAPER = "#222222", "#666666", "#4a6d8c", "#ffffff"
DARK = {
    HUES[0]: "#4a3c28",
    HUES[1]: "#26384a",
    INK: "#dde5eb",
    SOFT: "#9aa7b5",
    ARROW: "#7fa8cf",
    PAPER: "#1e2129",
}
"""Colours for a dark theme."""

Arrow = tuple[str, str]
Point = tuple[float, float]


def main() -> None:
    """Write the picture."""
    arrows = arrows_of_code()
    floors = floors_of_contract()
    below = {floor for a, b in arrows if a == MODELS for floor in floors if b in floors[floor]}
    floors[max(below) + 1].append(MODELS)
    PICTURE.write_text(draw(floors, without_consequences(arrows)), encoding="utf-8")
    print(PICTURE)


def arrows_of_code() -> list[Arrow]:
    """Return pairs of rooms, the first of which imports the second."""
    graph = grimp.build_graph("slide_fmu", MODELS, cache_dir=None)
    pairs = {
        (_room(module), _room(other))
        for module in graph.modules
        for other in graph.find_modules_directly_imported_by(module)
    }
    return sorted((a, b) for a, b in pairs if a and b and a != b)


def _room(module: str) -> str | None:
    """Return the room that a module lies in; None for the doors, ``__init__`` and ``__main__``."""
    parts = module.split(".")
    if parts[0] == MODELS:
        return MODELS
    return parts[1] if len(parts) > 1 and not parts[1].startswith("__") else None


def floors_of_contract() -> dict[int, list[str]]:
    """Return the rooms by floor, 1 the ground, from the first import contract."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    rows = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    names = [[n for n in re.split(r"\s*[|:]\s*", row) if not n.startswith("__")] for row in rows]
    return dict(enumerate(reversed(names), start=1))


def without_consequences(arrows: list[Arrow]) -> list[Arrow]:
    """Return the arrows that do not follow from others: no longer way leads where they lead."""
    targets: dict[str, set[str]] = {}
    for a, b in arrows:
        targets.setdefault(a, set()).add(b)

    def reaches(start: str, end: str) -> bool:
        return any(node == end or reaches(node, end) for node in targets.get(start, ()))

    return [(a, b) for a, b in arrows if not any(reaches(c, b) for c in targets[a] - {b})]


def draw(floors: dict[int, list[str]], arrows: list[Arrow]) -> str:
    """Return the picture as SVG: boxes on floors, and arrows between them."""
    places = _places(floors, arrows)
    width, height = 2 * LEFT + max(map(_width, floors.values())), TOP + FLOOR * len(floors)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'font-family="Helvetica, Arial, sans-serif" fill="{INK}">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        f'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="{ARROW}"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="{PAPER}"/>',
        f'<text x="{LEFT}" y="38" font-size="24" font-weight="bold">The rooms of slide-fmu</text>',
        f'<text x="{LEFT}" y="64" font-size="15" fill="{SOFT}">A room imports only from floors '
        "below its own. Arrows that follow from others are left out.</text>",
    ]
    for floor in floors:
        y = TOP + FLOOR * (len(floors) - floor) + BOX[1] / 2 + 5
        parts.append(
            f'<text x="28" y="{y:.0f}" font-size="15" fill="{SOFT}" '
            f'text-anchor="middle">{floor}</text>'
        )
    parts += [_arrow(places, a, b) for a, b in arrows]
    parts += [_box(name, *place) for name, place in places.items()]
    return themed("\n".join([*parts, "</svg>", ""]), DARK)


def _places(floors: dict[int, list[str]], arrows: list[Arrow]) -> dict[str, Point]:
    """Return the upper left corners of the boxes; each floor is ordered by what it stands on."""
    places: dict[str, Point] = {}

    def middle(name: str) -> float:
        below = [places[b][0] for a, b in arrows if a == name and b in places]
        return sum(below) / len(below) if below else 0.0

    widest = max(map(_width, floors.values()))
    for floor, rooms in sorted(floors.items()):
        first, y = LEFT + (widest - _width(rooms)) / 2, TOP + FLOOR * (len(floors) - floor)
        ordered = sorted(rooms, key=lambda name: (middle(name), name))
        places |= {name: (first + i * (BOX[0] + GAP), y) for i, name in enumerate(ordered)}
    return places


def _width(rooms: list[str]) -> float:
    """Return the width of a floor."""
    return len(rooms) * BOX[0] + (len(rooms) - 1) * GAP


def _arrow(places: dict[str, Point], a: str, b: str) -> str:
    """Return a line from the lower side of a box to the upper side of another, around the rest."""
    (xa, ya), (xb, yb) = places[a], places[b]
    lean = (xb - xa) / (abs(xb - xa) + 400)
    start = (xa + BOX[0] * (0.5 + 0.42 * lean), ya + BOX[1])
    end = (xb + BOX[0] * (0.5 - 0.42 * lean), yb)
    points = [start]
    for y in sorted({place[1] for place in places.values() if ya < place[1] < yb}):
        straight = start[0] + (end[0] - start[0]) * (y - ya) / (yb - ya)
        x = _free(sorted(place[0] for place in places.values() if place[1] == y), straight)
        points += [(x, y), (x, y + BOX[1])]
    points.append(end)
    path = f"M{points[0][0]:.0f} {points[0][1]:.0f}"
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        bend = 0.5 * (y1 - y0)
        path += f"C{x0:.0f} {y0 + bend:.0f} {x1:.0f} {y1 - bend:.0f} {x1:.0f} {y1:.0f}"
    return (
        f'<path d="{path}" fill="none" stroke="{ARROW}" stroke-width="1.5" '
        f'marker-end="url(#tip)"><title>{a} imports {b}</title></path>'
    )


def _free(lefts: list[float], x: float) -> float:
    """Return the place nearest to x on a floor that no box covers."""
    for left in lefts:
        if left - 14 < x < left + BOX[0] + 14:
            return min((left - 20, left + BOX[0] + 20), key=lambda edge: abs(edge - x))
    return x


def _box(room: str, x: float, y: float) -> str:
    return (
        f'<rect x="{x:.0f}" y="{y:.0f}" width="{BOX[0]}" height="{BOX[1]}" rx="5" '
        f'fill="{HUES[room == MODELS]}" stroke="{INK}"/>'
        f'<text x="{x + BOX[0] / 2:.0f}" y="{y + 28:.0f}" text-anchor="middle" font-size="18" '
        f'font-weight="bold">{room}</text>'
    )


if __name__ == "__main__":
    main()
