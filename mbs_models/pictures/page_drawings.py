"""Pages draw the machines in motion from these descriptions (``slide-fmu page --drawing``).

Each function returns a description in plain values; ``slide_fmu/apps/page/drawing.py`` defines its
form.
"""

from __future__ import annotations

import itertools
from typing import Any, NotRequired, TypedDict

import numpy as np

from mbs_models.mass_chain.mass_chain import LOADED, MASSES, OBSERVED
from mbs_models.robot_6r.puma_560 import JOINTS, puma_560
from mbs_models.robot_6r.socket import SocketMesh
from mbs_models.slider_crank.slider_crank_plant import CRANK_LENGTH, ROD_LENGTH

Expression = Any


class Shape(TypedDict, total=False):
    """A Shape is a line through points with a width in m, or a disc about one with a radius."""

    line: list[str]
    width: float
    disc: str
    radius: float
    colour: str


class Drawing(TypedDict):
    """A Drawing describes a machine for a page."""

    text: str
    view: tuple[float, float, float, float]
    camera: NotRequired[tuple[float, float]]
    values: NotRequired[list[tuple[str, Expression]]]
    points: dict[str, list[Expression]]
    shapes: list[Shape]
    trail: NotRequired[str]
    magnification: NotRequired[float]


MAGNIFICATION = "magnification"
"""Name of the factor on deflections, which users of a page choose."""
SPACING, CHAIN_SCALE = 0.5, 2.0
"""Distance of the chain's masses in m, and the factor on their drawn positions."""
COILS, REST = 12, 3.2
"""Number of half turns of an oscillator's spring, and its length at rest in m."""
ROD_PARTS, DEFLECTION_SCALE = 12, 3.0
"""Number of parts of the rod, and the factor on its drawn deflection."""
HAND, DEVIATION_SCALE, SOCKET_PARTS = 0.1, 25.0, 6
"""Length of the hand in m, the factor on the drawn deviation of the tool, and the number of parts
of the socket."""


def oscillator() -> Drawing:
    """Return the drawing of a mass on a spring, which the force pushes along x."""
    points: dict[str, list[Expression]] = {
        "wall_low": [-REST, -0.6],
        "wall_high": [-REST, 0.6],
        "floor_left": [-REST, -0.42],
        "floor_right": [REST, -0.42],
        "mass": ["position", 0.0],
        "push": [_plus("position", _times(1e-3, "force")), 0.0],
    }
    spring = [f"coil_{i}" for i in range(COILS + 1)]
    for i, name in enumerate(spring):
        part = i / COILS
        height = 0.0 if i in (0, COILS) else 0.22 * (-1) ** i
        points[name] = [_plus((part - 1) * REST, _times(part, "position")), height]
    return {
        "text": "the mass on its spring; the bar at the mass is the force, 1 m long for 1 kN",
        "view": (-3.4, 2.8, -0.75, 0.75),
        "points": points,
        "shapes": [
            {"line": ["wall_low", "wall_high"], "width": 0.06, "colour": "ground"},
            {"line": ["floor_left", "floor_right"], "width": 0.03, "colour": "ground"},
            {"line": spring, "width": 0.05, "colour": "body"},
            {"disc": "mass", "radius": 0.36, "colour": "accent"},
            {"line": ["mass", "push"], "width": 0.09, "colour": "joint"},
        ],
    }


def mass_chain() -> Drawing:
    """Return the drawing of the chain; masses with an output move.

    The others are drawn halfway between their neighbours, walls included: the surrogate does not
    know their positions.
    """
    known: dict[int, Expression] = {i + 1: f"position_{i + 1}" for i in OBSERVED}
    moved = {0: 0.0, **known, MASSES + 1: 0.0}
    points: dict[str, list[Expression]] = {}
    for i in range(MASSES + 2):
        lower, upper = max(k for k in moved if k <= i), min(k for k in moved if k >= i)
        way = _times(0.5, _plus(moved[lower], moved[upper]))
        place = _plus(i * SPACING, _times(CHAIN_SCALE, way))
        points[f"place_{i}"] = [place, 0.0]
    end = (MASSES + 1) * SPACING
    for i in LOADED:
        push = _plus(points[f"place_{i + 1}"][0], _times(1e-3, f"force_{i + 1}"))
        points[f"push_{i + 1}"] = [push, 0.0]
    for side, x in (("left", 0.0), ("right", end)):
        points |= {f"{side}_low": [x, -0.2], f"{side}_high": [x, 0.2]}
    masses = range(1, MASSES + 1)
    return {
        "text": f"positions are drawn {CHAIN_SCALE:g} times as large; the masses in grey are no "
        "outputs and stand halfway between the others; a bar of 1 m is a force of 1 kN",
        "view": (-0.15, end + 0.15, -0.35, 0.35),
        "points": points,
        "shapes": [
            {"line": ["left_low", "left_high"], "width": 0.03, "colour": "ground"},
            {"line": ["right_low", "right_high"], "width": 0.03, "colour": "ground"},
            {"line": ["place_0", f"place_{MASSES + 1}"], "width": 0.02, "colour": "body"},
            *(
                Shape(disc=f"place_{i}", radius=0.09, colour="accent" if i in known else "ground")
                for i in masses
            ),
            *(
                Shape(line=[f"place_{i + 1}", f"push_{i + 1}"], width=0.04, colour="joint")
                for i in LOADED
            ),
        ],
    }


def slider_crank() -> Drawing:
    """Return the drawing of the slider-crank, whose rod bends."""
    crank_x, crank_y = _times(CRANK_LENGTH, "director_x"), _times(CRANK_LENGTH, "director_y")
    values: list[tuple[str, Expression]] = [
        ("tip_x", crank_x),
        ("tip_y", crank_y),
        ("along", ["sqrt", ["-", ROD_LENGTH**2, ["*", "tip_y", "tip_y"]]]),
        ("bend", ["*", MAGNIFICATION, _times(4 / ROD_LENGTH, "deflection")]),
    ]
    reach = CRANK_LENGTH + ROD_LENGTH
    points: dict[str, list[Expression]] = {
        "pivot": [0.0, 0.0],
        "tip": ["tip_x", "tip_y"],
        "slider": [_plus("tip_x", "along"), 0.0],
        "slider_left": [_plus(_plus("tip_x", "along"), -0.08), 0.0],
        "slider_right": [_plus(_plus("tip_x", "along"), 0.08), 0.0],
        "rail_left": [ROD_LENGTH - CRANK_LENGTH - 0.15, -0.08],
        "rail_right": [reach + 0.15, -0.08],
    }
    rod = [f"rod_{i}" for i in range(ROD_PARTS + 1)]
    for i, name in enumerate(rod):
        part = i / ROD_PARTS
        # the deflection is positive on the left of the way from the crank to the slider
        bow = _times(part * (1 - part), "bend")
        x = _plus(_plus("tip_x", _times(part, "along")), ["*", bow, "tip_y"])
        points[name] = [x, _plus(_times(1 - part, "tip_y"), ["*", bow, "along"])]
    return {
        "text": "the rod bends to one side by the deflection in its middle",
        "magnification": DEFLECTION_SCALE,
        "view": (-0.62, reach + 0.25, -0.62, 0.62),
        "values": values,
        "points": points,
        "shapes": [
            {"line": ["rail_left", "rail_right"], "width": 0.02, "colour": "ground"},
            {"line": ["slider_left", "slider_right"], "width": 0.12, "colour": "ground"},
            {"line": ["pivot", "tip"], "width": 0.05, "colour": "body"},
            {"line": rod, "width": 0.025, "colour": "accent"},
            *(Shape(disc=p, radius=0.03, colour="joint") for p in ("pivot", "tip", "slider")),
        ],
    }


def robot() -> Drawing:
    """Return the drawing of the Puma 560 on its socket, at the desired joint angles.

    The deviation of the tool grows from zero at the socket's bottom to its full size at the tool.
    """
    values, places, axes = _arm()
    values += [(f"off_{a}", ["*", MAGNIFICATION, f"deviation_{a}"]) for a in "xyz"]
    names = ["base", *(f"link_{i}" for i in range(1, JOINTS + 1)), "tool"]
    heights: list[list[Expression]] = [[0.0, 0.0, 0.0]]
    points: dict[str, list[Expression]] = {}
    for i, (name, place) in enumerate(zip(names, [*heights, *places], strict=True), start=1):
        points[name] = _moved(place, i / len(names))
    for i in range(SOCKET_PARTS + 1):  # a beam that is clamped at its bottom
        part = i / SOCKET_PARTS
        place = [0.0, 0.0, (part - 1) * SocketMesh.length]
        points[f"socket_{i}"] = _moved(place, part**2 / len(names))
    for name, (frame, reach) in {"shoulder": (1, 0.1), "elbow": (2, 0.09)}.items():
        for end, sign in (("left", -1.0), ("right", 1.0)):
            across = zip(points[f"link_{frame}"], axes[frame - 1], strict=True)
            points[f"{name}_{end}"] = [_plus(p, _times(sign * reach, axis)) for p, axis in across]
    floor: list[Shape] = []
    for axis, (k, x) in itertools.product((0, 1), enumerate(np.linspace(-0.6, 0.6, 7).tolist())):
        ends = [f"floor_{axis}{k}{sign}" for sign in _SIGNS]
        for name, sign in zip(ends, _SIGNS, strict=True):
            points[name] = [*([0.6 * sign, x] if axis else [x, 0.6 * sign]), -SocketMesh.length]
        floor.append({"line": ends, "width": 0.005, "colour": "ground"})
    socket = [f"socket_{i}" for i in range(SOCKET_PARTS + 1)]
    return {
        "text": "the socket bends; the whole arm moves with it by the deviation of the tool",
        "view": (-0.85, 0.85, -0.62, 0.95),
        "camera": (-52.0, 20.0),
        "magnification": DEVIATION_SCALE,
        "trail": "tool",
        "values": values,
        "points": points,
        "shapes": [
            *floor,
            {"line": socket, "width": 0.1, "colour": "soft"},
            {"line": ["base", "link_1"], "width": 0.116, "colour": "arm"},
            {"line": ["shoulder_left", "shoulder_right"], "width": 0.132, "colour": "motor"},
            {"line": ["link_1", "link_2"], "width": 0.1, "colour": "arm"},
            {"line": ["elbow_left", "elbow_right"], "width": 0.104, "colour": "motor"},
            {"line": ["link_2", "link_3"], "width": 0.09, "colour": "motor"},
            {"line": ["link_3", "link_4"], "width": 0.075, "colour": "arm"},
            {"disc": "link_4", "radius": 0.05, "colour": "motor"},
            {"line": ["link_4", "tool"], "width": 0.045, "colour": "hand"},
            {"disc": "tool", "radius": 0.032, "colour": "hand"},
        ],
    }


def _moved(place: list[Expression], share: float) -> list[Expression]:
    """Return a place that moves by a share of the tool's magnified deviation."""
    return [_plus(p, _times(share, f"off_{axis}")) for p, axis in zip(place, "xyz", strict=True)]


_SIGNS = (-1, 1)


def _arm() -> tuple[list[tuple[str, Expression]], list[list[Expression]], list[list[Expression]]]:
    """Return values, places of all link frames and of the tool, and the third axes of frames."""
    chain = puma_560(np.array([0.0, 0.0, HAND]))
    values: list[tuple[str, Expression]] = []
    place: list[Expression] = [0.0, 0.0, 0.0]
    turn: list[list[Expression]] = [[float(i == j) for j in range(3)] for i in range(3)]
    places, axes = [], []
    for link in range(JOINTS):
        number, alpha, (a, _, d) = link + 1, float(chain.alpha[link]), chain.steps[link].tolist()
        c, s = f"cos_{number}", f"sin_{number}"
        values += [(c, ["cos", f"joint_{number}"]), (s, ["sin", f"joint_{number}"])]
        step = [_times(a, c), _times(a, s), d]
        place = [_plus(p, _sum(row, step)) for p, row in zip(place, turn, strict=True)]
        ca, sa = round(float(np.cos(alpha)), 12), round(float(np.sin(alpha)), 12)
        local = [
            [c, _times(-ca, s), _times(sa, s)],
            [s, _times(ca, c), _times(-sa, c)],
            [0.0, sa, ca],
        ]
        turn = [[_sum(row, list(column)) for column in zip(*local, strict=True)] for row in turn]
        place = [_named(values, f"p{number}{i}", entry) for i, entry in enumerate(place)]
        turn = [
            [_named(values, f"r{number}{i}{j}", entry) for j, entry in enumerate(row)]
            for i, row in enumerate(turn)
        ]
        places.append(place)
        axes.append([row[2] for row in turn])
    tool = [_plus(p, _times(HAND, row[2])) for p, row in zip(place, turn, strict=True)]
    return values, [*places, tool], axes


def _named(values: list[tuple[str, Expression]], name: str, entry: Expression) -> Expression:
    """Give an expression a name, unless it is a number or a name."""
    if not isinstance(entry, list):
        return entry
    values.append((name, entry))
    return name


def _times(a: Expression, b: Expression) -> Expression:
    """Return a product, without factors of one; it is zero if a factor is."""
    if 0.0 in (a, b):
        return 0.0
    if a == 1.0 or b == 1.0:
        return b if a == 1.0 else a
    return ["*", a, b]


def _plus(a: Expression, b: Expression) -> Expression:
    """Return a sum, without zeros."""
    if a == 0.0 or b == 0.0:
        return b if a == 0.0 else a
    return ["+", a, b]


def _sum(row: list[Expression], column: list[Expression]) -> Expression:
    """Return the scalar product."""
    total: Expression = 0.0
    for a, b in zip(row, column, strict=True):
        total = _plus(total, _times(a, b))
    return total
