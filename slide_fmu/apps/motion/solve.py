"""A motion is chosen with an FMU for a task, and may be compared with the reference model."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slide_fmu.apps.motion.choice import MoveFamily, choose
from slide_fmu.apps.motion.coordinates import coordinates_of
from slide_fmu.apps.motion.costs import COSTS
from slide_fmu.apps.motion.earliest_move import OptimisedMove, earliest
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import Margins, margins_of, what_margins_are
from slide_fmu.apps.motion.move import Move, MoveFigures, described_all
from slide_fmu.apps.motion.problem import MoveProblem
from slide_fmu.apps.motion.quietest_move import quietest
from slide_fmu.apps.motion.recipe_table import MARGIN_FACTOR, check_table
from slide_fmu.apps.motion.response import Reference
from slide_fmu.apps.motion.set_points import MotionCurve, write_curve, write_inputs
from slide_fmu.apps.motion.task import MoveTask, at_parameters, limits_of
from slide_fmu.core.figures import optional
from slide_fmu.core.progress import Progress, Stages, quiet, quiet_stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import Provenance, read_fmu
from slide_fmu.pipeline.measurement import released_case
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate


@dataclass(frozen=True, kw_only=True)
class TrueMoves:
    """TrueMoves are the moves by the reference model, which have no margin."""

    move: MoveFigures
    baselines: tuple[MoveFigures, ...]


@dataclass(frozen=True, kw_only=True)
class SolvedFigures(TrueMoves):
    """SolvedFigures are the figures of a solved task, for JSON files.

    Attributes:
        task: the task as in its file.
        margin_is: description of the margins.
        slower: factor on the shortest time of the fastest profile.
        rounds: number of plans that the reference model has answered, if it verifies the move.
        reference: the same moves by the reference model, if requested.
    """

    fmu: str
    task: MoveTask
    margin_is: str
    slower: float
    rounds: int
    reference: TrueMoves | None = optional()


@dataclass(frozen=True, eq=False)
class MoveSolution:
    """A MoveSolution is a task with its answer.

    Attributes:
        task, problem, optimised: the task, its problem, and the move as the surrogate predicts it.
        truths: outputs of the reference model relative to rest at the goal, (count, n_outputs),
            for the move and then the baselines; empty if not requested.
    """

    task: MoveTask
    problem: MoveProblem
    optimised: OptimisedMove
    truths: tuple[FloatArray, ...]

    @property
    def surrogate(self) -> Surrogate:
        """The surrogate, at the parameters of the task."""
        return self.problem.surrogate

    @property
    def limits(self) -> Limits:
        """The limits of the task."""
        return self.problem.limits

    @property
    def moves(self) -> tuple[Move, ...]:
        """The move, then the baselines."""
        return (self.optimised.move, *self.optimised.baselines)

    def true_moves(self) -> list[Move]:
        """Return the same moves with outputs of the reference model, which have no margin."""
        return [
            replace(move, outputs=truth, margin=np.zeros(len(truth)))
            for move, truth in zip(self.moves, self.truths, strict=bool(self.truths))
        ]

    def figures(self) -> SolvedFigures:
        """Return the figures."""
        terms = self.optimised.response, self.limits, self.task.tolerance
        true = [move.figures(*terms) for move in self.true_moves()]
        return SolvedFigures(
            fmu=self.surrogate.name,
            task=self.task,
            margin_is=what_margins_are(self.surrogate, self.problem.margins),
            slower=self.optimised.slower,
            rounds=self.optimised.rounds,
            move=self.optimised.move.figures(*terms),
            baselines=tuple(move.figures(*terms) for move in self.optimised.baselines),
            reference=TrueMoves(move=true[0], baselines=tuple(true[1:])) if true else None,
        )


def solve(
    fmu: Path, task: MoveTask, seed: int = 0, verify: bool = False, bar: Stages = quiet_stages
) -> MoveSolution:
    """Choose the motion of a task with an FMU.

    Args:
        fmu: an FMU of slide-fmu.
        task: the task.
        seed: seed of the candidates, if some are drawn.
        verify: whether to simulate the reference model for the result and its baselines. The
            earliest and the quietest move are then the best by the reference model.
        bar: opens the progress of a stage.

    Raises:
        FmuError: the file is not an FMU of slide-fmu.
        MotionError: the task does not fit the FMU, or has no answer.
        RecipeError: the FMU carries a margin factor that is not a number above 0.
        LoadError: the reference model is not installed here.
        SimulationError: it could not be simulated.
    """
    released, provenance = read_fmu(fmu)
    margins = margins_of(released, provenance, factor_of(task, provenance))
    problem = problem_of(released, task, margins)
    if not verify:
        return MoveSolution(task, problem, answer(problem, task, seed, bar("motions")), ())
    simulated = reference_of(fmu, released, task.parameters, bar("reference model"))
    if task.kind != "choose":
        optimised = answer(replace(problem, reference=simulated), task, seed, bar("motions"))
    else:
        optimised = answer(problem, task, seed, bar("motions"))
    moves, response = (optimised.move, *optimised.baselines), optimised.response.verified_by(None)
    if task.kind == "choose":
        true = optimised.response.verified_by(simulated)
        return MoveSolution(
            task, problem, optimised, tuple(true.truth(move.motion) for move in moves)
        )
    named = [(move.name, move.motion, move.end) for move in moves]
    move, *others = described_all(response, named)
    optimised = replace(optimised, response=response, move=move, baselines=tuple(others))
    return MoveSolution(task, problem, optimised, tuple(move.outputs for move in moves))


def problem_of(released: Surrogate, task: MoveTask, margins: Margins) -> MoveProblem:
    """Return the problem of a task, with margins of predictions."""
    surrogate = at_parameters(released, task.parameters)
    coordinates = coordinates_of(surrogate.inputs)
    points, limits = task.points(coordinates), limits_of(task.limits, coordinates)
    via = task.via_points(coordinates)
    return MoveProblem(
        surrogate,
        *points,
        limits,
        task.tolerance,
        via,
        margins=margins,
        straight=task.straight,
    )


def answer(
    problem: MoveProblem, task: MoveTask, seed: int = 0, progress: Progress = quiet
) -> OptimisedMove:
    """Choose the motion of a problem as its task asks; candidates are drawn with a seed."""
    if task.kind == "earliest":
        return earliest(problem, progress)
    if task.kind == "quietest":
        assert task.duration is not None
        return quietest(problem, task.duration, progress)
    family = MoveFamily(task.candidates, task.longest, seed)
    return choose(problem, COSTS[task.minimise], family, progress)


def factor_of(task: MoveTask, provenance: Provenance | None) -> float:
    """Return the factor on margins: of the task, or else of the recipe that an FMU carries."""
    if task.margin_factor is not None:
        return task.margin_factor
    recipe = tomllib.loads(str((provenance or {}).get("recipe", "")))
    table = recipe.get("apps", {}).get("motion", {})
    check_table(table)
    return float(table.get(MARGIN_FACTOR, 1.0))


def reference_of(
    fmu: Path, released: Surrogate, parameters: Mapping[str, float], progress: Progress
) -> Reference:
    """Return a function that simulates the reference model of an FMU, and counts simulations."""
    system = reference_at(released_case(fmu).recipe, released, parameters)
    done = 0

    def simulated(inputs: FloatArray) -> FloatArray:
        nonlocal done
        progress(done, done + 1)
        outputs = simulate(system, inputs).outputs
        done += 1
        progress(done, done)
        return outputs

    return simulated


def reference_at(recipe: Recipe, surrogate: Surrogate, values: Mapping[str, float]) -> System:
    """Return the reference system at the physical parameters of a surrogate.

    Args:
        recipe: the recipe of the surrogate.
        surrogate: the surrogate, with its parameters; missing values are their start values.
        values: values of parameters, by name.
    """
    starts = {parameter.name: parameter.start_value for parameter in surrogate.parameters}
    return case_of(recipe.at({**starts, **values})).reference


def write_set_points(solved: MoveSolution, path: Path, rate: float | None = None) -> str | None:
    """Write the move as CSV, from the last sample of rest to the first one after; return a remark.

    Without a rate, rows are the inputs at the surrogate's step; else see ``write_curve``.
    """
    surrogate, response, move = solved.surrogate, solved.optimised.response, solved.optimised.move
    samples = np.concatenate([response.start[None], move.motion[: move.end + 1]])
    if rate is None:
        write_inputs(surrogate, response.coordinates, samples, path)
        return None
    curve = MotionCurve(response.coordinates, samples, response.step, solved.limits)
    return write_curve(surrogate, curve, rate, path)
