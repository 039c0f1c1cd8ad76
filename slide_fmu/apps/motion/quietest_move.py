"""The move with the least vibration after a given time is found, and compared with usual ones."""

from __future__ import annotations

import numpy as np

from slide_fmu.apps.motion.costs import residual
from slide_fmu.apps.motion.earliest_move import (
    OPTIMISED,
    OptimisedMove,
    not_within,
    ringing_shapers,
    shaped_moves,
)
from slide_fmu.apps.motion.move import Move, described
from slide_fmu.apps.motion.moves import shaped_shares
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.problem import MoveProblem
from slide_fmu.apps.motion.shape import shape
from slide_fmu.core.measures import percent
from slide_fmu.core.progress import Progress, quiet

LEAST_RESIDUAL = 0.01
"""Smallest fraction of a plain move's residual that is planned."""

ROUNDS = 4
"""Largest number of plans that the reference model verifies."""


def quietest(problem: MoveProblem, duration: float, progress: Progress = quiet) -> OptimisedMove:
    """Find the move of a given time with the least residual; below the margin it counts as zero.

    Args:
        problem: the move.
        duration: time in s in which the goal is reached.
        progress: called before every plan and at the end.

    Raises:
        MotionError: the limits need more time, all moves leave the surrogate's domain, the
            reference model confirms none, or as for ``ringing_shapers``.
    """
    profile, least, rows = ringing_shapers(problem)
    step, given = problem.surrogate.window.step, duration
    duration = step * np.floor(duration / step + 1e-9)
    if duration < least:
        raise MotionError(
            f"duration {given:g} s, which are {duration:.4g} s in whole steps; expected at least "
            f"{least:.4g} s, which the limits and the step need: give the motion more time, or "
            "raise the limits"
        )
    response = problem.response(duration)
    times = [(row, duration - row.delays[-1]) for row in rows]
    # other shapers come too late
    known = shaped_moves(problem, response, profile, [one for one in times if one[1] >= least])
    plain = known[0]
    margin = float(plain.margin[plain.end :].max())

    def left(move: Move) -> float:
        return move.trusted(residual, response, problem.tolerance)

    allowed = max(margin, LEAST_RESIDUAL * plain.cost(residual, response, problem.tolerance))
    begin = shaped_shares(response, profile, duration)
    tried, rounds, most = list(known), 0, 1 if problem.reference is None else ROUNDS
    while rounds < most:
        progress(rounds, most)
        planned = shape(response, problem.limits, begin, plain.end, allowed)
        if planned is None or not problem.admits(response, planned.motion):
            break
        rounds += 1
        tried.insert(0, move := described(response, OPTIMISED, planned.motion, plain.end))
        if problem.reference is not None:
            if left(move) <= allowed:
                break
            response = response.corrected(move.motion, move.outputs)
    progress(1, 1)
    best = min(tried, key=left)
    if problem.reference is None:
        rounds = 0
    elif left(best) > problem.tolerance:
        raise MotionError(not_within(problem, len(tried), left(best)))
    if not np.isfinite(left(best)):
        raise MotionError(
            f"all moves of {duration:g} s that were tried leave the domain of the surrogate "
            f"({percent(1 - best.known)} of the samples); outside its error bound says "
            "nothing: give the motion more time, or move start or goal"
        )
    return OptimisedMove(response, best, tuple(known), rounds=rounds)
