"""The kind of hidden units is chosen by what networks do beyond what they have learnt.

Plain validation cannot tell: within the range tanh units are as good as any. So the stretches with
the largest amplitudes are held out, small networks are learnt from the rest, and ranked by their
errors within and beyond together. The kind that wins is then learnt from all data.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.history import TriedUnits
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.cubes import with_room
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.multi_start import LINEAR_ITERATIONS, Candidate, MultiStart
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.sizes import orders_to_try
from slide_fmu.network.state_space.cell import MIXED_UNITS
from slide_fmu.recipe.learning import StateSpaceRecipe

HELD_OUT = 0.25
"""This part of the segments, those with the largest amplitudes, are held out."""
FEWEST_HELD_OUT = 2
"""With fewer of them nothing can be told, and tanh units are taken."""
TRIAL_UNITS = 8
"""Trials have so many hidden units where a search is to find their number."""
TRIAL_STARTS = 2
"""A trial has so many random starts, the best of which goes on."""
FEWER = (1, 2, 4)
"""Where a search is to find their number, fewer cubes are tried too: each more follows the noise
of what was measured, and cubes carry that far beyond the range."""
TURN, MOST_TIMES = 0.05, 8
"""A few cubes act so often in a sample that no pole of the linear model turns or decays by more
than the first, in rad, in a sub-step; up to so many times. Sub-steps need no more weights. A map
that is no motion has none, so that one step is tried too."""
AS_GOOD = 1.02
"""Fewer hidden units do as well if the product of both errors is at most this factor on the least.
"""
CLEARLY = 0.8
"""Other units are taken where the product of both errors is below this part of that of tanh."""
FAR, GROWTH = 10.0, 10.0
"""At so many times the amplitudes held out, outputs grow at most so many times as fast: as in the
test of stability that decides on export."""


def choose_units(
    data: FitData, progress: Progress
) -> tuple[StateSpaceRecipe, tuple[TriedUnits, ...]]:
    """Return the recipe with tanh, mixed or cubic units instead of ``auto``, and what was tried.

    Cubes come without padding: beyond the range, states that cubes add to each other go astray. A
    network that diverges, or grows too fast far beyond, has an infinite error there, and is not
    chosen.
    """
    kinds = (
        {"units": "tanh"},
        {"units": MIXED_UNITS, "padding": 0},
        {"units": "cubic", "padding": 0},
    )
    recipes = [data.network.model_copy(update=kind) for kind in kinds]
    small, large = _divided(data)
    if large.count < FEWEST_HELD_OUT:
        return recipes[0], ()
    trials = _Trials(small, large, progress)
    tanh, *others = (trials.of(recipe) for recipe in recipes)
    best = min(others, key=_score)
    if not _score(best) < CLEARLY * _score(tanh):
        return recipes[0], tuple(trials.done)
    chosen = recipes[1 + others.index(best)]
    if data.network.hidden == "auto":
        chosen = _with_fewest(trials, chosen, best)
    return chosen, tuple(trials.done)


def _with_fewest(trials: _Trials, recipe: StateSpaceRecipe, many: TriedUnits) -> StateSpaceRecipe:
    """Return the recipe with the fewest cubes that do as well as many; as it is if none do.

    Many cubes that act once in a sample can do what a few do that act several times in it.
    """
    several = sorted({substeps_for(trials.linear), 1}, reverse=True)
    for number, substeps in itertools.product(FEWER, several):
        # a single cube is the same of both kinds, but for its bound
        kind = MIXED_UNITS if number == 1 else recipe.units
        few = {"hidden": number, "units": kind, "substeps": substeps}
        fewer = recipe.model_copy(update=few)
        if _score(trials.of(fewer)) <= AS_GOOD * _score(many):
            return fewer
    return recipe


def substeps_for(linear: Candidate) -> int:
    """Return the number of sub-steps that are short beside the fastest pole of a linear model.

    It is 1 where a pole has no real part above 0: such a model cannot be divided.
    """
    poles = torch.linalg.eigvals(linear.shape.cells(linear.state.best)[0].a.double())
    if float(poles.real.min()) <= 0:
        return 1
    return max(1, min(MOST_TIMES, math.ceil(float(poles.log().abs().max()) / TURN)))


class _Trials:
    """Trials learn small networks from the smaller amplitudes, and keep what they found. Final."""

    def __init__(self, small: FitData, large: Segments, progress: Progress) -> None:
        self.done: list[TriedUnits] = []
        self._linear: Candidate | None = None  # the same of all kinds
        self._small, self._large, self._progress = small, large, progress

    @property
    def linear(self) -> Candidate:
        """The linear model that all trials start from; there is one after the first trial."""
        assert self._linear is not None
        return self._linear

    def of(self, recipe: StateSpaceRecipe) -> TriedUnits:
        """Learn a network of a recipe's kind and number of hidden units, and test it beyond.

        Every trial has a checkpoint of its own.
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
        found = multi_start.judged(min(starts, key=lambda start: start.error))
        multi_start.ledger.finish()
        theta = with_room(found.shape, found.state.best, self._small.whole)
        beyond = _error(found.shape, theta, self._large)
        self.done.append(TriedUnits(recipe.units, number, recipe.substeps, found.error, beyond))
        return self.done[-1]


def _score(tried: TriedUnits) -> float:
    return tried.validation_error * tried.error_beyond


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
    """Return how far the outputs of each segment go from the reference's mean, shape (B,)."""
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
    """Tell whether outputs stay within bounds far beyond the amplitudes of segments."""
    near, far = (
        simulate(shape, theta, factor * segments.features, segments.phi)[0]
        for factor in (1.0, FAR)
    )
    limit = GROWTH * FAR * float((near - near.mean((0, 1))).abs().max())
    return float((far - near.mean((0, 1))).abs().max()) <= limit  # false for what is no number
