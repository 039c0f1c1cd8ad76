"""The best of many moves of a family is chosen by a cost that the user selects.

A family has the moves that a controller can send: an S-curve with two impulses. Trapezoids, smooth
curves and shapers of two impulses are members. All members keep the limits.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from slide_fmu.apps.motion.costs import Cost, MoveResponses
from slide_fmu.apps.motion.earliest_move import OptimisedMove, baselines
from slide_fmu.apps.motion.move import Move, described
from slide_fmu.apps.motion.moves import arrivals, shares
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.problem import MoveProblem
from slide_fmu.apps.motion.response import Response
from slide_fmu.apps.motion.route import LEAST_ROUNDED
from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.speed_profile import SpeedProfiles
from slide_fmu.network.base import batches

AT_ONCE = 500
"""Number of candidates predicted together: their sequences fit into memory."""

LOOKED_AT = 20
"""Number of the best candidates that are evaluated with their margins."""

MOST_LOOKED_AT = 200
"""Largest number of these, if none of the first ones stays in the domain."""

NEAR = 0.06
"""Half of all candidates lie this near to one of the best of the other half, in each direction of
a cube of the side 1."""

DIMENSIONS = 6
"""A candidate has two phases, a rounding, a time, and the delay and size of a second impulse."""


@dataclass(frozen=True)
class MoveFamily:
    """A MoveFamily has candidates: half of them are evenly spread over it (Sobol's sequence).

    The others lie near the best of these.

    Attributes:
        candidates: number of candidates.
        longest: time of the slowest profile, as a multiple of the time that its limits need.
        seed: seed of the sequence.
    """

    candidates: int
    longest: float
    seed: int


def choose(
    problem: MoveProblem, cost: Cost, family: MoveFamily, progress: Progress = quiet
) -> OptimisedMove:
    """Choose the candidate of the least cost, or a baseline that costs less.

    All are compared as predicted; the best ones again with their margins, which decide.

    Args:
        problem: the move.
        cost: the cost to minimise.
        family: the candidates.
        progress: called with the number of candidates tried.

    Raises:
        MotionError: no candidate has a finite cost, the best ones leave the surrogate's domain,
            there are points to pass, or as for ``baselines``.
    """
    if problem.via is not None:
        raise MotionError(
            "candidates go straight from the start to the goal; expected no points to pass: "
            "remove via, or ask for kind = 'earliest' or 'quietest'"
        )
    plain, profile, known = baselines(problem)
    latest = plain.step * max(move.end - known[0].end for move in known)
    space = _Space(problem, profile, latest, family.longest)
    half = family.candidates - family.candidates // 2
    places = qmc.Sobol(DIMENSIONS, seed=family.seed).random(1 << (half - 1).bit_length())[:half]
    costs = space.costs(places, cost, progress, (0, family.candidates))
    best = places[np.argsort(costs, kind="stable")[:LOOKED_AT]]
    if others := family.candidates - half:
        rng = np.random.default_rng(family.seed)
        near = rng.uniform(-NEAR, NEAR, (others, DIMENSIONS)) + np.resize(
            best, (others, DIMENSIONS)
        )
        near = np.clip(near, 0.0, 1.0)
        more = space.costs(near, cost, progress, (half, family.candidates))
        places, costs = np.concatenate([places, near]), np.concatenate([costs, more])
    order = np.argsort(costs, kind="stable")
    known = [space.again(move) for move in known]
    for some in batches(min(len(places), MOST_LOOKED_AT), LOOKED_AT):
        best = space.moves(places[order[some]], f"best of {family.candidates}")
        finalists = [*best, *known]
        values = [move.trusted(cost, space.response, problem.tolerance) for move in finalists]
        if np.isfinite(values).any():
            return OptimisedMove(space.response, finalists[int(np.argmin(values))], tuple(known))
    raise MotionError(_nothing(problem, family, finalists))


def _nothing(problem: MoveProblem, family: MoveFamily, finalists: list[Move]) -> str:
    """Return a message on what no candidate does: settle, or stay in the domain."""
    if min(move.known for move in finalists) < 1:
        return (
            f"the best of {family.candidates} candidates leave the domain of the surrogate; "
            "outside its error bound says nothing: lower the limits, raise longest, or move start "
            "or goal"
        )
    return (
        f"none of {family.candidates} candidates stays within {problem.tolerance:g} "
        f"{problem.unit}; expected some that settle: raise the tolerance, candidates, or longest"
    )


@dataclass(frozen=True, eq=False)
class _Space:
    """A _Space has candidates by their place in a cube, whose origin is near the fastest profile.

    Attributes:
        problem: the move.
        fastest: profile about which all others lie.
        latest: largest delay in s of a second impulse, like a shaper's.
        longest: as for ``MoveFamily``.
    """

    problem: MoveProblem
    fastest: SpeedProfiles
    latest: float
    longest: float

    @cached_property
    def response(self) -> Response:
        """The response to all candidates."""
        corners = np.array(list(itertools.product((0.0, 1.0), repeat=DIMENSIONS)))
        _, times, delays, _ = self._drawn(corners)
        return self.problem.response(float((times + delays[:, 1]).max()))

    def costs(
        self, places: FloatArray, cost: Cost, progress: Progress, counted: tuple[int, int]
    ) -> FloatArray:
        """Return the costs of candidates as predicted, (B,), at places (B, DIMENSIONS).

        ``counted`` has the count of the progress so far, and its total.
        """
        before, total = counted
        costs = np.empty(len(places))
        for some in batches(len(places), AT_ONCE):
            motions, ends = self._sampled(places[some])
            outputs = self.response.outputs(motions)
            none = np.zeros(outputs.shape[:2])
            tolerance = self.problem.tolerance
            responses = MoveResponses(outputs, none, ends, self.response.output_time, tolerance)
            costs[some] = cost(responses)
            progress(before + min(some.stop, len(places)), total)
        return costs

    def moves(self, places: FloatArray, name: str) -> list[Move]:
        """Describe candidates at places, (B, DIMENSIONS)."""
        motions, ends = self._sampled(places)
        return [
            described(self.response, name, motion, int(end))
            for motion, end in zip(motions, ends, strict=True)
        ]

    def again(self, move: Move) -> Move:
        """Describe a move of another response, so that its sequence is as long as the others'."""
        motion = np.tile(self.problem.goal, (self.response.count, 1))
        motion[: move.end] = move.motion[: move.end]
        return described(self.response, move.name, motion, move.end)

    def _sampled(self, places: FloatArray) -> tuple[FloatArray, NDArray[np.intp]]:
        profiles, times, delays, parts = self._drawn(places)
        route = shares(self.response, profiles, times, delays, parts)
        return self.problem.route.at(route), arrivals(self.response, times, delays)

    def _drawn(
        self, places: FloatArray
    ) -> tuple[SpeedProfiles, FloatArray, FloatArray, FloatArray]:
        """Return profiles, times in s (B,), and delays and parts of two impulses, (B, 2) each.

        Most of them lie near the fastest profile.
        """
        drawn, problem = places.T, self.problem
        phases = np.minimum(self.fastest.speeding * 4 ** (drawn[:2] - 0.5), 0.5)
        rounded = LEAST_ROUNDED + (1 - LEAST_ROUNDED) * drawn[2] ** 2
        profiles = SpeedProfiles(phases[0], phases[1], rounded)
        limits = [limit for _, _, limit in problem.limits.derivatives()]
        shortest = profiles.least_times(problem.goal - problem.start, limits)
        least = np.maximum(shortest, problem.surrogate.window.step)
        delays = np.stack([np.zeros(len(places)), drawn[4] * self.latest], axis=1)
        first = 0.5 + 0.5 * drawn[5]
        parts = np.stack([first, 1 - first], axis=1)
        return profiles, least * self.longest ** drawn[3] ** 2, delays, parts
