"""A state-space network is fitted here: its size is chosen, its multi-start run, the best kept."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.history import History, TriedUnits
from slide_fmu.fitting.problem import FittedNetwork, Problem
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.cubes import with_room
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.multi_start import (
    LINEAR_ITERATIONS,
    Candidate,
    MultiStart,
    while_it_pays,
)
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.objective import FitData, fit_data
from slide_fmu.fitting.state_space.sizes import POOR, USED, Chosen, choose_sizes, still_learnable
from slide_fmu.fitting.state_space.unit_choice import choose_units
from slide_fmu.network.state_space.cell import GATED, Cell
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

PER_PARAMETER = 10
"""Fewer samples for each parameter than these do not tell good parameters from others."""

ROUND, HELPS = 20, 0.99
"""Where two sizes compete, both are refined by so many iterations, and then in further rounds, as
long as a round lowers the error below this part: most reach a plateau soon. The larger one goes on
only if it may still win."""

WITH_MORE_STATES = "refined with more states"
"""The run of the network of more states than the search has chosen is called so."""


def fit_state_space(
    problem: Problem,
    network: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    progress: Progress,
) -> FittedNetwork:
    """Fit a state-space network; its history is that of its last run, in scaled units.

    The progress is called after every iteration of every run.

    Raises:
        TrainingError: no start gives a finite error.
        ValueError: trajectories are too short for the window, the order is too high for it, or a
            weight is not finite.
    """
    data = fit_data(problem, network, training)
    kinds: tuple[TriedUnits, ...] = ()
    if network.units == "auto" and problem.start is None:
        network, kinds = choose_units(problem, network, training, data, progress)
    multi_start = MultiStart(problem, network, training, data, progress)
    if problem.start is not None:
        multi_start.plan(training.iterations)
        winner = multi_start.refine_known(begun_with(problem.start, multi_start))
        multi_start.finish()
        return FittedNetwork(freeze(winner, problem, data), _history(winner, data), network)
    chosen = choose_sizes(multi_start)
    winner = compete(multi_start, chosen)
    multi_start.finish()
    if not math.isfinite(winner.error):
        raise TrainingError(
            "training diverged: no start of the state-space network has a finite validation "
            "error; give more starts (training.starts) or a lower network.order"
        )
    learnable, samples = still_learnable(multi_start, winner), data.whole.targets.numel()
    weighted, parameters = problem.noise is not None, winner.shape.n_parameters
    remark = remark_on(winner.error, learnable, parameters, samples, weighted)
    history = replace(_history(winner, data), sizes=chosen.tried, units=kinds, remark=remark)
    n_states, n_units = winner.shape.n_states, winner.shape.n_units
    order = n_states - (network.padding if n_units else 0)
    table = network.model_copy(update={"order": order, "hidden": n_units})
    return FittedNetwork(freeze(winner, problem, data), history, table)


def begun_with(start: StateSpace, multi_start: MultiStart) -> Candidate:
    """Return the candidate that is a known network; physical parameters do not move it yet."""
    cell = start.cell
    units = GATED if cell.gated else cell.activation
    sizes = len(cell.a), len(cell.w), start.n_values
    terms = multi_start.terms
    shape = CellShape(*sizes, start.roles, units, True, start.turned, terms, cell.substeps)
    arrays: dict[str, Any] = {
        name: torch.from_numpy(part.astype(np.float64)) for name, part in cell.arrays().items()
    }
    constant = shape.join(replace(cell, **arrays))
    others = constant.new_zeros(shape.n_parameters - shape.n_weights)
    theta = torch.cat([constant, others]).to(multi_start.data.whole.features)
    return Candidate(shape, Iterate(theta, theta, math.inf))


def _history(winner: Candidate, data: FitData) -> History:
    """Return the course of the winner's last run; its start is step 0 where no step was better."""
    rows = winner.state.history
    if not rows or min(row[2] for row in rows) > winner.error:
        cost = sum_of_squares(winner.shape, winner.state.best, data.whole)
        error = math.sqrt(cost / data.whole.counted)
        rows = ((0, error, winner.error), *rows)
    steps, training_errors, validation_errors = zip(*rows, strict=True)
    return History(steps, training_errors, validation_errors)


def compete(multi_start: MultiStart, chosen: Chosen) -> Candidate:
    """Return the best network of a size, refined on all data.

    A search has run several starts of the size, and the best of them further: that one is taken.
    Sizes that are given have a multi-start of their own.
    """
    training, order, n_units = multi_start.training, chosen.order, chosen.n_units
    dense = multi_start.dense_units(order, n_units) if n_units else 0
    last = training.iterations if dense == n_units else training.stretches
    winner = chosen.judged
    if winner is None:
        multi_start.plan(
            2 * LINEAR_ITERATIONS + (_iterations(training, last) if n_units else last)
        )
        winner = multi_start.linear(order)
        if n_units:
            starts = [multi_start.start(winner, dense, n) for n in range(training.starts)]
            winner = multi_start.go_on(starts)[0]
        return _last_run(multi_start, winner, n_units, dense)
    larger = chosen.larger
    alone = dense != n_units or larger is None or larger.shape.n_units != n_units
    if alone or larger is None:
        multi_start.plan(last)
        return _last_run(multi_start, winner, n_units, dense)
    used = larger.error < USED * winner.error  # it makes use of its states already
    if used:
        multi_start.plan(last)
        return multi_start.refine(larger, WITH_MORE_STATES)
    first = min(ROUND, last)
    multi_start.plan(2 * last)
    refined = multi_start.refine(winner, iterations=first)
    other = multi_start.refine(larger, WITH_MORE_STATES, first)
    # what it would reach if every further round helped as much as the first one
    reached = other.error * (other.error / larger.error) ** ((last - first) / ROUND)
    refined = _refined_on(multi_start, refined, last - first, "refined")
    if reached < USED * refined.error:
        other = _refined_on(multi_start, other, last - first, WITH_MORE_STATES)
    return other if other.error < USED * refined.error else refined


def _refined_on(
    multi_start: MultiStart, candidate: Candidate, iterations: int, name: str
) -> Candidate:
    """Refine a network by this many iterations more, or until a round of them hardly helps."""
    rounds = [
        partial(
            multi_start.refine_again,
            name=f"{name}, again {number}",
            iterations=min(ROUND, iterations - done),
        )
        for number, done in enumerate(range(0, iterations, ROUND), start=1)
    ]
    return while_it_pays(
        candidate, rounds, lambda after, before: after.error <= HELPS * before.error
    )


def _last_run(multi_start: MultiStart, winner: Candidate, n_units: int, dense: int) -> Candidate:
    """Refine the winner, or widen it where normal equations are solved for fewer hidden units."""
    if dense != n_units:
        return multi_start.widened(winner, n_units)
    return multi_start.refine(winner)


def _iterations(training: LeastSquaresRecipe, last: int) -> int:
    """Return the greatest number of iterations of a multi-start after its linear models.

    The last ones, of the winner alone, are given.
    """
    first = training.starts * training.start_iterations
    return first + training.kept * training.kept_iterations + last


def freeze(winner: Candidate, problem: Problem, data: FitData) -> StateSpace:
    """Return the fitted network as data, in float32; its cubes have room beyond the data.

    Raises:
        ValueError: a weight is not finite.
    """
    shape, window = winner.shape, problem.window
    theta = with_room(shape, winner.state.best, data.whole)
    cells = tuple(_frozen(shape, cell) for cell in shape.cells(theta))
    weights: Cell | CellPolynomial = cells[0]
    if problem.physical is not None:
        weights = CellPolynomial(problem.physical.basis, cells)
    return StateSpace(
        weights, window.n_in, window.n_out, problem.features, shape.roles, shape.turned
    )


def _frozen(shape: CellShape, cell: Cell) -> Cell:
    """Return a cell of tensors as arrays of float32, with the constant terms left out as zeros."""
    if not shape.bias:
        cell = replace(cell, w=torch.cat([cell.w, cell.w.new_zeros(shape.n_units, 1)], 1))
    arrays: dict[str, Any] = {
        n: np.array(part.cpu().numpy(), np.float32) for n, part in cell.arrays().items()
    }
    return replace(cell, **arrays)


def remark_on(
    error: float, learnable: float, parameters: int, samples: int, weighted: bool = False
) -> str | None:
    """Return what is to be said about a network; None if there is nothing.

    The error is that of the validation and ``learnable`` the part of it that could still be
    learnt, both relative to the outputs' standard deviation, and perhaps weighted by the spectrum
    of noise; ``samples`` is the number of scored values of outputs that the parameters were learnt
    from.
    """
    found = [_remark_on_error(error, learnable, weighted), remark_on_samples(parameters, samples)]
    return "; ".join(remark for remark in found if remark is not None) or None


def remark_on_samples(parameters: int, samples: int) -> str | None:
    """Tell that parameters are many beside the samples that they were learnt from."""
    if samples >= PER_PARAMETER * parameters:
        return None
    return (
        f"the network has {parameters} parameters and was learnt from {samples} samples of "
        f"outputs, {samples / parameters:.2g} for each; expected at least {PER_PARAMETER}: its "
        "validation error hardly tells how it does elsewhere; give longer records (data.train), "
        "or fewer units (network.hidden)"
    )


def _remark_on_error(error: float, learnable: float, weighted: bool) -> str | None:
    """Tell of a poor result: one whose errors the inputs could still explain in good part."""
    if learnable < POOR:
        return None
    how = ", weighted by the spectrum of the noise" if weighted else ""
    return (
        f"the network misses {100 * error:.2g} % of the outputs (RMS over standard deviation, in "
        f"validation{how}), and {100 * learnable:.2g} % could still be learnt from the inputs: "
        "give more trajectories (data.train), more units (network.hidden) or states "
        "(network.order), or more starts (training.starts)"
    )
