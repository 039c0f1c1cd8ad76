"""The recipe's own network is trained again, where a budget is shorter than its training.

Its sizes and features are those that the recipe's training has found. The search has fewer
iterations, in proportion to the budget, and the refinement ends with the budget.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from slide_fmu.apps.compare.baselines.base import Budget, Course, FittedBaseline, NetworkBaseline
from slide_fmu.core.progress import Progress, quiet, quiet_stages
from slide_fmu.data.trajectories import Split
from slide_fmu.fitting.feature_choice import roles_of
from slide_fmu.fitting.network import FITS
from slide_fmu.fitting.preparation import FitPreparation, Work, scales_of
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import freeze
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.network.base import Network
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.learning import LeastSquaresRecipe, NetworkTable, StateSpaceRecipe
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = 10
"""Number of parts of the budget that the progress counts."""


@dataclass(frozen=True, eq=False)
class OwnNetwork:
    """An OwnNetwork is the recipe's network, with all that its training needs.

    Attributes:
        case: the recipe and its system.
        trajectories: folder of the trajectories.
        surrogate: the surrogate that the recipe's training gave.
        seconds: CPU time of that training.
    """

    case: Case
    trajectories: Path
    surrogate: Surrogate
    seconds: float

    @property
    def table(self) -> NetworkTable:
        """The recipe's table of the network, with the sizes that were found."""
        table, network = self.case.recipe.network, self.surrogate.network
        if not isinstance(table, StateSpaceRecipe) or not isinstance(network, StateSpace):
            return table
        n_states, n_units = len(network.cell.a), len(network.cell.w)
        order = n_states - (table.padding if n_units else 0)
        return table.model_copy(update={"order": order, "hidden": n_units})

    @property
    def can_be_fitted(self) -> bool:
        """Whether it can be trained for a given time, without a search for features or units."""
        table, network = self.table, self.surrogate.network
        training = self.case.recipe.training
        if not isinstance(table, StateSpaceRecipe) or not isinstance(network, StateSpace):
            return True
        assert isinstance(training, LeastSquaresRecipe)
        large = network.count_parameters() > training.expert.dense_limit
        if large or training.start is not None or table.units == "auto":
            return False
        try:
            return roles_of(table, network.features) == network.roles
        except (KeyError, ValueError):  # its features were searched for
            return False

    def fit(self, budget: Budget, progress: Progress) -> FittedBaseline:
        """Train it for the budget.

        Raises:
            TrainingError: the training diverged.
        """
        recipe, surrogate = self.case.recipe, self.surrogate
        share = min(1.0, budget.seconds / self.seconds)
        with TemporaryDirectory() as name:
            work = Work(self.case, self.trajectories, Path(name), quiet_stages)
            names = ("train", "validation", *(["beyond"] if recipe.data.beyond else []))
            splits: list[Split] = work.splits(*names)
            scales = scales_of(work, splits, surrogate.output_scaling)
            prepared = FitPreparation(work, scales, self.table, surrogate.network.features, {})
            problem = prepared.problem(splits, Path(name) / "own.pt")
            if isinstance(recipe.training, LeastSquaresRecipe):
                assert isinstance(self.table, StateSpaceRecipe)
                training = shortened(recipe.training, share)
                network, cut, course = _within(problem, self.table, training, budget, progress)
            else:
                steps = max(1, int(share * recipe.training.steps))
                shorter = recipe.training.model_copy(update={"steps": steps})
                network = FITS[type(self.table)](problem, self.table, shorter, progress).network
                cut, course = True, None
        baseline = NetworkBaseline(network, surrogate.window, len(surrogate.outputs))
        return FittedBaseline(baseline, "", cut, course)


def shortened(training: LeastSquaresRecipe, share: float) -> LeastSquaresRecipe:
    """Return a table with fewer iterations of the search, in proportion."""
    expert = training.expert
    counts = {name: max(1, int(share * getattr(expert, name)))
              for name in ("start_iterations", "kept_iterations")}  # fmt: skip
    return training.model_copy(update={"expert": expert.model_copy(update=counts)})


def _within(
    problem: Problem,
    table: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    budget: Budget,
    progress: Progress,
) -> tuple[Network, bool, Course | None]:
    """Fit a state-space network, whose refinement ends with the budget.

    Returns:
        The network, whether the budget ended its training, and the course of the training.
    """
    assert isinstance(table.order, int)
    assert isinstance(table.hidden, int)
    data = fit_data(problem, table, training)
    multi_start = MultiStart(data, quiet)
    progress(0, PARTS)
    best = multi_start.linear(table.order)
    if table.hidden:
        starts = [multi_start.start(best, table.hidden, 0)]
        for number in range(1, training.starts):
            if budget.left > 0:
                starts.append(multi_start.start(best, table.hidden, number))
        best = multi_start.best_of(starts)
    errors, number, longest = [(budget.spent, best.error)], 0, 0.0
    while number < 1 or (budget.left > longest and not best.state.finished):
        begin = budget.spent
        best = multi_start.refine(best, f"refined {number}", 1, afresh=number == 0)
        longest, number = max(longest, budget.spent - begin), number + 1
        errors.append((budget.spent, best.error))
        progress(min(PARTS, int(PARTS * budget.spent / budget.seconds)), PARTS, best.error)
    progress(PARTS, PARTS, best.error)
    cut = not best.state.finished
    half = min((error for time, error in errors if time <= 0.5 * budget.seconds), default=None)
    course = Course(number, best.error, half, cut)
    return freeze(best, data), cut, course
