"""The move that rings least after a given time, beside what is usual in the field."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.progress import Progress, quiet
from slide_fmu.motion.costs import residual
from slide_fmu.motion.earliest import Found, ringing_shapers
from slide_fmu.motion.move import Move, described
from slide_fmu.motion.moves import arrivals, shaped_move
from slide_fmu.motion.problem import Problem
from slide_fmu.motion.records import MotionError
from slide_fmu.motion.shape import shape
from slide_fmu.motion.shapers import NONE

LEAST = 0.01
"""What a plain move leaves is brought down to this part of it at most: less is not planned."""


def quietest(problem: Problem, duration: float, progress: Progress = quiet) -> Found:
    """Find the move of a given time that leaves least; what is below the margin counts as nothing.

    Args:
        problem: the move.
        duration: time in s in which the goal is reached.
        progress: is told of the begin and the end.

    Raises:
        MotionError: the limits ask for more time, or as for ``ringing_shapers``.
    """
    progress(0, 1)
    profile, least, rows = ringing_shapers(problem)
    step = problem.surrogate.window.step
    duration = step * np.floor(duration / step + 1e-9)
    if duration < least:
        raise MotionError(
            f"duration {duration:g} s, in whole steps; expected at least {least:.4g} s, which the "
            "limits and the step need: give the motion more time, or raise the limits"
        )
    response = problem.response(duration)
    known = []
    for row in rows:
        time = duration - row.delays[-1]
        if time < least:  # this shaper comes too late
            continue
        end = int(arrivals(response, np.array([time]), row.delays[None])[0])
        motion = shaped_move(response, profile, time, row)
        known.append(described(response, row.name, motion, end))
    plain = known[0]
    margin = float(plain.margin[plain.end :].max())

    def left(move: Move) -> float:
        return move.cost(residual, response, problem.tolerance)

    allowed = max(margin, LEAST * left(plain))
    begin = shaped_move(response, profile, duration, NONE)
    planned = shape(response, problem.limits, begin, plain.end, allowed)
    optimised = described(response, "optimised", planned.motion, plain.end)
    progress(1, 1)
    both: list[Move] = [optimised, *known]
    return Found(response, min(both, key=left), tuple(known))
