"""The kind of hidden units is chosen by the errors of networks beyond their training range.

Plain validation cannot decide: within the range tanh units are as good as any. So the segments
with the largest amplitudes are held out. Small networks are fitted to the rest, and ranked by
their errors within and beyond together. The best kind is then fitted to all data.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import final

import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.history import UnitTrial
from slide_fmu.fitting.ladder import WORTHWHILE, Ladder, cheapest_as_good
from slide_fmu.fitting.state_space.amounts import LINEAR_ITERATIONS
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.cubes import with_room
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.sizes import orders_to_try
from slide_fmu.network.state_space.cell import MIXED_UNITS
from slide_fmu.recipe.learning import StateSpaceRecipe

HELD_OUT = 0.25
"""Fraction of the segments that is held out: those with the largest amplitudes."""
FEWEST_HELD_OUT = 2
"""With fewer of them no decision is possible, and tanh units are taken."""
TRIAL_UNITS = 8
"""Number of hidden units in trials, if a search will find their number."""
TRIAL_STARTS = 2
"""Number of random starts of a trial; the best one is run further."""
FEWER = (1, 2, 4)
"""Smaller numbers of cubes, tried if a search will find the number: every cube follows the noise
of measurements, and cubes amplify that far beyond the range."""
TURN, MOST_TIMES = 0.05, 8
"""The first is the largest turn or decay of a pole of the linear model in a sub-step, in rad;
sub-steps are made this short for a few cubes. The second is the largest number of sub-steps.
Sub-steps need no more weights. A discrete map that is not a motion has none, so one step is tried
too."""
AS_GOOD = 1.02
"""Fewer hidden units are as good if the product of both errors is at most this multiple of the
least."""
FAR_AMPLITUDE, FAR_GROWTH = 10.0, 10.0
"""At the first multiple of the held-out amplitudes, outputs may grow by at most the second factor
faster: as in the test of stability that decides on export."""


def choose_units(
    data: FitData, progress: Progress
) -> tuple[StateSpaceRecipe, tuple[UnitTrial, ...], str | None]:
    """Return the recipe with tanh, mixed or cubic units instead of ``auto``.

    The trials come next, and one sentence on why the kind was chosen; None without trials.

    Cubes have no padding: beyond the range, states that cubes add to each other diverge. A network
    that diverges, or grows too fast far beyond, has an infinite error there, and is not
    chosen.
    """
    kinds = (
        {"units": "tanh"},
        {"units": MIXED_UNITS, "padding": 0},
        {"units": "cubic", "padding": 0},
    )
    tanh, *cubes = (data.network.model_copy(update=kind) for kind in kinds)
    small, large = _divided(data)
    if large.count < FEWEST_HELD_OUT:
        return tanh, (), None
    trials = _Trials(small, large, progress)
    ladder = Ladder(
        error=trials.score,
        dearer=lambda recipe: cubes if recipe is tanh else [],
        worth=WORTHWHILE,
        named=lambda recipe: f"{recipe.units} units",
    )
    climb = ladder.climb(tanh)
    chosen = climb.chosen
    if chosen is not tanh and data.network.hidden == "auto":
        chosen = _with_fewest(trials, chosen)
    return chosen, tuple(trials.done), climb.explanation


def _with_fewest(trials: _Trials, recipe: StateSpaceRecipe) -> StateSpaceRecipe:
    """Return the recipe with the fewest cubes that are as good as many; unchanged if none are.

    Many cubes that act once in a sample can do what a few do that act several times in it.
    """
    several = sorted({substeps_for(trials.linear), 1}, reverse=True)
    fewer = (
        recipe.model_copy(
            # a single cube is the same in both kinds, except for its bound
            update={
                "hidden": number,
                "units": MIXED_UNITS if number == 1 else recipe.units,
                "substeps": substeps,
            }
        )
        for number, substeps in itertools.product(FEWER, several)
    )
    fewest = cheapest_as_good(fewer, trials.score, AS_GOOD * trials.score(recipe))
    return recipe if fewest is None else fewest


def substeps_for(linear: Candidate) -> int:
    """Return the number of sub-steps that are short for the fastest pole of a linear model.

    It is 1 if a pole has no positive real part: such a model cannot be divided.
    """
    poles = torch.linalg.eigvals(linear.shape.cells(linear.state.best)[0].a.double())
    if float(poles.real.min()) <= 0:
        return 1
    return max(1, min(MOST_TIMES, math.ceil(float(poles.log().abs().max()) / TURN)))


@final
class _Trials:
    """_Trials fit small networks to the smaller amplitudes, and keep the results."""

    def __init__(self, small: FitData, large: Segments, progress: Progress) -> None:
        self.done: list[UnitTrial] = []
        self._scores: dict[tuple[str, int | str, int], float] = {}
        self._linear: Candidate | None = None  # the same for all kinds
        self._small, self._large, self._progress = small, large, progress

    @property
    def linear(self) -> Candidate:
        """The linear model that all trials start from; it exists after the first trial."""
        assert self._linear is not None
        return self._linear

    def score(self, recipe: StateSpaceRecipe) -> float:
        """Return the product of the errors within and beyond the trained amplitudes."""
        kind = recipe.units, recipe.hidden, recipe.substeps
        if kind not in self._scores:
            tried = self._try(recipe)
            self.done.append(tried)
            self._scores[kind] = tried.validation_error * tried.error_beyond
        return self._scores[kind]

    def _try(self, recipe: StateSpaceRecipe) -> UnitTrial:
        """Fit a network of a recipe's kind and number of hidden units, and test it beyond.

        Every trial has its own checkpoint.
        """
        number = TRIAL_UNITS if recipe.hidden == "auto" else int(recipe.hidden)
        problem, training = self._small.problem, self._small.training
        name = f"units-{recipe.units}-{number}-{recipe.substeps}-{problem.checkpoint.name}"
        problem = replace(problem, checkpoint=problem.checkpoint.with_name(name))
        data = replace(self._small, problem=problem, network=recipe)
        multi_start = MultiStart(data, self._progress)
        orders = orders_to_try(multi_start) if self._linear is None else []
        iterations = training.search_iterations(TRIAL_STARTS, 1)
        first = 2 * LINEAR_ITERATIONS if orders else 0
        multi_start.ledger.plan(first + iterations, f"trial of {number} {recipe.units} units")
        if orders:
            self._linear = multi_start.linear(orders[0])
        linear = self.linear
        dense = multi_start.dense_units(linear.shape.n_states, number)
        starts = [multi_start.start(linear, dense, start) for start in range(TRIAL_STARTS)]
        judged = multi_start.judged(min(starts, key=lambda start: start.error))
        multi_start.ledger.finish()
        theta = with_room(judged.shape, judged.state.best, self._small.whole)
        beyond = _error(judged.shape, theta, self._large)
        return UnitTrial(recipe.units, number, recipe.substeps, judged.error, beyond)


def _divided(data: FitData) -> tuple[FitData, Segments]:
    """Return the data of smaller amplitudes, also in validation, and the segments held out."""
    whole, peaks = data.whole, _peaks(data.whole, data.whole)
    limit = torch.quantile(peaks, 1 - HELD_OUT)
    small, large = (_some(whole, chosen) for chosen in (peaks <= limit, peaks > limit))
    validation = _some(data.validation, _peaks(data.validation, whole) <= limit)
    validation = validation if validation.count else data.validation
    stride = max(1, round(whole.count / data.part.count))
    return replace(data, whole=small, part=small.every(stride), validation=validation), large


def _peaks(segments: Segments, reference: Segments) -> torch.Tensor:
    """Return the largest distance of each segment's outputs from the reference's mean, (B,)."""
    peaks: torch.Tensor = (segments.targets - reference.targets.mean((0, 1))).abs().amax((0, 2))
    return peaks


def _some(segments: Segments, chosen: torch.Tensor) -> Segments:
    return segments.chosen(torch.nonzero(chosen)[:, 0])


def _error(shape: CellShape, theta: torch.Tensor, segments: Segments) -> float:
    """Return the RMS error on segments in scaled units; infinite if the network is unbounded."""
    squares = sum_of_squares(shape, theta, segments)
    bounded = math.isfinite(squares) and _is_bounded(shape, theta, segments)
    return math.sqrt(squares / segments.counted) if bounded else math.inf


def _is_bounded(shape: CellShape, theta: torch.Tensor, segments: Segments) -> bool:
    """Return whether outputs stay bounded far beyond the amplitudes of segments."""
    near, far = (
        simulate(shape, theta, factor * segments.features, segments.phi)[0]
        for factor in (1.0, FAR_AMPLITUDE)
    )
    limit = FAR_GROWTH * FAR_AMPLITUDE * float((near - near.mean((0, 1))).abs().max())
    return float((far - near.mean((0, 1))).abs().max()) <= limit  # false for NaN
