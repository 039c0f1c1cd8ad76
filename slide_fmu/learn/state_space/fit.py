"""A state-space network is fitted here: its size is chosen, its multi-start run, the best kept."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.learn.feature_choice import roles_of
from slide_fmu.learn.problem import Problem
from slide_fmu.learn.state_space.multi_start import (
    LINEAR_ITERATIONS,
    Candidate,
    FitData,
    MultiStart,
)
from slide_fmu.learn.state_space.normal_equations import sum_of_squares
from slide_fmu.learn.state_space.segments import Segments, cut_segments
from slide_fmu.learn.training import History, TrainingError
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

SEARCH_STARTS = 3
"""A size is judged by this many random starts when it is chosen automatically."""
WORTHWHILE = 0.8
"""A larger network is chosen when its error is below this part of the smaller one's."""
FIRST_UNITS, MOST_UNITS = 16, 64
"""The automatic choice tries 0 units, then the first number, then doubles it up to the second."""
FEWEST = 8
"""The starts have at least this many segments, where there are as many."""
MORE_STATES = 8
"""At most this many states are tried beyond the first guess."""


def fit_state_space(
    problem: Problem,
    network: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    progress: Progress,
) -> tuple[StateSpace, History]:
    """Fit a state-space network; return it with the history of its last run, in scaled units.

    The progress is called after every iteration of every run.

    Raises:
        TrainingError: no start gives a finite error.
        ValueError: trajectories are too short for the window, the order is too high for it, or a
            weight is not finite.
    """
    data = prepare(problem, network, training)
    multi_start = MultiStart(problem, network, training, data, progress)
    multi_start.plan(2 * LINEAR_ITERATIONS + _iterations(training, training.iterations))
    order, units = choose_sizes(multi_start)
    winner = compete(multi_start, order, units)
    if not math.isfinite(winner.error):
        raise TrainingError(
            "training diverged: no start of the state-space network has a finite validation "
            "error; give more starts (training.starts) or a lower network.order"
        )
    return freeze(winner, problem), _history(winner, data)


def _history(winner: Candidate, data: FitData) -> History:
    """Return the course of the winner's last run; its start is step 0 where no step was better."""
    rows = winner.state.history
    if not rows or min(row[2] for row in rows) > winner.error:
        cost = sum_of_squares(winner.shape, winner.state.best, data.whole)
        error = math.sqrt(cost / data.whole.counted)
        rows = ((0, error, winner.error), *rows)
    return History(*zip(*rows, strict=True))


def prepare(problem: Problem, network: StateSpaceRecipe, training: LeastSquaresRecipe) -> FitData:
    """Cut trajectories into segments, for the starts and for the whole fit.

    Raises:
        ValueError: trajectories are not longer than the truncated part of the window.
    """
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
    """Choose the stride by which the segments of the starts are taken.

    It is the least from ``part`` on, or the greatest below it, that has no divisor in common with
    the number of pieces of a trajectory: else only early pieces, say, would be taken.
    """
    most = max(1, count // FEWEST)
    wished = [*range(part, most + 1), *range(min(part, most), 0, -1)]
    fitting: list[int] = [stride for stride in wished if math.gcd(stride, pieces) == 1]
    return fitting[0]


def choose_sizes(multi_start: MultiStart) -> tuple[int, int]:
    """Return order and number of units, as the recipe says, or raised while the error falls."""
    order, units = multi_start.network.order, multi_start.network.hidden
    if order == "auto":
        first = multi_start.first_order()
        tried = FIRST_UNITS if units == "auto" else units
        last = min(first + MORE_STATES, max(first, multi_start.highest_order()))
        orders = range(first, last + 1, 2)  # by two: an oscillation has two states
        order = _largest_worthwhile(list(orders), lambda n: _judge(multi_start, n, tried))
    if units == "auto":
        numbers = [0]
        while (numbers[-1] or FIRST_UNITS // 2) < MOST_UNITS:
            numbers.append(2 * numbers[-1] or FIRST_UNITS)
        units = _largest_worthwhile(numbers, lambda h: _judge(multi_start, order, h))
    return order, units


def compete(multi_start: MultiStart, order: int, units: int) -> Candidate:
    """Run the multi-start of one order (without padding) and number of units, perhaps 0.

    The winner, refined on all data, is returned.
    """
    training = multi_start.training
    linear = multi_start.linear(order)
    if units == 0:
        return multi_start.refine(linear)
    dense = _dense_units(multi_start, order, units)
    last = training.iterations if dense == units else training.stretches
    multi_start.plan(_iterations(training, last))
    starts = [multi_start.start(linear, dense, number) for number in range(training.starts)]
    winner = multi_start.go_on(starts)[0]
    return multi_start.refine(winner) if dense == units else multi_start.widened(winner, units)


def _iterations(training: LeastSquaresRecipe, last: int) -> int:
    """Return the greatest number of iterations of a multi-start after its linear models.

    The last ones, of the winner alone, are given.
    """
    first = training.starts * training.start_iterations
    return first + training.kept * training.kept_iterations + last


def _dense_units(multi_start: MultiStart, order: int, units: int) -> int:
    """Return the number of units for which normal equations are solved: all, up to the limit.

    Beyond it, it is that of half the limit: the fit is widened from there by gradient steps.
    """
    limit = multi_start.training.dense_limit
    if multi_start.shape(order, units).n_parameters <= limit:
        return units
    while units > 1 and multi_start.shape(order, units).n_parameters > limit // 2:
        units -= 1
    return units


def _judge(multi_start: MultiStart, order: int, units: int) -> float:
    """Return the validation error that a size reaches in a few short runs."""
    linear = multi_start.linear(order)
    if units == 0:
        return linear.error
    units = _dense_units(multi_start, order, units)
    judging = SEARCH_STARTS * multi_start.training.start_iterations
    multi_start.plan(judging + _iterations(multi_start.training, multi_start.training.iterations))
    starts = [multi_start.start(linear, units, number) for number in range(SEARCH_STARTS)]
    return min(start.error for start in starts)


def _largest_worthwhile(sizes: list[int], judge: Callable[[int], float]) -> int:
    """Return the largest size that was worth its price against the one before it."""
    chosen, error = sizes[0], judge(sizes[0])
    for size in sizes[1:]:
        larger = judge(size)
        if not larger < WORTHWHILE * error:
            break
        chosen, error = size, larger
    return chosen


def freeze(winner: Candidate, problem: Problem) -> StateSpace:
    """Return the fitted network as data, in float32.

    Raises:
        ValueError: a weight is not finite.
    """
    shape, window = winner.shape, problem.window
    cell = shape.split(winner.state.best)
    if not shape.bias:
        cell = replace(cell, w=torch.cat([cell.w, cell.w.new_zeros(shape.n_units, 1)], 1))
    arrays: dict[str, Any] = {
        n: np.array(part.cpu().numpy(), np.float32) for n, part in cell.arrays().items()
    }
    cell = replace(cell, **arrays)
    return StateSpace(cell, window.n_in, window.n_out, problem.features, shape.roles, shape.turned)
