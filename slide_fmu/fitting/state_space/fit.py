"""A state-space network is fitted: its size is chosen, its multi-start run, and the best kept."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.history import History, UnitTrial
from slide_fmu.fitting.ladder import pays, run_while_it_pays
from slide_fmu.fitting.problem import FittedNetwork, Problem
from slide_fmu.fitting.state_space.amounts import LINEAR_ITERATIONS
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.cubes import with_room
from slide_fmu.fitting.state_space.fit_data import FitData, fit_data
from slide_fmu.fitting.state_space.from_states import FitFromStates, FromStates
from slide_fmu.fitting.state_space.known_states import known_states
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.sizes import (
    POOR,
    USED,
    SizeChoice,
    choose_sizes,
    still_learnable,
)
from slide_fmu.fitting.state_space.unit_choice import choose_units
from slide_fmu.network.state_space.cell import GATED, Cell
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

PER_PARAMETER = 10
"""With fewer samples per parameter, good and bad parameters cannot be distinguished."""

ROUND, HELPS = 20, 0.99
"""If two sizes compete, both are refined by this number of iterations, then in further rounds,
while a round lowers the error below this fraction: most reach a plateau soon. The larger one
continues only if it can still win."""

WITH_MORE_STATES = "refined with more states"
"""Name of the run of the network with more states than the search has chosen."""


def fit_state_space(
    problem: Problem,
    network: StateSpaceRecipe,
    training: LeastSquaresRecipe,
    progress: Progress,
) -> FittedNetwork:
    """Fit a state-space network; its history is from its last run, in scaled units.

    The progress is called after every iteration of every run.

    Raises:
        TrainingError: no start gives a finite error.
        ValueError: trajectories are too short for the window, the order is too high for it, or a
            weight is not finite.
    """
    data = fit_data(problem, network, training)
    multi_start, known, why = MultiStart(data, progress), known_states(data), list[str]()
    from_states = None if known is None else FitFromStates(multi_start, known)
    found = None if from_states is None else from_states.sized()
    if from_states is not None and found is not None:
        if found.candidate.error < POOR:
            return _refined(from_states, found)
        why.append(found.explanation)
    kinds = tuple[UnitTrial, ...]()
    if network.units == "auto" and problem.start is None:
        network, kinds, explanation = choose_units(data, progress)
        why += [] if explanation is None else [explanation]
        data = replace(data, network=network)
        multi_start = MultiStart(data, progress)
    chosen = None
    if problem.start is None:
        chosen = choose_sizes(multi_start)
        if from_states is not None and found is not None:
            searched = math.inf if chosen.judged is None else chosen.judged.error
            if not searched < found.candidate.error:
                return _refined(from_states, found)
        winner = compete(multi_start, chosen)
    else:
        problem.sized(network)
        multi_start.ledger.plan(training.iterations)
        winner = multi_start.refine_known(candidate_from(problem.start, multi_start))
    multi_start.ledger.finish()
    if not math.isfinite(winner.error):
        raise TrainingError(
            "training diverged: no start has a finite validation error; give more starts "
            "(training.starts), a lower network.order, or another FMU as training.start"
        )
    if chosen is None:
        return FittedNetwork(freeze(winner, data), _history(winner, data), network)
    history = replace(
        _history(winner, data),
        sizes=chosen.tried,
        units=kinds,
        explanations=(*why, *chosen.explanations),
        remark=remark_on(winner, still_learnable(data, winner), data),
    )
    return FittedNetwork(freeze(winner, data), history, _sized(network, winner.shape))


def _refined(fit: FitFromStates, found: FromStates) -> FittedNetwork:
    """Return a network that began at known states, after its last runs."""
    data = found.data
    data.problem.sized(found.table)
    winner = fit.refined(found)
    remarks = found.remark, remark_on(winner, still_learnable(data, winner), data)
    history = replace(
        _history(winner, data),
        sizes=found.tried,
        explanations=(found.explanation,),
        remark="; ".join(remark for remark in remarks if remark is not None) or None,
    )
    return FittedNetwork(freeze(winner, data), history, found.table)


def _sized(network: StateSpaceRecipe, shape: CellShape) -> StateSpaceRecipe:
    """Return the table of a network with the sizes of a cell, which has padding where it needs."""
    order = shape.n_states - (network.padding if shape.n_units else 0)
    return network.model_copy(update={"order": order, "hidden": shape.n_units})


def candidate_from(start: StateSpace, multi_start: MultiStart) -> Candidate:
    """Return the candidate made from a known network, before physical parameters affect it."""
    cell = start.cell
    units = GATED if cell.gated else cell.activation
    sizes = len(cell.a), len(cell.w), start.n_values
    terms = multi_start.terms
    shape = CellShape(*sizes, start.roles, units, True, start.turned, terms, cell.substeps)
    arrays = {
        name: torch.from_numpy(part.astype(np.float64)) for name, part in cell.arrays().items()
    }
    constant = shape.join(cell.with_arrays(arrays))
    others = constant.new_zeros(shape.n_parameters - shape.n_weights)
    theta = torch.cat([constant, others]).to(multi_start.data.whole.features)
    return Candidate(shape, Iterate(theta, theta, math.inf))


def _history(winner: Candidate, data: FitData) -> History:
    """Return the course of the winner's last run; step 0 is its start, if no step was better."""
    rows = winner.state.history
    if not rows or min(row[2] for row in rows) > winner.error:
        cost = sum_of_squares(winner.shape, winner.state.best, data.whole)
        error = math.sqrt(cost / data.whole.counted)
        rows = ((0, error, winner.error), *rows)
    steps, training_errors, validation_errors = zip(*rows, strict=True)
    return History(steps, training_errors, validation_errors)


def compete(multi_start: MultiStart, chosen: SizeChoice) -> Candidate:
    """Return the best network of a size, refined on all data.

    If a search has run several starts of the size, and the best of them further, that one is
    taken. Given sizes have their own multi-start. If normal equations are solved for fewer hidden
    units, the best network is widened.
    """
    training, n_units, larger = multi_start.training, chosen.n_units, chosen.larger
    network, sized = multi_start.network, multi_start.problem.sized
    dense = multi_start.dense_units(chosen.order, n_units) if n_units else 0
    last = training.iterations if dense == n_units else training.expert.refinements
    winner = chosen.judged
    competes = larger is not None and dense == n_units == larger.shape.n_units
    if not competes:
        sized(_sized(network, multi_start.shape(chosen.order, n_units)))
    if winner is None:
        search = training.search_iterations(training.starts, training.expert.kept)
        multi_start.ledger.plan(2 * LINEAR_ITERATIONS + (search if n_units else 0) + last)
        winner = multi_start.linear(chosen.order)
        if n_units:
            numbers = range(training.starts)
            winner = multi_start.best_of([multi_start.start(winner, dense, n) for n in numbers])
    elif larger is not None and competes:
        return _of_two(multi_start, winner, larger)
    else:
        multi_start.ledger.plan(last)
    if dense == n_units:
        return multi_start.refine(winner)
    return multi_start.widened(winner, n_units)


def _of_two(multi_start: MultiStart, winner: Candidate, larger: Candidate) -> Candidate:
    """Refine the chosen network, and one with more states if that can win."""
    last = multi_start.training.iterations
    if pays(larger.error, winner.error, USED):  # it uses its states already
        multi_start.problem.sized(_sized(multi_start.network, larger.shape))
        multi_start.ledger.plan(last)
        return multi_start.refine(larger, WITH_MORE_STATES)
    first = min(ROUND, last)
    multi_start.ledger.plan(2 * last)
    refined = multi_start.refine(winner, iterations=first)
    other = multi_start.refine(larger, WITH_MORE_STATES, first)
    # the error if every further round helped as much as the first one
    reached = other.error * (other.error / larger.error) ** ((last - first) / ROUND)
    refined = _refined_on(multi_start, refined, last - first, "refined")
    if pays(reached, refined.error, USED):
        other = _refined_on(multi_start, other, last - first, WITH_MORE_STATES)
    return other if pays(other.error, refined.error, USED) else refined


def _refined_on(
    multi_start: MultiStart, candidate: Candidate, iterations: int, name: str
) -> Candidate:
    """Refine a network by ``iterations`` more, or until a round of them hardly helps."""
    rounds = [
        partial(
            multi_start.refine,
            name=f"{name}, again {number}",
            iterations=min(ROUND, iterations - done),
            afresh=False,
        )
        for number, done in enumerate(range(0, iterations, ROUND), start=1)
    ]
    return run_while_it_pays(
        candidate, rounds, lambda after, before: pays(after.error, before.error, HELPS)
    )


def freeze(winner: Candidate, data: FitData) -> StateSpace:
    """Return the fitted network as data, in float32; its cubes extend beyond the data."""
    shape, problem, window = winner.shape, data.problem, data.problem.window
    theta = with_room(shape, winner.state.best, data.whole)
    cells = tuple(_frozen(shape, cell) for cell in shape.cells(theta))
    weights: Cell | CellPolynomial = cells[0]
    if problem.physical is not None:
        weights = CellPolynomial(problem.physical.basis, cells)
    return StateSpace(
        weights, window.n_in, window.n_out, problem.features, shape.roles, shape.turned
    )


def _frozen(shape: CellShape, cell: Cell) -> Cell:
    """Return a cell of tensors as float32 arrays, with zeros for omitted constant terms."""
    if not shape.bias:
        cell = replace(cell, w=torch.cat([cell.w, cell.w.new_zeros(shape.n_units, 1)], 1))
    arrays = {n: np.array(part.cpu().numpy(), np.float32) for n, part in cell.arrays().items()}
    return cell.with_arrays(arrays)


def remark_on(winner: Candidate, learnable: float, data: FitData) -> str | None:
    """Say that a network is poor, or had few data; None if neither is true.

    ``learnable`` is the part of its validation error that could still be learnt, relative to the
    outputs' standard deviation. A network is poor if that is large.
    """
    remarks, noise, measured = [], data.problem.noise, data.problem.measured
    more = "longer records" if measured else "more trajectories (data.train)"
    if learnable >= POOR:
        how = "" if noise is None else ", weighted by the spectrum of the noise"
        remarks.append(
            f"the network misses {100 * winner.error:.2g} % of the outputs (RMS over standard "
            f"deviation, in validation{how}), and {100 * learnable:.2g} % could still be learnt "
            f"from the inputs: give {more}, more units (network.hidden) or "
            "states (network.order), or more starts (training.starts)"
        )
    parameters, samples = winner.shape.n_parameters, data.whole.targets.numel()
    if samples < PER_PARAMETER * parameters:
        remarks.append(
            f"the network has {parameters} parameters and was learnt from {samples} samples of "
            f"outputs, {samples / parameters:.2g} for each; expected at least {PER_PARAMETER}: "
            f"its validation error says little about other data; give {more}, or fewer units "
            "(network.hidden)"
        )
    return "; ".join(remarks) or None
