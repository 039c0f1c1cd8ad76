"""A page may draw a machine in motion, from a description in plain values without a program.

Numbers in it are expressions: a number; the name of an input, output, parameter or earlier value;
or a list of an operation and its arguments, such as ``["*", 0.5, "speed"]``.

| key | what it is |
| --- | --- |
| ``text`` | what is seen, for people, above all a scale that is not the true one |
| ``view`` | what is shown of the plane that is drawn on: lowest and highest x, then y, in m |
| ``camera`` | azimuth and elevation in degrees from which space is seen; None in the plane |
| ``values`` | pairs of a name and an expression, found one after the other |
| ``points`` | by name, two expressions, or three with a camera, in m |
| ``shapes`` | in the order of drawing: ``line`` (names of points) with a ``width`` in m, or |
| | ``disc`` (name of a point) with a ``radius`` in m; both have a ``colour``; with a camera, |
| | all but thin lines are shaded rods and balls |
| ``trail`` | name of a point whose last two seconds are drawn; None without one |
| ``magnification`` | factor on deflections at the start, which users change; expressions use |
| | it by the name ``magnification``; None without one |
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from slide_fmu.systems.user_code import imported_function

OPERATIONS = {"+": 2, "-": 2, "*": 2, "/": 2, "sqrt": 1, "sin": 1, "cos": 1}
"""Operations of expressions, with their numbers of arguments; angles are in rad."""

Colour = Literal["body", "accent", "joint", "ground", "arm", "motor", "soft", "hand"]


class DrawingError(ValueError):
    """A drawing does not have the form that a page needs."""


class Shape(BaseModel):
    """A Shape is a line through points or a disc about one."""

    model_config = ConfigDict(extra="forbid")
    line: list[str] | None = None
    width: float = 0.0
    disc: str | None = None
    radius: float = 0.0
    colour: Colour = "body"

    @property
    def points(self) -> list[str]:
        """The names of its points."""
        return [*(self.line or []), *([] if self.disc is None else [self.disc])]


class Drawing(BaseModel):
    """A Drawing describes the look of a machine for its inputs and outputs."""

    model_config = ConfigDict(extra="forbid")
    text: str
    view: tuple[float, float, float, float]
    camera: tuple[float, float] | None = None
    values: list[tuple[str, Any]] = []
    points: dict[str, list[Any]]
    shapes: list[Shape]
    trail: str | None = None
    magnification: float | None = None

    def plain(self) -> Any:
        """Return the description as plain values."""
        return self.model_dump(mode="json", exclude_none=True)


def load_drawing(name: str, signals: Collection[str]) -> Drawing:
    """Call the function that describes a drawing, and check what it returns.

    Args:
        name: ``"package.module:function"`` or ``"file.py:function"``; it takes no arguments.
        signals: names of inputs, outputs and parameters of the surrogate.

    Raises:
        DrawingError: the drawing is not usable; the message has the reason.
        LoadError: the module cannot be imported, or has no such function.
    """
    expected = "takes nothing and returns the description of a drawing"
    describe = imported_function(f"drawing {name!r}", name, expected)
    return checked_drawing(describe(), signals, name)


def checked_drawing(description: Any, signals: Collection[str], name: str) -> Drawing:
    """Check a description in plain values, and return its drawing.

    Raises:
        DrawingError: a key is missing, unknown or of the wrong form, or a name is unknown.
    """
    try:
        drawing = Drawing.model_validate(description)
    except ValidationError as error:
        places = [
            f"{'.'.join(map(str, item['loc']))} = {item['input']!r:.60}: {item['msg']}"
            for item in error.errors()
        ]
        raise DrawingError(f"drawing {name!r}: {'; '.join(places)}") from error
    known = {*signals, *(() if drawing.magnification is None else ("magnification",))}
    for value, expression in drawing.values:
        _check(expression, known, f"drawing {name!r}, value {value!r}")
        known.add(value)
    dimensions = 2 if drawing.camera is None else 3
    for point, coordinates in drawing.points.items():
        if len(coordinates) != dimensions:
            raise DrawingError(
                f"drawing {name!r}, point {point!r} has {len(coordinates)} coordinates; expected "
                f"{dimensions}"
            )
        for coordinate in coordinates:
            _check(coordinate, known, f"drawing {name!r}, point {point!r}")
    if drawing.trail is not None and drawing.trail not in drawing.points:
        raise DrawingError(
            f"drawing {name!r}, trail = {drawing.trail!r}; expected one of "
            f"{sorted(drawing.points)}"
        )
    for shape in drawing.shapes:
        missing = [point for point in shape.points if point not in drawing.points]
        if missing or not shape.points:
            raise DrawingError(
                f"drawing {name!r}, shape {shape.model_dump(exclude_none=True)} with unknown "
                f"points {missing}; expected some of {sorted(drawing.points)}"
            )
    return drawing


def _check(expression: Any, known: set[str], where: str) -> None:
    """Reject an expression with an unknown name or operation."""
    if isinstance(expression, str):
        if expression not in known:
            raise DrawingError(f"{where}: {expression!r}; expected one of {sorted(known)}")
    elif isinstance(expression, Sequence) and len(expression) > 0:
        operation, *arguments = expression
        if OPERATIONS.get(operation) != len(arguments):
            raise DrawingError(
                f"{where}: operation {operation!r} with {len(arguments)} arguments; expected one "
                f"of {OPERATIONS}"
            )
        for argument in arguments:
            _check(argument, known, where)
    elif not isinstance(expression, int | float):
        raise DrawingError(f"{where}: {expression!r}; expected a number, a name or an operation")
