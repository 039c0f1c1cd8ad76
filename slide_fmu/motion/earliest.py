"""The earliest move that leaves no more than a tolerance, beside what is usual in the field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.motion.move import Move, described
from slide_fmu.motion.moves import arrivals, shaped_move
from slide_fmu.motion.problem import Problem
from slide_fmu.motion.profile import Profiles, fastest
from slide_fmu.motion.records import MotionError
from slide_fmu.motion.response import Response
from slide_fmu.motion.shape import shape
from slide_fmu.motion.shapers import NONE, Shaper, ringing_modes, shapers

SUPPORT = 2
"""So many samples after a motion's end its response is not free yet: the inputs' spline ends."""

PLANNED = 0.7
"""A plan uses this part of what the margin leaves of the tolerance: margins differ from move to
move."""


@dataclass(frozen=True, eq=False)
class Found:
    """Moves that were found for a task.

    Attributes:
        response: of all of them.
        move: the best one.
        baselines: the fastest profile as it is, and behind shapers.
    """

    response: Response
    move: Move
    baselines: tuple[Move, ...]


def ringing_shapers(problem: Problem) -> tuple[Profiles, float, list[Shaper]]:
    """Give the fastest profile, its time in s, and shapers on the modes that it leaves ringing.

    The first of the shapers is none.

    Raises:
        MotionError: as for ``Response``.
    """
    profile, time = fastest(problem.goal - problem.start, problem.limits)
    time = max(time, problem.surrogate.window.step)
    response = problem.response(time)
    plain = shaped_move(response, profile, time, NONE)
    free = response.outputs(plain[None])[0, response.samples + SUPPORT :]
    return profile, time, [NONE, *shapers(ringing_modes(free, response.step))]


def baselines(problem: Problem) -> tuple[Response, Profiles, list[Move]]:
    """Give the fastest profile, as it is and behind shapers, with the response of all.

    Raises:
        MotionError: as for ``ringing_shapers``.
    """
    profile, time, rows = ringing_shapers(problem)
    response = problem.response(time + max(row.delays[-1] for row in rows))
    found = []
    for row in rows:
        end = int(arrivals(response, np.array([time]), row.delays[None])[0])
        motion = shaped_move(response, profile, time, row)
        found.append(described(response, row.name, motion, end))
    return response, profile, found


def earliest(problem: Problem, progress: Progress) -> Found:
    """Find the earliest move whose predicted residual, with its margin, is within the tolerance.

    The progress is told how many durations were tried.

    Raises:
        MotionError: no move within the tolerance was found, or as for ``baselines``.
    """
    response, profile, known = baselines(problem)
    tolerance = problem.tolerance
    ends = [move.end for move in known if left_by(move) <= tolerance]
    plain, last = known[0], min(ends, default=response.samples)
    margin = min(float(move.margin[move.end :].max()) for move in known)
    allowed = PLANNED * (tolerance - margin)
    tried = range(plain.end, last + 1)
    if allowed > 0:
        for count, end in enumerate(tried):
            progress(count, len(tried))
            motion = shaped_move(response, profile, float(response.time[end]), NONE)
            planned = shape(response, problem.limits, motion, end, allowed)
            if planned.largest > allowed:
                continue
            move = described(response, "optimised", planned.motion, end)
            if left_by(move) <= tolerance:
                progress(len(tried), len(tried))
                return Found(response, move, tuple(known))
    progress(len(tried), len(tried))
    if not ends:
        raise MotionError(_nothing(problem, margin, known))
    best = min((move for move in known if left_by(move) <= tolerance), key=lambda m: m.end)
    return Found(response, best, tuple(known))


def left_by(move: Move) -> float:
    """What a move leaves at most, with its margin, as a norm in the outputs' unit."""
    away = np.linalg.norm(move.outputs, axis=1) + move.margin
    return float(away[move.end :].max())


def _nothing(problem: Problem, margin: float, known: list[Move]) -> str:
    unit, least = problem.unit, min(left_by(move) for move in known)
    return (
        f"tolerance {problem.tolerance:g} {unit}; no move was found that stays within it: the "
        f"best shaper leaves {least:.3g} {unit}, and after it predictions may be off by "
        f"{margin:.3g} {unit}: ask for more"
    )
