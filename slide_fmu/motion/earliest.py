"""The move that settles first, beside what is usual in the field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.progress import Progress, quiet
from slide_fmu.motion.costs import residual, settled
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


def earliest(problem: Problem, progress: Progress = quiet) -> Found:
    """Find the move that settles first, with its margin: an optimised one, or a baseline.

    The progress is told how many durations were tried.

    Raises:
        MotionError: no move settles within the tolerance, or as for ``baselines``.
    """
    response, profile, known = baselines(problem)
    times = [move.cost(settled, response, problem.tolerance) for move in known]
    first = known[int(np.argmin(times))]
    # an optimised move settles when it arrives, so later ones than the best baseline are no use
    last = min(int(np.searchsorted(response.output_time, min(times))), response.samples + 1)
    tried = range(known[0].end, last)
    margin = min(float(move.margin[move.end :].max()) for move in known)
    allowed = PLANNED * (problem.tolerance - margin)
    for count, end in enumerate(tried if allowed > 0 else ()):
        progress(count, len(tried))
        motion = shaped_move(response, profile, float(response.time[end]), NONE)
        planned = shape(response, problem.limits, motion, end, allowed)
        kept = problem.limits.kept(problem.start, planned.motion, response.step)
        if planned.largest > allowed or not kept:
            continue
        move = described(response, "optimised", planned.motion, end)
        if move.cost(settled, response, problem.tolerance) < min(times):
            progress(len(tried), len(tried))
            return Found(response, move, tuple(known))
    progress(len(tried), len(tried))
    if not np.isfinite(min(times)):
        raise MotionError(_nothing(problem, response, margin, known))
    return Found(response, first, tuple(known))


def _nothing(problem: Problem, response: Response, margin: float, known: list[Move]) -> str:
    unit = problem.unit
    least = min(move.cost(residual, response, problem.tolerance) for move in known)
    return (
        f"tolerance {problem.tolerance:g} {unit}; no move was found that settles within it: the "
        f"best of those tried leaves {least:.3g} {unit}, and after it predictions may be off by "
        f"{margin:.3g} {unit}: raise the tolerance"
    )
