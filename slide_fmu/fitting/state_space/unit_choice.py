"""The kind of units is chosen by what networks do beyond what they have learnt.

Plain validation cannot tell: within the range tanh units are as good as any. So the stretches with
the largest amplitudes are held out, small networks are learnt from the rest, and ranked by their
errors within and beyond together. The kind that wins is then learnt from all data.
"""

from __future__ import annotations

import math
from dataclasses import replace

import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.history import TriedUnits
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.cubes import with_room
from slide_fmu.fitting.state_space.multi_start import Candidate, FitData, MultiStart
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.sizes import orders_to_try
from slide_fmu.network.state_space.cell import MIXED_UNITS
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

HELD_OUT = 0.25
"""This part of the segments, those with the largest amplitudes, are held out."""
FEWEST_HELD_OUT = 2
"""With fewer of them nothing can be told, and tanh units are taken."""
TRIAL_UNITS = 8
"""Trials have so many units where a search is to find their number."""
TRIAL_STARTS = 2
"""A trial has so many random starts, the best of which goes on."""
CLEARLY = 0.8
"""Other units are taken where the product of both errors is below this part of that of tanh."""
FAR, GROWTH = 10.0, 10.0
"""At so many times the amplitudes held out, outputs grow at most so many times as fast: as in the
test of stability that decides on export."""


def choose_units(
    problem: Problem,
    network: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    data: FitData,
    progress: Progress,
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
    tanh, *others = (network.model_copy(update=kind) for kind in kinds)
    small, large = _divided(data)
    if large.count < FEWEST_HELD_OUT:
        return tanh, ()
    tried = []
    for recipe in (tanh, *others):
        name = f"units-{recipe.units}-{problem.checkpoint.name}"
        trial = replace(problem, checkpoint=problem.checkpoint.with_name(name))
        multi_start = MultiStart(trial, recipe, training, small, progress)
        found = _try(multi_start)
        theta = with_room(found.shape, found.state.best, small.whole)
        beyond = _error(found.shape, theta, large)
        tried.append(TriedUnits(recipe.units, found.error, beyond))
    best = min(range(1, len(tried)), key=lambda place: _score(tried[place]))
    chosen = others[best - 1] if _score(tried[best]) < CLEARLY * _score(tried[0]) else tanh
    return chosen, tuple(tried)


def _score(tried: TriedUnits) -> float:
    return tried.validation_error * tried.error_beyond


def _try(multi_start: MultiStart) -> Candidate:
    """Learn a small network of the recipe's units from the smaller amplitudes."""
    network, training = multi_start.network, multi_start.training
    units = TRIAL_UNITS if network.hidden == "auto" else int(network.hidden)
    linear = multi_start.linear(orders_to_try(multi_start)[0])
    multi_start.plan(TRIAL_STARTS * training.start_iterations + training.kept_iterations)
    units = multi_start.dense_units(linear.shape.n_states, units)
    starts = [multi_start.start(linear, units, number) for number in range(TRIAL_STARTS)]
    return multi_start.judged(min(starts, key=lambda start: start.error))


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
    """Whether outputs stay within bounds far beyond the amplitudes of segments."""
    near, far = (
        simulate(shape, theta, factor * segments.features, segments.phi)[0]
        for factor in (1.0, FAR)
    )
    limit = GROWTH * FAR * float((near - near.mean((0, 1))).abs().max())
    return float((far - near.mean((0, 1))).abs().max()) <= limit  # false for what is no number
