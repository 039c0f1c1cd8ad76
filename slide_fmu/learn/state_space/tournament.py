"""The runs that a state-space fit consists of: linear models, random starts, the best refined."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.core.progress import Progress
from slide_fmu.learn.problem import Problem
from slide_fmu.learn.state_space import levenberg_marquardt, preconditioned_descent
from slide_fmu.learn.state_space.cell import CellShape, simulate
from slide_fmu.learn.state_space.coordinates import rescale, widen
from slide_fmu.learn.state_space.ledger import Ledger
from slide_fmu.learn.state_space.levenberg_marquardt import Iterate, LeastSquares
from slide_fmu.learn.state_space.linear_start import (
    LinearModel,
    excited_eigenvalues,
    from_eigenvalues,
    from_turned_pairs,
    impulse_responses,
    lowest_eigenvalues,
    realize,
    states_of,
    states_shown,
)
from slide_fmu.learn.state_space.normal_equations import (
    NormalEquations,
    normal_equations,
    sum_of_squares,
)
from slide_fmu.learn.state_space.pole_penalty import PolePenalty, pole_radii
from slide_fmu.learn.state_space.preconditioned_descent import Descent
from slide_fmu.learn.state_space.segments import Segments
from slide_fmu.network.roles import Roles
from slide_fmu.recipe.against_system import require_turned_pairs
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

LINEAR_ITERATIONS = 15
MOST_RESIDUALS = 1_000_000
"""Residuals that linear models are fitted to; of more data, those of the starts will do."""
SHORTEST_RESPONSE, LONGEST_RESPONSE = 40, 200
"""Samples of the impulse responses that a linear model is realized from; between them, as many as
the window truncates."""
START_STRIDE = 1009
"""Random starts that a seed has of its own."""


@dataclass(frozen=True, eq=False)
class FitData:
    """What a fit works on.

    Attributes:
        whole: segments of all trajectories.
        part: the segments of the starts.
        validation: segments to choose by.
        features: of whole trajectories, scaled, shape (n_trajectories, N, q).
        roles: what they are for.
    """

    whole: Segments
    part: Segments
    validation: Segments
    features: torch.Tensor
    roles: Roles


@dataclass(frozen=True, eq=False)
class Entrant:
    """A network in the tournament and where its run stands."""

    shape: CellShape
    state: Iterate | Descent

    @property
    def error(self) -> float:
        """Its best validation error, in scaled units."""
        return self.state.best_error


class Tournament:
    """All runs of one fit, each named and stored in the ledger. Final.

    Args:
        problem: window, eigenvalues, checkpoint.
        network: units, padding, bias.
        training: numbers of starts and iterations.
    """

    def __init__(
        self,
        problem: Problem,
        network: StateSpaceRecipe,
        training: LeastSquaresRecipe,
        data: FitData,
        progress: Progress,
    ) -> None:
        self.problem, self.network, self.training, self.data = problem, network, training, data
        self._ledger = Ledger(problem.checkpoint, data.features.device, progress)
        self._responses: torch.Tensor | None = None

    def plan(self, iterations: int) -> None:
        """Tell how many iterations are still to come, for the progress."""
        self._ledger.planned = self._ledger.iterations + iterations
        self._ledger.show()

    def shape(self, order: int, units: int) -> CellShape:
        """The cell of an order and a number of units; a linear one has no states to spare.

        Raises:
            ValueError: more pairs of states are turned than there are.
        """
        pairs = self.network.turned_pairs
        n_outputs = self.data.whole.targets.shape[2]
        if pairs:
            require_turned_pairs(pairs, order, len(self.data.roles.drive), n_outputs)
        return CellShape(
            order + (self.network.padding if units else 0),
            units,
            n_outputs,
            self.data.roles,
            self.network.units,
            self.network.bias,
            pairs,
        )

    def first_order(self) -> int:
        """Number of states of the excited eigenvalues, else of the impulse responses."""
        excited = self._excited()
        if excited is not None:
            return states_of(excited)
        return min(states_shown(self._impulse_responses()), self.highest_order())

    def highest_order(self) -> int:
        """Number of states that impulse responses of this length can show."""
        taps, p, q = self._impulse_responses().shape
        return taps // 2 * min(p, q)

    def linear(self, order: int) -> Entrant:
        """The best linear model of an order, on all data; of very many, on those of the starts."""
        shape, data = self.shape(order, 0), self.data
        many = data.whole.targets.numel() > MOST_RESIDUALS
        found = []
        for source, model in self._linear_starts(shape).items():
            theta = shape.linear(*model).to(data.features)
            name = f"linear, {order} states, from {source}"
            segments = data.part if many else data.whole
            found.append(self._descend(name, shape, theta, segments, LINEAR_ITERATIONS))
        return min(found, key=lambda entrant: entrant.error)

    def _linear_starts(self, shape: CellShape) -> dict[str, LinearModel]:
        """Linear models to start from, by what they come from."""
        order, step, n_drive = shape.n_states, self.problem.window.step, len(shape.roles.drive)
        generator = torch.Generator().manual_seed(self.training.seed)
        known = np.zeros(0, np.complex128)
        if self.problem.eigenvalues is not None:
            known = self.problem.eigenvalues
        if shape.turned:
            sizes = (order, shape.turned, n_drive, shape.n_outputs)
            return {"turned pairs": from_turned_pairs(known, step, sizes, generator)}
        starts, lowest = {}, lowest_eigenvalues(known, order)
        if lowest is not None:
            sizes_of = (n_drive, shape.n_outputs)
            starts["eigenvalues"] = from_eigenvalues(lowest, step, sizes_of, generator)
        if order <= self.highest_order() or not starts:
            starts["impulse responses"] = realize(self._impulse_responses(), order)
        return starts

    def start(self, linear: Entrant, units: int, number: int) -> Entrant:
        """A random start from a linear model; every second one in whitened coordinates."""
        old, order = linear.shape, linear.shape.n_states
        shape = self.shape(order, units)
        features = self.data.part.features
        _, states = simulate(old, linear.state.best, features)
        m = old.split(linear.state.best)
        if not shape.turned:  # pairs that turn keep their coordinates
            m = rescale(old, m, states, whiten=number % 2 == 1)
        seed = (self.training.seed * START_STRIDE + number) % 2**32
        theta = widen(m, old, shape, torch.Generator().manual_seed(seed))
        name = f"start {number}, {order} states, {units} units"
        return self._descend(name, shape, theta, self.data.part, self.training.start_iterations)

    def go_on(self, entrants: list[Entrant]) -> list[Entrant]:
        """The best starts, some iterations more on the same data; the best first."""
        ranked = sorted(entrants, key=lambda entrant: entrant.error)
        kept = []
        for place, entrant in enumerate(ranked[: self.training.kept]):
            name = f"kept {place}, {entrant.shape.n_states} states, {entrant.shape.n_units} units"
            iterations = self.training.kept_iterations
            theta, part = entrant.state.best, self.data.part
            kept.append(self._descend(name, entrant.shape, theta, part, iterations))
        return sorted(kept, key=lambda entrant: entrant.error)

    def refine(self, entrant: Entrant) -> Entrant:
        """The winner on all data."""
        theta, iterations = entrant.state.best, self.training.iterations
        return self._descend("refined", entrant.shape, theta, self.data.whole, iterations)

    def widened(self, entrant: Entrant, units: int) -> Entrant:
        """A network of more units than normal equations can be solved for, from a smaller one."""
        old, training = entrant.shape, self.training
        shape = self.shape(old.n_states - self.network.padding, units)
        generator = torch.Generator().manual_seed(training.seed)
        theta = widen(old.split(entrant.state.best), old, shape, generator)
        validation = self._least_squares(shape, self.data.validation).validation
        radius = self._penalty(1).radius

        def stretch(state: Descent) -> Descent:
            after = preconditioned_descent.advance_stretch(
                state, shape, self.data.whole, validation, radius, training.seed
            )
            self._ledger.best = min(self._ledger.best, after.best_error)
            return after

        begin = Descent.begin(theta, validation(theta))
        done = self._ledger.run(f"widened to {units}", begin, stretch, training.stretches)
        return self._entered(shape, done)

    def _descend(
        self, name: str, shape: CellShape, theta: torch.Tensor, segments: Segments, iterations: int
    ) -> Entrant:
        """A run of Levenberg-Marquardt."""
        least_squares = self._least_squares(shape, segments)

        def step(state: Iterate) -> Iterate:
            after = levenberg_marquardt.advance(state, least_squares)
            self._ledger.best = min(self._ledger.best, after.best_error)
            return after

        begin = Iterate.begin(theta, least_squares)
        return self._entered(shape, self._ledger.run(name, begin, step, iterations))

    def _entered(self, shape: CellShape, state: Iterate | Descent) -> Entrant:
        """An entrant whose run is done, perhaps before this fit was resumed."""
        self._ledger.best = min(self._ledger.best, state.best_error)
        self._ledger.show()
        return Entrant(shape, state)

    def _penalty(self, residuals: int) -> PolePenalty:
        excited, step = self._excited(), self.problem.window.step
        slowest = 0.0 if excited is None else float(np.exp(excited.real * step).max())
        return PolePenalty.of(self.problem.window, slowest, residuals)

    def _least_squares(self, shape: CellShape, segments: Segments) -> LeastSquares:
        """Errors on segments with the penalty on poles; an unstable A never validates."""
        validation, penalty = self.data.validation, self._penalty(segments.targets.numel())

        def normal(theta: torch.Tensor) -> NormalEquations:
            return penalty.join(normal_equations(shape, theta, segments), shape, theta)

        def cost(theta: torch.Tensor) -> float:
            squares = sum_of_squares(shape, theta, segments)
            return squares + penalty.cost(shape, theta) if math.isfinite(squares) else squares

        def error(theta: torch.Tensor) -> float:
            squares = sum_of_squares(shape, theta, validation)
            fine = math.isfinite(squares) and float(pole_radii(shape, theta).max()) < 1
            return math.sqrt(squares / validation.counted) if fine else math.inf

        return LeastSquares(normal, cost, segments.counted, error)

    def _excited(self) -> NDArray[np.complex128] | None:
        if self.problem.eigenvalues is None or len(self.problem.eigenvalues) == 0:
            return None
        drive = self.data.features[:, :, list(self.data.roles.drive)]
        return excited_eigenvalues(self.problem.eigenvalues, drive, self.problem.window.step)

    def _impulse_responses(self) -> torch.Tensor:
        if self._responses is None:
            longest = min(LONGEST_RESPONSE, self.data.features.shape[1] // 2)
            wanted = max(self.problem.window.memory_length, SHORTEST_RESPONSE)
            taps = max(2, min(wanted, longest))
            targets = self.problem.training[1].to(self.data.features)
            roles, features = self.data.roles, self.data.features
            others = [index for index in roles.static if index not in roles.drive]
            drive, static = features[:, :, list(roles.drive)], features[:, :, others]
            self._responses = impulse_responses(drive, static, targets, taps)
        return self._responses
