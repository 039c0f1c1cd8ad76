"""A factor makes margins cover the errors of optimised moves: a conformal step over moves.

An optimiser finds the errors of a surrogate, and a margin is none of the largest of many samples.
Random tasks are solved, and the reference model answers their moves. The factor is the conformal
quantile of the largest error after each move, relative to its largest margin there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.apps.motion.coordinates import Coordinate, coordinates_of
from slide_fmu.apps.motion.earliest_move import OptimisedMove
from slide_fmu.apps.motion.margin import margins_of, what_margins_are
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.recipe_table import MARGIN_FACTOR
from slide_fmu.apps.motion.response import Reference
from slide_fmu.apps.motion.solve import answer, problem_of, reference_of
from slide_fmu.apps.motion.task import MoveTask
from slide_fmu.core.progress import Stages, quiet, quiet_stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu

CONFIDENCE = 0.95
"""The share of moves whose error the factor covers."""

LEAST_TURN = 0.25
"""Angles turn at least this fraction of the turn of the task, and at most all of it."""

MOST_DRAWN = 4
"""Largest number of tasks that are drawn, relative to the moves that are needed."""


@dataclass(frozen=True, kw_only=True)
class CalibratedFactor:
    """A CalibratedFactor has the factor on margins for tasks like one, for JSON files.

    Attributes:
        drawn: number of random tasks; those without an optimised move do not count.
        moves: number of optimised moves.
        beyond_margin: number of moves whose error was larger than the margin.
        beyond_tolerance: number of moves that left more than the tolerance.
    """

    fmu: str
    task: MoveTask
    seed: int
    margin_is: str
    confidence: float
    drawn: int
    moves: int
    beyond_margin: int
    beyond_tolerance: int
    median_ratio: float
    margin_factor: float


def rank_of(moves: int) -> int:
    """Return which of the ratios is the quantile, from 1 on; above their number if too few."""
    return math.ceil((moves + 1) * CONFIDENCE - 1e-9)


def least_moves() -> int:
    """Return the number of moves that a calibration needs."""
    return next(moves for moves in range(1, 1000) if rank_of(moves) <= moves)


def random_task(
    task: MoveTask, coordinates: tuple[Coordinate, ...], rng: np.random.Generator
) -> MoveTask:
    """Draw start and goal of a task in the ranges; all else stays.

    Angles start anywhere, and turn in both directions, up to as far as in the task.
    """
    start, goal = [], []
    for coordinate, begin, end in zip(coordinates, task.start, task.goal, strict=True):
        if coordinate.radius is None:
            start.append(float(rng.uniform(coordinate.low, coordinate.high)))
            goal.append(float(rng.uniform(coordinate.low, coordinate.high)))
        else:
            start.append(float(rng.uniform(-math.pi, math.pi)))
            turn = rng.uniform(LEAST_TURN, 1) * rng.choice([-1, 1]) * abs(end - begin)
            goal.append(start[-1] + float(turn))
    return task.model_copy(update={"start": tuple(start), "goal": tuple(goal)})


def calibrate(
    fmu: Path, task: MoveTask, moves: int, seed: int = 0, bar: Stages = quiet_stages
) -> CalibratedFactor:
    """Calibrate the factor on margins for random tasks like one, which are solved without it.

    Args:
        fmu: an FMU of slide-fmu.
        task: gives limits, tolerance and all else but start and goal.
        moves: number of optimised moves.
        seed: seed of the tasks.
        bar: opens the progress of a stage.

    Raises:
        MotionError: there are too few moves, the task passes points, predictions have no margin,
            or too few tasks have an optimised move.
        Exception: as of ``slide_fmu.apps.motion.solve.solve``.
    """
    _require_calibration(task, moves)
    released, provenance = read_fmu(fmu)
    margins = margins_of(released, provenance)
    problem_of(released, task, margins)
    coordinates, rng = coordinates_of(released.inputs), np.random.default_rng(seed)
    reference = reference_of(fmu, released, task.parameters, quiet)
    progress, drawn = bar("moves"), 0
    ratios: list[float] = []
    left: list[float] = []
    while len(ratios) < moves:
        progress(len(ratios), moves)
        if drawn == MOST_DRAWN * moves:
            raise MotionError(
                f"{len(ratios)} of {drawn} random tasks have an optimised move; expected {moves}: "
                "raise the tolerance, or lower the limits"
            )
        drawn += 1
        try:
            drawn_task = random_task(task, coordinates, rng)
            optimised = answer(problem_of(released, drawn_task, margins), task)
        except MotionError:  # counted by ``drawn``
            continue
        if optimised.move.name not in {move.name for move in optimised.baselines}:
            error, margin, after = _after_arrival(optimised, reference)
            ratios.append(error / margin)
            left.append(after)
    progress(moves, moves)
    return CalibratedFactor(
        fmu=released.name,
        task=task,
        seed=seed,
        margin_is=what_margins_are(released, margins),
        confidence=CONFIDENCE,
        drawn=drawn,
        moves=moves,
        beyond_margin=sum(ratio > 1 for ratio in ratios),
        beyond_tolerance=sum(one > task.tolerance for one in left),
        median_ratio=float(np.median(ratios)),
        margin_factor=float(np.sort(ratios)[rank_of(moves) - 1]),
    )


def _require_calibration(task: MoveTask, moves: int) -> None:
    if moves < least_moves():
        raise MotionError(
            f"{moves} moves; expected at least {least_moves()}, which a factor for "
            f"{CONFIDENCE:.0%} of the moves needs: raise --calibrate"
        )
    if task.via:
        raise MotionError("a task with via; expected one without points to pass: remove them")


def _after_arrival(optimised: OptimisedMove, reference: Reference) -> tuple[float, float, float]:
    """Return largest error, margin and true distance from rest after a move has arrived."""
    move, end = optimised.move, optimised.move.end
    truth = optimised.response.verified_by(reference).truth(move.motion)
    margin = float(move.margin[end:].max())
    if margin == 0:
        raise MotionError(
            f"surrogate {optimised.response.surrogate.name!r} has no error bound, no "
            "error estimate and no measured error, so its margin is 0; expected one of them: make "
            "the FMU by slide-fmu run, which measures it"
        )
    return _largest(truth - move.outputs, end), margin, _largest(truth, end)


def _largest(outputs: FloatArray, end: int) -> float:
    return float(np.linalg.norm(outputs[end:], axis=1).max())


def advice(calibrated: CalibratedFactor) -> list[str]:
    """Say what the factor is, and what to do with it."""
    factor = math.ceil(1000 * calibrated.margin_factor) / 1000
    return [
        f"{MARGIN_FACTOR} = {factor:g}",
        f"In {calibrated.confidence:.0%} of optimised moves for such tasks, the largest error "
        f"after arrival stays below {factor:g} times the margin. The margin is "
        f"{calibrated.margin_is}.",
        f"Of {calibrated.moves} moves, {calibrated.beyond_margin} had a larger error than their "
        f"margin, and {calibrated.beyond_tolerance} left more than the tolerance.",
        f"Write it into the task as {MARGIN_FACTOR} = {factor:g}, or into the recipe below "
        f"[apps.motion]; then slide-fmu run puts it into the FMU without a new training.",
    ]
