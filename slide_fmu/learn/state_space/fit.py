"""The state-space family: choose sizes, hold the tournament, freeze the winner."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.learn.feature_choice import roles_of
from slide_fmu.learn.problem import Problem
from slide_fmu.learn.state_space.normal_equations import sum_of_squares
from slide_fmu.learn.state_space.segments import Segments, cut_segments
from slide_fmu.learn.state_space.tournament import LINEAR_ITERATIONS, Entrant, FitData, Tournament
from slide_fmu.learn.training import History, TrainingError
from slide_fmu.network.cell import Cell
from slide_fmu.network.state_space import StateSpace
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

SEARCH_STARTS = 3
"""Random starts by which a size is judged when it is chosen automatically."""
WORTHWHILE = 0.8
"""A larger network is chosen when it has at most this part of the smaller one's error."""
FIRST_UNITS, MOST_UNITS = 16, 64
"""Numbers of units that are tried."""
FEWEST = 8
"""Segments that the starts have, at least, where there are as many."""
MORE_STATES = 8
"""States tried beyond the first guess, at most."""


def fit_state_space(
    problem: Problem,
    network: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    progress: Progress,
) -> tuple[StateSpace, History]:
    """Fit a state-space network.

    Raises:
        TrainingError: no start gives a finite error.
        ValueError: trajectories are too short for the window, or the order is too high for it.
    """
    data = prepare(problem, network, training)
    tournament = Tournament(problem, network, training, data, progress)
    tournament.plan(2 * LINEAR_ITERATIONS + _iterations(training, training.iterations))
    order, units = choose_sizes(tournament)
    winner = compete(tournament, order, units)
    if not math.isfinite(winner.error):
        raise TrainingError(
            "training diverged: no start of the state-space network has a finite validation "
            "error; give more starts (training.starts) or a lower network.order"
        )
    return freeze(winner, problem), _history(winner, data)


def _history(winner: Entrant, data: FitData) -> History:
    """The winner's last run; with its start as step 0 where no step was better."""
    rows = winner.state.history
    if not rows or min(row[2] for row in rows) > winner.error:
        cost = sum_of_squares(winner.shape, winner.state.best, data.whole)
        error = math.sqrt(cost / data.whole.counted)
        rows = ((0, error, winner.error), *rows)
    return History(*zip(*rows, strict=True))


def prepare(problem: Problem, network: StateSpaceRecipe, training: LeastSquaresRecipe) -> FitData:
    """Features, and trajectories cut into segments."""
    dtype = getattr(torch, training.precision)

    def segments(record: tuple[torch.Tensor, torch.Tensor]) -> Segments:
        burn_in, length = problem.window.n_truncated, training.segment
        cut = cut_segments(record[0].to(dtype), record[1].to(dtype), burn_in, length)
        return cut.evened_out() if training.even_out else cut

    features = problem.training[0].to(dtype)

    whole = segments(problem.training)
    pieces = whole.count // len(features)
    if problem.beyond is not None:
        whole = whole.and_others(segments(problem.beyond), training.beyond_weight)
    if training.flip_signs:
        whole = whole.and_others(whole.mirrored(), 1.0)
    part = whole.every(_stride(training.part, pieces, whole.count))
    roles = roles_of(network, problem.features)
    return FitData(whole, part, segments(problem.validation), features, roles)


def _stride(part: int, pieces: int, count: int) -> int:
    """Stride by which the starts' segments are taken: early and late pieces of trajectories."""
    most = max(1, count // FEWEST)
    wished = [*range(part, most + 1), *range(min(part, most), 0, -1)]
    fitting: list[int] = [stride for stride in wished if math.gcd(stride, pieces) == 1]
    return fitting[0]


def choose_sizes(tournament: Tournament) -> tuple[int, int]:
    """Order and number of units: as the recipe says, or raised while the error falls."""
    order, units = tournament.network.order, tournament.network.hidden
    first = tournament.first_order() if order == "auto" else order
    found = first if order != "auto" else None
    if found is None:
        tried = 0 if units == 0 else FIRST_UNITS if units == "auto" else units
        last = min(first + MORE_STATES, max(first, tournament.highest_order()))
        orders = range(first, last + 1, 2)
        found = _largest_worthwhile(list(orders), lambda n: _judge(tournament, n, tried))
    if units != "auto":
        return found, units
    numbers = [0]
    while (numbers[-1] or FIRST_UNITS // 2) < MOST_UNITS:
        numbers.append(2 * numbers[-1] or FIRST_UNITS)
    return found, _largest_worthwhile(numbers, lambda h: _judge(tournament, found, h))


def compete(tournament: Tournament, order: int, units: int) -> Entrant:
    """The tournament of one size: the winner, refined on all data."""
    training = tournament.training
    linear = tournament.linear(order)
    if units == 0:
        return tournament.refine(linear)
    dense = _dense_units(tournament, order, units)
    last = training.iterations if dense == units else training.stretches
    tournament.plan(_iterations(training, last))
    starts = [tournament.start(linear, dense, number) for number in range(training.starts)]
    winner = tournament.go_on(starts)[0]
    return tournament.refine(winner) if dense == units else tournament.widened(winner, units)


def _iterations(training: LeastSquaresRecipe, last: int) -> int:
    """Iterations of one tournament after its linear models, at most, with the winner's last."""
    first = training.starts * training.start_iterations
    return first + training.kept * training.kept_iterations + last


def _dense_units(tournament: Tournament, order: int, units: int) -> int:
    """Units for which normal equations are solved: all, or those of half the largest size."""
    limit = tournament.training.dense_limit
    if tournament.shape(order, units).n_parameters <= limit:
        return units
    while units > 1 and tournament.shape(order, units).n_parameters > limit // 2:
        units -= 1
    return units


def _judge(tournament: Tournament, order: int, units: int) -> float:
    """Validation error that a size reaches in a few short runs."""
    linear = tournament.linear(order)
    if units == 0:
        return linear.error
    units = _dense_units(tournament, order, units)
    judging = SEARCH_STARTS * tournament.training.start_iterations
    tournament.plan(judging + _iterations(tournament.training, tournament.training.iterations))
    starts = [tournament.start(linear, units, number) for number in range(SEARCH_STARTS)]
    return min(start.error for start in starts)


def _largest_worthwhile(sizes: list[int], judge: Callable[[int], float]) -> int:
    """The largest size that still was worth its price against the one before."""
    chosen, error = sizes[0], judge(sizes[0])
    for size in sizes[1:]:
        larger = judge(size)
        if not larger < WORTHWHILE * error:
            break
        chosen, error = size, larger
    return chosen


def freeze(winner: Entrant, problem: Problem) -> StateSpace:
    """The fitted network as data, in float32.

    Raises:
        ValueError: a weight is not finite.
    """
    shape, window = winner.shape, problem.window
    m, n, q = shape.split(winner.state.best), shape.n_states, len(shape.roles.drive)
    w = m.w if shape.bias else torch.cat([m.w, m.w.new_zeros(shape.n_units, 1)], 1)
    rows = [part.flatten(0, 1) for part in (m.c, m.d)]
    parts = (m.f[:, :n], m.f[:, n : n + q], m.f[:, n + q :], w, *rows, m.constant.flatten(), m.v)
    a, b, e, w32, c, d, d0, v = (np.array(part.cpu().numpy(), np.float32) for part in parts)
    cell = Cell(a, b, e, w32, c, d, d0, shape.units, v if shape.gated else None)
    return StateSpace(cell, window.n_in, window.n_out, problem.features, shape.roles, shape.turned)
