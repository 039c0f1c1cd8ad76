"""A task describes a motion in TOML."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from slide_fmu.apps.motion.coordinates import Coordinate
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.problem import ViaPoints
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind
from slide_fmu.recipe.learning import PositiveFloat, PositiveInt, Table
from slide_fmu.recipe.mistake_lines import mistake_lines
from slide_fmu.recipe.reading import read_recipe_text
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.surrogate.surrogate import Surrogate

EXAMPLE = "docs/tutorials/pick_and_place.toml"

Numbers = tuple[Annotated[float, Field(allow_inf_nan=False)], ...]


class LimitsTable(Table):
    """LimitsTable has one number for each coordinate, in order; no limit if empty.

    Attributes:
        speed, acceleration, jerk: in the coordinate's unit per s, s^2 and s^3.
    """

    speed: tuple[PositiveFloat, ...] = ()
    acceleration: tuple[PositiveFloat, ...] = ()
    jerk: tuple[PositiveFloat, ...] = ()


Parameters = dict[str, Annotated[float, Field(allow_inf_nan=False)]]
"""Values of physical parameters by name; missing ones have start values."""


class MoveTask(Table):
    """A MoveTask is a task to move from rest to rest.

    Attributes:
        kind: ``"earliest"`` settles as early as possible; ``"quietest"`` has the least vibration
            after ``duration``; ``"choose"`` takes the best of many candidates.
        start, goal: coordinates, in the order of the FMU's inputs.
        via: points that the motion passes, in their order, without resting there.
        via_tolerance: largest distance from them, for each coordinate, in its unit.
        tolerance: distance of the outputs from rest that counts as settled, in their unit; as a
            norm over all outputs.
        duration: duration of the quietest motion, in s.
        minimise: cost by which candidates are chosen.
        candidates: number of candidates.
        longest: time of the slowest candidates, as a multiple of the time that the limits need.
        margin_factor: factor on the margins of predictions; of the FMU's recipe if None.
        limits: limits of the motion.
        straight: whether the earliest move stays on the line from start to goal.
        parameters: physical parameters of the surrogate, by name.
    """

    kind: Literal["earliest", "quietest", "choose"]
    start: Numbers = Field(min_length=1)
    goal: Numbers = Field(min_length=1)
    tolerance: PositiveFloat
    via: tuple[Numbers, ...] = ()
    via_tolerance: tuple[PositiveFloat, ...] = ()
    duration: PositiveFloat | None = None
    minimise: Literal["settled", "residual", "largest"] = "settled"
    candidates: PositiveInt = 10000
    longest: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 1.5
    margin_factor: PositiveFloat | None = None
    straight: bool = False
    limits: LimitsTable = LimitsTable()
    parameters: Parameters = Field(default_factory=dict)

    def points(self, coordinates: tuple[Coordinate, ...]) -> tuple[FloatArray, FloatArray]:
        """Return start and goal, (n_coordinates,) each."""
        for name, values in (("start", self.start), ("goal", self.goal)):
            _require_point(name, values, coordinates)
        return np.array(self.start), np.array(self.goal)

    def via_points(self, coordinates: tuple[Coordinate, ...]) -> ViaPoints | None:
        """Return the points to pass, if there are some."""
        if not self.via:
            return None
        for index, values in enumerate(self.via, start=1):
            _require_point(f"via {index}", values, coordinates)
        _require_one_each("via_tolerance", self.via_tolerance, coordinates)
        return ViaPoints(np.array(self.via), np.array(self.via_tolerance))


class PathTask(Table):
    """A PathTask is a task to follow a path, so that the outputs go where they are wished to be.

    Attributes:
        kind: ``"compensate"``.
        path: a file with a column for every input, and one of times. Columns of outputs have their
            wished values; without them, the tool of a serial chain must move as if its links were
            rigid. The file lies next to the task, or in the current folder.
        knots: time in s between the knots of the corrections; three samples if not given.
        limits: limits of the corrected path.
        parameters: as for ``MoveTask``.
    """

    kind: Literal["compensate"]
    path: str
    knots: PositiveFloat | None = None
    limits: LimitsTable = LimitsTable()
    parameters: Parameters = Field(default_factory=dict)


Task = Annotated[MoveTask | PathTask, Field(discriminator="kind")]
"""The content of a task file; its ``kind`` decides which task it is."""


def at_parameters(surrogate: Surrogate, values: Parameters) -> Surrogate:
    """Return a surrogate at the parameters of a task.

    Raises:
        MotionError: a name is unknown, or a value lies outside its range.
    """
    try:
        return surrogate.at(values)
    except ValueError as error:
        raise MotionError(f"the task's table parameters: {error}") from error


def limits_of(table: LimitsTable, coordinates: tuple[Coordinate, ...]) -> Limits:
    """Return limits, with the ranges of the coordinates."""
    derivatives = []
    for name in ("speed", "acceleration", "jerk"):
        values = getattr(table, name)
        if values:
            _require_one_each(f"limits.{name}", values, coordinates)
        derivatives.append(np.array(values or [math.inf] * len(coordinates)))
    low, high = (np.array([getattr(c, end) for c in coordinates]) for end in ("low", "high"))
    return Limits(low, high, *derivatives)


def _require_point(
    name: str, values: tuple[float, ...], coordinates: tuple[Coordinate, ...]
) -> None:
    _require_one_each(name, values, coordinates)
    for coordinate, value in zip(coordinates, values, strict=True):
        if not coordinate.low <= value <= coordinate.high:
            raise MotionError(
                f"{name} of {coordinate.name} is {value:g}{behind(coordinate.unit)}; expected "
                f"{coordinate.low:g} to {coordinate.high:g}, the range that the FMU declares: "
                "move the point"
            )


def _require_one_each(
    name: str, values: tuple[float, ...], coordinates: tuple[Coordinate, ...]
) -> None:
    if len(values) != len(coordinates):
        raise MotionError(
            f"{name} has {len(values)} numbers; expected {len(coordinates)}, one for each of "
            f"{[f'{c.name} ({c.unit})' for c in coordinates]}: correct the list"
        )


def read_task(path: Path) -> MoveTask | PathTask:
    """Read a task from a TOML file.

    Raises:
        MotionError: the file cannot be read, or is not a task; one line per mistake.
    """
    try:
        tables = tomllib.loads(read_recipe_text(path))
        task: MoveTask | PathTask = TypeAdapter(Task).validate_python(
            {"kind": "compensate" if "path" in tables else "earliest", **tables}
        )
    except tomllib.TOMLDecodeError as error:
        raise MotionError(f"{path}: not valid TOML: {error}") from error
    except ValidationError as error:
        raise MotionError(_without_kind(mistake_lines(error, str(path), "task"))) from error
    except RecipeError as error:
        text = str(error).replace("recipe ", "task ", 1)
        raise MotionError(text.replace("training/duffing.toml", EXAMPLE)) from error
    if isinstance(task, PathTask):
        near = path.parent / task.path
        return task.model_copy(update={"path": str(near)}) if near.is_file() else task
    if (task.duration is None) == (task.kind == "quietest"):
        raise MotionError(
            f"{path}: kind = {task.kind!r} {'without' if task.duration is None else 'with'} "
            "duration; expected one for 'quietest' alone: add it, or remove it"
        )
    if bool(task.via) != bool(task.via_tolerance):
        raise MotionError(
            f"{path}: {'via' if task.via else 'via_tolerance'} alone; expected both via and "
            "via_tolerance, or neither: add the other one, or remove it"
        )
    unused = sorted({"minimise", "candidates", "longest"} & task.model_fields_set)
    if unused and task.kind != "choose":
        raise MotionError(
            f"{path}: kind = {task.kind!r} with {unused}; expected these for 'choose' alone: "
            "remove them"
        )
    if task.straight and task.kind != "earliest":
        raise MotionError(
            f"{path}: kind = {task.kind!r} with straight = true; expected it for 'earliest' "
            "alone, since others go straight where they pass no points: remove it"
        )
    return task


def _without_kind(text: str) -> str:
    """Remove the choice of the union, which is not part of a key."""
    for kind in ("earliest", "quietest", "choose", "compensate"):
        text = text.replace(f": {kind}.", ": ").replace(f" of {kind}.", " of ")
    return text.replace(": task.kind = ", ": kind = ")
