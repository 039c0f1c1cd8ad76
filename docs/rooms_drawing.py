"""The picture of the rooms as SVG: boxes on floors, arrows between them, all arrows as a grid.

Arrows that follow from others (a room below that is reached through another one as well) would
cover the picture, so only those that do not are drawn between the boxes; the grid has all.
"""

from __future__ import annotations

import itertools
import json
from html import escape
from typing import Any

from theme import themed

BOX, GAP, FLOOR, TOP, LEFT = (176, 62), 44, 112, 96, 70
GRID_CELL, GRID_LEFT, GRID_TOP = 26, 920, 250
HUES = ("#f6e9d8", "#e6eef6")
INK, SOFT, ARROW, PAPER, EMPTY, RULE = (
    "#222222",
    "#666666",
    "#4a6d8c",
    "#ffffff",
    "#dddddd",
    "#cccccc",
)
DARK = {
    HUES[0]: "#4a3c28",
    HUES[1]: "#26384a",
    INK: "#dde5eb",
    SOFT: "#9aa7b5",
    ARROW: "#7fa8cf",
    PAPER: "#1e2129",
    EMPTY: "#3a4450",
    RULE: "#4a5560",
}
"""Colours for a dark theme."""
HOUSE_WIDTH = 720


def draw(figures: dict[str, Any]) -> str:
    """Return the whole picture; the figures that it shows stand in its ``metadata``."""
    rooms, arrows = figures["rooms"], [(a["from"], a["to"]) for a in figures["arrows"]]
    places = _places(rooms, arrows)
    height = TOP + FLOOR * max(room["floor"] for room in rooms) + 30
    width = GRID_LEFT + GRID_CELL * len(rooms) + 80
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'font-family="Helvetica, Arial, sans-serif" fill="{INK}">',
        f"<metadata>{escape(json.dumps(figures, sort_keys=True), quote=False)}</metadata>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        f'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="{ARROW}"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="{PAPER}"/>',
        *_heading(figures),
        *_floor_lines(rooms, height),
    ]
    for a, b in reduced(arrows):
        parts.append(_arrow(places, rooms, a, b))
    parts += [_box(room, *places[room["name"]]) for room in rooms]
    parts += _grid(rooms, figures["arrows"])
    parts += _contents(rooms)
    return themed("\n".join([*parts, "</svg>", ""]), DARK)


def reduced(arrows: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the arrows that do not follow from others: no longer way leads where they lead."""
    targets: dict[str, set[str]] = {}
    for a, b in arrows:
        targets.setdefault(a, set()).add(b)

    def reaches(start: str, end: str) -> bool:
        return any(node == end or reaches(node, end) for node in targets.get(start, ()))

    return [(a, b) for a, b in arrows if not any(reaches(c, b) for c in targets[a] - {b})]


def _places(
    rooms: list[dict[str, Any]], arrows: list[tuple[str, str]]
) -> dict[str, tuple[float, float]]:
    """Return the upper left corners of the boxes; each floor is ordered by what it stands on."""
    places: dict[str, tuple[float, float]] = {}
    top = max(room["floor"] for room in rooms)
    for floor in range(1, top + 1):
        names = [room["name"] for room in rooms if room["floor"] == floor]

        def middle(name: str) -> float:
            below = [places[b][0] for a, b in reduced(arrows) if a == name and b in places]
            return sum(below) / len(below) if below else 0.0

        names.sort(key=lambda name: (middle(name), name))
        whole = len(names) * BOX[0] + (len(names) - 1) * GAP * 2
        first = LEFT + (HOUSE_WIDTH - whole) / 2
        for index, name in enumerate(names):
            places[name] = (first + index * (BOX[0] + 2 * GAP), TOP + FLOOR * (top - floor))
    return places


def _arrow(
    places: dict[str, tuple[float, float]], rooms: list[dict[str, Any]], a: str, b: str
) -> str:
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


def _box(room: dict[str, Any], x: float, y: float) -> str:
    name = room["name"]
    c = f" + {room['c_files']} of C" if room["c_files"] else ""
    lines = f"{rounded(room['lines'] + room['c_lines'])} lines"
    return (
        f'<g><title>{escape(room["says"])}</title><rect x="{x:.0f}" y="{y:.0f}" '
        f'width="{BOX[0]}" height="{BOX[1]}" rx="5" fill="{HUES[name == "mbs_models"]}" '
        f'stroke="{INK}"/><text x="{x + BOX[0] / 2:.0f}" y="{y + 27:.0f}" text-anchor="middle" '
        f'font-size="18" font-weight="bold">{name}</text><text x="{x + BOX[0] / 2:.0f}" '
        f'y="{y + 48:.0f}" text-anchor="middle" font-size="13" fill="{SOFT}">'
        f"{room['files']} files{c}, {lines}</text></g>"
    )


def rounded(lines: int) -> str:
    """Write lines to two digits: the picture need not be drawn again for every line."""
    if lines < 1000:
        return str(round(lines, -1))
    return f"{float(f'{lines:.2g}') / 1000:g} k"


def _heading(figures: dict[str, Any]) -> list[str]:
    counts = figures["counts"]
    text = (
        f"{counts['rooms']} rooms on {counts['floors']} floors, {counts['arrows']} arrows, "
        f"{len(figures['circles of rooms'])} circles"
    )
    return [
        f'<text x="{LEFT}" y="38" font-size="24" font-weight="bold">The rooms of slide-fmu</text>',
        f'<text x="{LEFT}" y="64" font-size="15" fill="{SOFT}">{text}. A room imports only from '
        "floors below its own. Drawn: arrows that do not follow from others.</text>",
    ]


def _floor_lines(rooms: list[dict[str, Any]], height: int) -> list[str]:
    top = max(room["floor"] for room in rooms)
    parts = []
    for floor in range(1, top + 1):
        y = TOP + FLOOR * (top - floor) + BOX[1] / 2
        parts.append(
            f'<text x="28" y="{y + 5:.0f}" font-size="15" fill="{SOFT}" '
            f'text-anchor="middle">{floor}</text>'
        )
    parts.append(
        f'<text x="{LEFT}" y="{height - 20}" font-size="13" fill="{SOFT}">Drawn from the code by '
        "python docs/rooms.py. Lines: of Python and C, to two digits.</text>"
    )
    return parts


def _grid(rooms: list[dict[str, Any]], arrows: list[dict[str, Any]]) -> list[str]:
    """Return all arrows as a grid: a row imports from a column, as often as the number says."""
    names = [room["name"] for room in rooms]
    found = {(arrow["from"], arrow["to"]): arrow["imports"] for arrow in arrows}
    size = GRID_CELL * len(names)
    parts = [
        f'<text x="{GRID_LEFT - 96}" y="{GRID_TOP - 118}" font-size="16" font-weight="bold">All '
        "arrows</text>",
        f'<text x="{GRID_LEFT - 96}" y="{GRID_TOP - 97}" font-size="13" fill="{SOFT}">The room of '
        "the row imports from that of the column; the number: by how many imports.</text>",
    ]
    for i, name in enumerate(names):
        y, x = GRID_TOP + GRID_CELL * i, GRID_LEFT + GRID_CELL * i
        middle = GRID_CELL / 2
        parts += [
            f'<text x="{GRID_LEFT - 8}" y="{y + middle + 5:.0f}" text-anchor="end" '
            f'font-size="13">{name}</text>',
            f'<text transform="translate({x + middle + 4:.0f} {GRID_TOP - 8}) rotate(-60)" '
            f'font-size="13">{name}</text>',
            f'<rect x="{x}" y="{y}" width="{GRID_CELL}" height="{GRID_CELL}" fill="{EMPTY}"/>',
        ]
        for j, other in enumerate(names):
            number = found.get((name, other))
            if number:
                left = GRID_LEFT + GRID_CELL * j
                parts.append(
                    f'<rect x="{left}" y="{y}" width="{GRID_CELL}" height="{GRID_CELL}" '
                    f'fill="{ARROW}" fill-opacity="{min(0.75, 0.15 + 0.04 * number):.2f}"/><text '
                    f'x="{left + middle:.0f}" y="{y + middle + 4:.0f}" text-anchor="middle" '
                    f'font-size="11">{number}<title>{name} imports {other}</title></text>'
                )
    for i in range(len(names) + 1):
        at = GRID_CELL * i
        parts.append(
            f'<path d="M{GRID_LEFT} {GRID_TOP + at}h{size}M{GRID_LEFT + at} {GRID_TOP}v{size}" '
            f'stroke="{RULE}" stroke-width="0.7"/>'
        )
    return parts


def _contents(rooms: list[dict[str, Any]]) -> list[str]:
    """Return what is in each room, by the first line of its docstring."""
    left, top = GRID_LEFT - 96, GRID_TOP + GRID_CELL * len(rooms) + 44
    parts = [
        f'<text x="{left}" y="{top}" font-size="16" font-weight="bold">What is in them</text>'
    ]
    for index, room in enumerate(rooms):
        y = top + 26 + 21 * index
        first = room["says"].split("\n")[0].replace("``", "").split(maxsplit=2)[2]
        parts.append(
            f'<text x="{left}" y="{y}" font-size="12.5"><tspan font-weight="bold">{room["name"]}'
            f'</tspan><tspan x="{left + 88}" fill="{SOFT}">{escape(first)}</tspan></text>'
        )
    return parts
