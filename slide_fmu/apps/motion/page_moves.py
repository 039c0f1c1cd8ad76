"""A page shows the chosen move of a task next to the unshaped one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.apps.motion.coordinates import coordinates_of
from slide_fmu.apps.motion.costs import settled
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.solve import MoveSolution, solve
from slide_fmu.apps.motion.task import MoveTask, read_task

AFTER = 0.3
"""Time in s that a page shows after the last move has settled, if it is known."""

UNSHAPED = "fastest profile"
"""Name of the first baseline, which is not shaped, on a page."""


@dataclass(frozen=True)
class ShownMove:
    """A ShownMove is a move as a page shows it.

    Attributes:
        name: name on the page.
        arrives: time in s at which its goal is reached.
        inputs: by input, its values at the times of ``ShownMoves``.
    """

    name: str
    arrives: float
    inputs: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class ShownLimits:
    """ShownLimits are the limits of one coordinate, in its unit, or in degrees for an angle."""

    speed: float
    acceleration: float


@dataclass(frozen=True)
class ShownMoves:
    """ShownMoves are moves that a page shows next to each other.

    Attributes:
        time: times in s at which inputs are set.
        tolerance: largest deviation of settled outputs.
        parameters: values of the physical parameters of the moves, by name.
        limits: of each coordinate; None where speed or acceleration has no limit.
        moves: the chosen one first, then the best shaper if there is one, the unshaped one last.
    """

    time: tuple[float, ...]
    tolerance: float
    parameters: Mapping[str, float]
    limits: tuple[ShownLimits | None, ...]
    moves: tuple[ShownMove, ...]


def moves_of(solved: MoveSolution) -> ShownMoves:
    """Return the chosen move, the shaped baseline that settles first, and the unshaped one.

    The first time is the last one of rest. Moving inputs are known ahead: they are set one step
    before their time, and reached by the end of the step.
    """
    response = solved.optimised.response
    terms = settled, response, solved.task.tolerance
    chosen, (plain, *shaped) = solved.moves[0], solved.optimised.baselines
    shown = {chosen.name: chosen}
    if shaped:
        best = min(shaped, key=lambda move: move.cost(*terms))
        if np.isfinite(best.cost(*terms)):
            shown[best.name] = best
    shown[UNSHAPED] = plain
    late = max(move.cost(*terms) for move in shown.values()) + AFTER
    last = response.count if np.isinf(late) else min(response.count, round(late / response.step))
    rows = slice(response.lead - 1, response.lead + last)
    sequences = [response.inputs(move.motion)[rows] for move in shown.values()]
    begin = -response.step if solved.surrogate.hold == "first_order" else 0.0
    time = begin + response.step * np.arange(len(sequences[0]))
    arrive = [float(response.output_time[move.end]) for move in shown.values()]
    inputs = [tuple(map(tuple, sequence.T.tolist())) for sequence in sequences]
    moves = tuple(ShownMove(*move) for move in zip(shown, arrive, inputs, strict=True))
    parameters = dict(solved.task.parameters)
    limits = _limits(solved)
    return ShownMoves(tuple(time.tolist()), solved.task.tolerance, parameters, limits, moves)


def _limits(solved: MoveSolution) -> tuple[ShownLimits | None, ...]:
    shown: list[ShownLimits | None] = []
    rows = zip(solved.limits.speed, solved.limits.acceleration, strict=True)
    for coordinate, (speed, acceleration) in zip(
        coordinates_of(solved.surrogate.inputs), rows, strict=True
    ):
        scale = 1.0 if coordinate.radius is None else float(np.rad2deg(1.0))
        limited = np.isfinite(speed) and np.isfinite(acceleration)
        shown.append(
            ShownLimits(scale * float(speed), scale * float(acceleration)) if limited else None
        )
    return tuple(shown)


def solved_moves(fmu: Path, task: Path) -> ShownMoves:
    """Choose the move of a task, a TOML file, with an FMU, and return it for its page.

    Raises:
        FmuError: the file is not an FMU of slide-fmu.
        MotionError: the task does not describe a move, does not fit the FMU, or has no answer.
    """
    read = read_task(task)
    if not isinstance(read, MoveTask):
        raise MotionError(
            f"task {str(task)!r} is a path to follow; expected a move from a start to a goal, "
            "which a page can show: give kind, start and goal"
        )
    return moves_of(solve(fmu, read))
