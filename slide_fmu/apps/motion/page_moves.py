"""Moves of a task as a page shows them: the chosen one beside the one that is not shaped."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slide_fmu.apps.motion.costs import settled
from slide_fmu.apps.motion.records import MotionError
from slide_fmu.apps.motion.solve import Solved, solve
from slide_fmu.apps.motion.task import MoveTask, read_task
from slide_fmu.core.figures import JsonObject

AFTER = 0.3
"""A page shows so many seconds more after the last move has settled, as far as it is known."""

UNSHAPED = "fastest profile"
"""How a page calls the first baseline, which is not shaped."""


def moves_of(solved: Solved) -> JsonObject:
    """Return the chosen move and the first baseline as plain values.

    Physical parameters are those at which they were chosen, by name. Inputs are columns, whose
    rows are set at their times in s. The first row is the last one of rest. Moving inputs are
    known ahead: each row is set one step before its time, and reached by the step's end.
    """
    response = solved.found.response
    shown = dict(zip((solved.moves[0].name, UNSHAPED), solved.moves, strict=False))
    terms = settled, response, solved.task.tolerance, False
    late = max(move.cost(*terms) for move in shown.values()) + AFTER
    last = response.count if np.isinf(late) else min(response.count, round(late / response.step))
    rows = slice(response.lead - 1, response.lead + last)
    records = [response.record(move.motion)[rows] for move in shown.values()]
    begin = -response.step if solved.surrogate.hold == "first_order" else 0.0
    time = begin + response.step * np.arange(len(records[0]))
    return {
        "time": time.tolist(),
        "tolerance": solved.task.tolerance,
        "parameters": dict(solved.task.parameters),
        "moves": [
            {
                "name": name,
                "arrives": float(response.output_time[move.end]),
                "inputs": record.T.tolist(),
            }
            for (name, move), record in zip(shown.items(), records, strict=True)
        ],
    }


def solved_moves(fmu: Path, task: Path) -> JsonObject:
    """Choose the move of a task, a TOML file, with an FMU, and return it for its page.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        MotionError: the task is not one of a move, does not fit the FMU, or has no answer.
    """
    read = read_task(task)
    if not isinstance(read, MoveTask):
        raise MotionError(
            f"task {str(task)!r} is a path to follow; expected a move from a start to a goal, "
            "which a page can show: give kind, start and goal"
        )
    return moves_of(solve(fmu, read))
