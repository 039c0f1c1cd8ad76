"""The move that settles first is found, and compared with the usual methods."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.motion.costs import residual, settled
from slide_fmu.apps.motion.move import Move, described, described_all
from slide_fmu.apps.motion.moves import arrivals, shaped_shares
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.problem import MoveProblem
from slide_fmu.apps.motion.response import Response
from slide_fmu.apps.motion.route import fastest_along, least_steps
from slide_fmu.apps.motion.shape import shape
from slide_fmu.apps.motion.shapers import NONE, Shaper, ringing_modes, shapers
from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.units import behind
from slide_fmu.excitation.speed_profile import SpeedProfiles

SUPPORT = 2
"""Samples after a motion's end in which its response is not free yet: the spline of inputs
ends."""

PLANNED = 0.7
"""Fraction of the tolerance minus margin that a plan uses: margins differ between moves."""

VERIFIED = 0.9
"""Fraction of the tolerance that a plan uses if the reference model verifies the move: the rest is
for the error of the prediction, which the second plan for a duration knows."""


SLOWER = (1.0, 1.5, 2.0, 3.0)
"""If moves leave the domain, slower ones with these multiples of the shortest time are tried."""

STRIDE = 0.05
"""If a move leaves the domain, the next one takes longer by this fraction of its time."""

ROUNDS = 8
"""Largest number of plans that the reference model verifies."""

TRIES = 2
"""Largest number of plans for one duration: the second one makes up for the first one's error."""

OPTIMISED = "optimised"
"""Name of the moves that are no baselines."""

LONGER = 1.1
"""Factor on the time of a profile along a curve whose samples break a limit or miss a point."""


@dataclass(frozen=True, eq=False)
class OptimisedMove:
    """An OptimisedMove is the best move for a task, next to the usual ones.

    Attributes:
        response: the response to all of them.
        move: the best one; it may be a baseline.
        baselines: the fastest profile, unshaped and with shapers.
        slower: factor on the shortest time of its profile, since faster ones leave the domain.
        rounds: number of plans that the reference model has answered, if it verifies the move.
    """

    response: Response
    move: Move
    baselines: tuple[Move, ...]
    slower: float = 1.0
    rounds: int = 0


def ringing_shapers(problem: MoveProblem) -> tuple[SpeedProfiles, float, list[Shaper]]:
    """Return the fastest profile, its time in s, and shapers for the modes that it excites.

    The first of the shapers does nothing. Along a curve the time is the shortest in which the
    samples pass the points and keep all limits.
    """
    problem.require_known_start()
    profile, time = fastest_along(problem.route, problem.limits)
    time = problem.slower * max(time, problem.surrogate.window.step)
    while True:
        response = problem.response(time)
        plain = problem.route.at(shaped_shares(response, profile, time))
        if problem.route.straight or problem.admits(response, plain):
            break
        time *= LONGER
    free = response.outputs(plain[None])[0, response.samples + SUPPORT :]
    return profile, time, [NONE, *shapers(ringing_modes(free, response.step))]


def baselines(problem: MoveProblem) -> tuple[Response, SpeedProfiles, list[Move]]:
    """Return the fastest profile, unshaped and with shapers, and the response to all.

    Along a curve, shapers are left out that move coordinates beyond their limits.
    """
    profile, time, rows = ringing_shapers(problem)
    response = problem.response(time + max(row.delays[-1] for row in rows))
    return response, profile, shaped_moves(problem, response, profile, [(r, time) for r in rows])


def shaped_moves(
    problem: MoveProblem,
    response: Response,
    profile: SpeedProfiles,
    rows: list[tuple[Shaper, float]],
) -> list[Move]:
    """Describe a profile with shapers, with the profile's time in s, if it keeps the limits."""
    shaped = []
    for row, time in rows:
        end = int(arrivals(response, np.array([time]), row.delays[None])[0])
        motion = problem.route.at(shaped_shares(response, profile, time, row))
        if row is NONE or problem.route.straight or problem.admits(response, motion):
            shaped.append((row.name, motion, end))
    return described_all(response, shaped) if shaped else []


def earliest(problem: MoveProblem, progress: Progress = quiet) -> OptimisedMove:
    """Find the move that settles first, with its margin: an optimised one, or a baseline.

    The whole move lies in the surrogate's domain: if no such move is found, slower ones are tried.
    If the problem has a reference model, its response counts instead of margin and domain, and an
    optimised move is settled when it arrives.
    The progress counts the durations tried.

    Raises:
        MotionError: no move settles within the tolerance, all of them leave the domain, or as for
            ``baselines``.
    """
    for slower in SLOWER:
        optimised = _first(dataclasses.replace(problem, slower=slower), progress)
        if optimised is not None:
            return optimised
    raise MotionError(
        f"no move was found that settles within {problem.tolerance:g}{behind(problem.unit)} and "
        "stays "
        f"in the domain of the surrogate, even {SLOWER[-1]:g} times slower than the limits admit; "
        "outside its error bound says nothing: lower the limits, raise the tolerance, or move "
        "start or goal"
    )


def _first(problem: MoveProblem, progress: Progress) -> OptimisedMove | None:
    """Find the move that settles first; None if moves leave the domain."""
    response, profile, known = baselines(problem)
    tolerance, seen, rounds = problem.tolerance, list(known), 0

    def time(move: Move) -> float:
        verified = problem.reference is not None and move.name == OPTIMISED
        late = verified and move.cost(residual, response, tolerance) > tolerance
        return np.inf if late else move.trusted(settled, response, tolerance)

    margin = min(float(move.margin[move.end :].max()) for move in known)
    begun = end = known[0].end
    if problem.route.straight:  # profiles are not quite the fastest
        way = problem.goal - problem.start
        begun = end = min(end, least_steps(way, problem.limits, response.step) - 1)
    last = response.samples + 1
    while margin < tolerance and rounds < ROUNDS:
        # a move that ends when another one has settled is too late
        first = min(map(time, seen))
        last = min(last, int(np.searchsorted(response.output_time, first)))
        if end >= last:
            break
        progress(end - begun, last - begun)
        moves, response = _of_duration(problem, response, profile, end, margin)
        seen += moves
        rounds += 0 if problem.reference is None else len(moves)
        # if one leaves the domain, one sample more would not help
        inside = all(move.known == 1 for move in moves)
        end += 1 if inside else max(1, round(STRIDE * end))
    progress(1, 1)
    if np.isfinite(time(best := min(seen, key=time))):
        return OptimisedMove(response, best, tuple(known), problem.slower, rounds)
    if any(move.known < 1 for move in seen):
        return None
    raise MotionError(_nothing(problem, response, margin, seen))


def _of_duration(
    problem: MoveProblem, response: Response, profile: SpeedProfiles, end: int, margin: float
) -> tuple[list[Move], Response]:
    """Plan moves that end at a sample, until one is settled then; return all, and the response.

    If a plan is not settled, the next one knows its margin, or with a reference model its error.
    """
    begin, moves = shaped_shares(response, profile, float(response.time[end])), []
    for _ in range(TRIES):
        part = PLANNED if problem.reference is None else VERIFIED
        allowed = part * (problem.tolerance - margin)
        if allowed <= 0:
            break
        planned = shape(response, problem.limits, begin, end, allowed, not problem.straight)
        if planned is None or planned.largest > allowed:
            break
        if not problem.admits(response, planned.motion):
            break
        moves.append(move := described(response, OPTIMISED, planned.motion, end))
        if problem.reference is not None:
            response = response.corrected(move.motion, move.outputs)
        if move.known < 1 or move.cost(residual, response, problem.tolerance) <= problem.tolerance:
            break
        margin = float(move.margin[end:].max())
    return moves, response


def _nothing(problem: MoveProblem, response: Response, margin: float, seen: list[Move]) -> str:
    unit = behind(problem.unit)
    left = min(move.cost(residual, response, problem.tolerance) for move in seen)
    if problem.reference is not None:
        return not_within(problem, len(seen), left)
    return (
        f"tolerance {problem.tolerance:g}{unit}; no move was found that settles within it: the "
        f"best of those tried leaves {left:.3g}{unit}, and after it predictions may be off by "
        f"{margin:.3g}{unit}: raise the tolerance"
    )


def not_within(problem: MoveProblem, tried: int, left: float) -> str:
    """Say that the reference model confirms no move, and how much the best one leaves."""
    unit = behind(problem.unit)
    return (
        f"tolerance {problem.tolerance:g}{unit}; by the reference model, the best of {tried} "
        f"moves leaves {left:.3g}{unit}; expected one within the tolerance: raise it"
    )
