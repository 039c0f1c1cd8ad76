"""A learning curve shows the validation error by the number of trajectories.

One network of moderate size is trained on twice the number of trajectories, point by point. It
starts each point with its weights so far. The validation error also falls with the iterations, so
its difference from the training error shows whether more data would pay.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import final

from slide_fmu.core.progress import Progress, ProgressListener, part_of, quiet_stages
from slide_fmu.fitting.preparation import FitPreparation, Work, prepare, scales_of
from slide_fmu.fitting.state_space.amounts import LINEAR_ITERATIONS
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.sizes import FIRST_UNITS
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

FIRST_ITERATIONS, ITERATIONS = 20, 10
"""Largest number of iterations for the first point of the curve, and for each further one."""


@final
class LearningCurve:
    """A LearningCurve belongs to a recipe with a state-space network.

    Points are requested with rising numbers of trajectories. The first one fixes scalings and
    features for all, since errors in scaled units are comparable only with the same scale. An
    interrupted curve resumes from its checkpoint in the folder ``checkpoints``.
    """

    def __init__(self, case: Case, trajectories: Path, checkpoints: Path) -> None:
        self._work = Work(case, trajectories, checkpoints, quiet_stages)
        self._prepared: FitPreparation | None = None
        self._candidate: Candidate | None = None

    def errors(self, train: int, validation: int, progress: Progress) -> tuple[float, float]:
        """Return validation and training error after training on the first ``train`` trajectories.

        Both are RMS in scaled units.

        Raises:
            TrajectoryError: trajectories are missing.
            TrainingError: the checkpoint cannot be read.
            ValueError: a signal never moves in the data.
        """
        training = self._work.recipe.training
        assert isinstance(training, LeastSquaresRecipe)
        read = self._work.trajectories.read
        splits = [read("train", train), read("validation", validation)]
        progress = ProgressListener(progress, with_error=not training.expert.even_out)
        if self._prepared is None:
            work = replace(self._work, progress=partial(part_of, progress))
            self._prepared = prepare(work, scales_of(work, splits), splits)
        prepared, network = self._prepared, self._prepared.table
        assert isinstance(network, StateSpaceRecipe)
        place = self._work.checkpoints / f"curve-{prepared.scales.training_key}.pt"
        problem = prepared.problem(splits, place)
        data = fit_data(problem, network, training)
        fit = MultiStart(data, progress)
        first = self._candidate is None
        iterations = FIRST_ITERATIONS if first else ITERATIONS
        starts = 2 * LINEAR_ITERATIONS + training.expert.start_iterations if first else 0
        fit.ledger.plan(starts + iterations)
        before = self._candidate or _first(fit)
        candidate = fit.refine(before, f"{train} trajectories", iterations)
        self._candidate = candidate
        fit.ledger.finish()
        squares = sum_of_squares(candidate.shape, candidate.state.best, data.whole)
        return candidate.error, math.sqrt(squares / data.whole.counted)


def _first(fit: MultiStart) -> Candidate:
    """Return the start of the curve: the given sizes, or moderate ones."""
    order, hidden = fit.network.order, fit.network.hidden
    order = fit.first_order() if order == "auto" else order
    hidden = fit.dense_units(order, FIRST_UNITS if hidden == "auto" else hidden)
    linear = fit.linear(order)
    return fit.start(linear, hidden, 0) if hidden else linear
