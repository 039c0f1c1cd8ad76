"""A motion is chosen with an FMU for a task, and may be compared with the reference model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.apps.motion.choice import MoveFamily, choose
from slide_fmu.apps.motion.coordinates import coordinates_of, inputs_of
from slide_fmu.apps.motion.costs import COSTS
from slide_fmu.apps.motion.earliest_move import Found, earliest
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import what_margins_are
from slide_fmu.apps.motion.move import Move, MoveFigures
from slide_fmu.apps.motion.problem import MoveProblem
from slide_fmu.apps.motion.quietest_move import quietest
from slide_fmu.apps.motion.task import MoveTask, at_parameters, limits_of
from slide_fmu.core.figures import optional
from slide_fmu.core.files import write_whole
from slide_fmu.core.progress import Stages, quiet_stages
from slide_fmu.core.search_path import make_models_importable
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
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
        reference: the same moves by the reference model, if requested.
    """

    fmu: str
    task: MoveTask
    margin_is: str
    slower: float
    reference: TrueMoves | None = optional()


@dataclass(frozen=True, eq=False)
class Solved:
    """Solved is a task with its answer.

    Attributes:
        surrogate, task, limits, found: the surrogate, the task, its limits, and the result.
        truths: outputs of the reference model relative to rest at the goal, (count, n_outputs),
            for the move and then the baselines; empty if not requested.
    """

    surrogate: Surrogate
    task: MoveTask
    limits: Limits
    found: Found
    truths: tuple[FloatArray, ...]

    @property
    def moves(self) -> tuple[Move, ...]:
        """The move, then the baselines."""
        return (self.found.move, *self.found.baselines)

    def true_moves(self) -> list[Move]:
        """The same moves with outputs of the reference model, which have no margin."""
        return [
            Move(m.name, m.motion, m.end, truth, np.zeros(len(truth)), m.known)
            for m, truth in zip(self.moves, self.truths, strict=bool(self.truths))
        ]

    def figures(self) -> SolvedFigures:
        """Return the figures."""
        terms = self.found.response, self.limits, self.task.tolerance
        true = [move.figures(*terms) for move in self.true_moves()]
        return SolvedFigures(
            fmu=self.surrogate.name,
            task=self.task,
            margin_is=what_margins_are(self.surrogate),
            slower=self.found.slower,
            move=self.found.move.figures(*terms),
            baselines=tuple(move.figures(*terms) for move in self.found.baselines),
            reference=TrueMoves(move=true[0], baselines=tuple(true[1:])) if true else None,
        )


def solve(
    fmu: Path, task: MoveTask, seed: int = 0, verify: bool = False, bar: Stages = quiet_stages
) -> Solved:
    """Choose the motion of a task with an FMU.

    Args:
        fmu: an FMU of slide-fmu.
        task: the task.
        seed: seed of the candidates, if some are drawn.
        verify: whether to simulate the reference model for the result and its baselines.
        bar: opens the progress of a stage.

    Raises:
        FmuError: the file is not an FMU of slide-fmu.
        MotionError: the task does not fit the FMU, or has no answer.
        LoadError: the reference model is not installed here.
        SimulationError: it could not be simulated.
    """
    released, provenance = read_fmu(fmu)
    surrogate = at_parameters(released, task.parameters)
    coordinates = coordinates_of(surrogate.inputs)
    (start, goal), limits = task.points(coordinates), limits_of(task.limits, coordinates)
    past = task.past(coordinates)
    problem = MoveProblem(surrogate, start, goal, limits, task.tolerance, past)
    progress = bar("motions")
    if task.kind == "earliest":
        found = earliest(problem, progress)
    elif task.kind == "quietest":
        assert task.duration is not None
        found = quietest(problem, task.duration, progress)
    else:
        family = MoveFamily(task.candidates, task.longest, seed)
        found = choose(problem, COSTS[task.minimise], family, progress)
    solved = Solved(surrogate, task, limits, found, ())
    if not verify:
        return solved
    make_models_importable(fmu)
    progress, truths = bar("reference model"), []
    system = reference_at(recipe_of_provenance(provenance, str(fmu)), released, task.parameters)
    resting = np.tile(inputs_of(coordinates, goal[None]), (found.response.lead, 1))
    rest = simulate(system, resting).outputs[-1]
    for done, move in enumerate(solved.moves):
        progress(done, len(solved.moves))
        outputs = simulate(system, found.response.inputs(move.motion)).outputs
        truths.append(outputs[found.response.lead + 1 :] - rest)
    progress(len(solved.moves), len(solved.moves))
    return Solved(surrogate, task, limits, found, tuple(truths))


def reference_at(recipe: Recipe, surrogate: Surrogate, values: Mapping[str, float]) -> System:
    """Return the reference system at the physical parameters of a surrogate.

    Args:
        recipe: the recipe of the surrogate.
        surrogate: the surrogate, with its parameters; missing values are their start values.
        values: values of parameters, by name.

    Raises:
        LoadError: the reference model is not installed here.
    """
    starts = {parameter.name: parameter.start_value for parameter in surrogate.parameters}
    return case_of(recipe.at({**starts, **values})).reference


def write_set_points(solved: Solved, path: Path) -> Path:
    """Write the inputs of the move as CSV, from the last sample of rest to the first one after."""
    response, move = solved.found.response, solved.found.move
    inputs = response.inputs(move.motion)[response.lead - 1 : response.lead + move.end + 1]
    return write_inputs(solved.surrogate, inputs, path)


def write_inputs(surrogate: Surrogate, inputs: FloatArray, path: Path) -> Path:
    """Write inputs (N, n_inputs) as CSV: times in s from 0 on, then one column for each input."""
    names = ",".join(["time", *(signal.name for signal in surrogate.inputs)])
    rows = [
        ",".join(f"{value:.12g}" for value in (surrogate.window.step * k, *row))
        for k, row in enumerate(inputs)
    ]
    write_whole(path, ("\n".join([names, *rows]) + "\n").encode())
    return path
