"""The runs of a state-space fit are a multi-start with successive halving.

Linear models come first. Random starts of the hidden units follow. The best candidates continue,
fewer in every round, and the last one is refined on all data. (Successive halving: Jamieson and
Talwalkar, 2016; here the recipe sets the sizes of the rounds.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import final

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.state_space import levenberg_marquardt, preconditioned_descent
from slide_fmu.fitting.state_space.amounts import LINEAR_ITERATIONS, MOST_OF_LINEAR
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.coordinates import balanced, in_substeps, rescale, widen_all
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.ledger import Ledger
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.linear_start import (
    from_eigenvalues,
    from_turned_pairs,
    lowest_eigenvalues,
    pulled_inside,
    states_of,
)
from slide_fmu.fitting.state_space.modal_fit import ModalFit, Sections, has_sections, with_best
from slide_fmu.fitting.state_space.normal_equations import normal_equations
from slide_fmu.fitting.state_space.penalties import STRENGTHS, Prior
from slide_fmu.fitting.state_space.preconditioned_descent import Descent
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.subspace import Subspace, subspace_of
from slide_fmu.recipe.against_system import require_turned_pairs

START_STRIDE = 1009
"""Distance of the random starts of two seeds, so that they share none."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A Candidate is a network in the multi-start, with the state of its run.

    Attributes:
        shape: shape of its cell.
        state: the last state of its run, with its best parameters.
    """

    shape: CellShape
    state: Iterate | Descent

    @property
    def error(self) -> float:
        """The best validation error, an RMS in scaled units."""
        return self.state.best_error

    @property
    def training_error(self) -> float:
        """The last error on the training data, an RMS in scaled units."""
        rows = self.state.history
        return rows[-1][1] if rows else math.inf


@final
class MultiStart:
    """A MultiStart does all runs of one fit, each named and stored in the ledger.

    The progress is called after every iteration.

    Attributes:
        data: the data of the runs.
        ledger: stores the parts of the fit and their runs.
    """

    def __init__(self, data: FitData, progress: Progress) -> None:
        self.data, self.problem = data, data.problem
        self.network, self.training = data.network, data.training
        self.ledger = Ledger(data.problem.checkpoint, data.features.device, progress)

    def shape(self, order: int, n_units: int) -> CellShape:
        """Return the shape of a cell; with hidden units it has spare states (the padding)."""
        pairs = self.network.turned_pairs
        n_outputs = self.data.whole.targets.shape[2]
        if pairs:
            require_turned_pairs(pairs, order, len(self.data.roles.drive), n_outputs)
        return CellShape(
            order + (self.network.padding if n_units else 0),
            n_units,
            n_outputs,
            self.data.roles,
            self.network.units,
            self.network.bias,
            pairs,
            self.terms,
            self.network.substeps if n_units else 1,
        )

    def dense_units(self, order: int, n_units: int) -> int:
        """Return the number of hidden units for which normal equations are solved.

        Up to the limit it is the full number. Above, it is the number for half the limit: from
        there the fit is widened by gradient steps.
        """
        limit, count = self.training.expert.dense_limit, self.shape(order, n_units).n_parameters
        if count <= limit:
            return n_units
        if self.problem.physical is not None:
            raise ValueError(
                f"training.expert.dense_limit = {limit}; expected at least {count}, the "
                f"coefficients of {n_units} hidden units with physical parameters, whose network "
                "cannot be widened: raise it, or choose fewer hidden units (network.hidden) or a "
                "lower parameter_degree"
            )
        while n_units > 1 and self.shape(order, n_units).n_parameters > limit // 2:
            n_units -= 1
        return n_units

    @property
    def terms(self) -> int:
        """The number of terms of physical parameters in every weight; 1 without parameters."""
        physical = self.problem.physical
        return 1 if physical is None else len(physical.basis.degrees)

    @property
    def eigenvalues_known(self) -> bool:
        """Whether the first order follows from known eigenvalues, and is not a guess from data."""
        return self.data.excited is not None

    def first_order(self) -> int:
        """Guess the number of states: from the excited eigenvalues, else from the data."""
        excited = self.data.excited
        if excited is not None:
            return states_of(excited)
        return self._subspace.states_shown

    def highest_order(self) -> int:
        """Return the number of states that the data can show."""
        return self._subspace.highest_order

    def linear(self, order: int) -> Candidate:
        """Fit linear models of an order from all linear starts, and return the best.

        They are fitted to all data, or to the starts' data if there are very many.
        """
        shape, data, fits = self.shape(order, 0), self.data, []
        segments = data.part if data.whole.targets.numel() > MOST_OF_LINEAR else data.whole
        for source, theta in self._linear_starts(shape, segments).items():
            name = f"linear, {order} states, from {source}"
            fits.append(self.run(name, shape, theta, segments, LINEAR_ITERATIONS))
        return min(fits, key=lambda candidate: candidate.error)

    def _linear_starts(self, shape: CellShape, segments: Segments) -> dict[str, torch.Tensor]:
        """Return the parameters to start from, shape (P,), by the name of their origin."""
        order, step, n_drive = shape.n_states, self.problem.window.step, len(shape.roles.drive)
        generator = torch.Generator().manual_seed(self.training.seed)
        given = self.problem.eigenvalues
        known = np.zeros(0, np.complex128) if given is None else given
        like = self.data.features
        if shape.turned:
            sizes = (order, shape.turned, n_drive, shape.n_outputs)
            model = from_turned_pairs(known, step, sizes, generator)
            return {"turned pairs": shape.linear(*model).to(like)}
        starts, lowest = {}, lowest_eigenvalues(known, order)
        if lowest is not None:
            model = from_eigenvalues(lowest, step, (n_drive, shape.n_outputs), generator)
            starts["eigenvalues"] = shape.linear(*model).to(like)
        if order <= self.highest_order() or not starts:
            starts["subspaces"] = self._from_subspace(shape, segments).to(like)
        return starts

    def _from_subspace(self, shape: CellShape, segments: Segments) -> torch.Tensor:
        """Return the parameters of the cell with A and C of the subspace, and the best B and D."""
        a, c = self._subspace.model(shape.n_states)
        b = np.zeros((len(a), len(shape.roles.drive)))
        d = np.zeros((len(c), len(shape.roles.static) + 1))
        if shape.is_plain and has_sections(a):
            radius = self.data.penalty(shape, 1).radius
            fit = self._modal_fit(shape, segments, Sections.of(a, b, c, d, radius))
            return fit.theta(fit.with_best_inputs())
        theta = shape.linear(*pulled_inside(*map(torch.from_numpy, (a, b, c)))).to(
            segments.features
        )
        normal = normal_equations(shape, theta, segments)
        return with_best(theta, shape.of_inputs.to(theta.device), normal)

    def _modal_fit(self, shape: CellShape, segments: Segments, begin: Sections) -> ModalFit:
        penalty = self.data.penalty(shape, segments.targets.numel())
        return ModalFit(shape, segments, begin, penalty, self.data.least_squares(shape, segments))

    def start(self, linear: Candidate, n_units: int, number: int) -> Candidate:
        """Run a random start from a linear model; every second one in whitened coordinates.

        The number of the start, from 0, and the seed determine the random numbers.
        """
        old, order = linear.shape, linear.shape.n_states
        shape = self.shape(order, n_units)
        part, cells = self.data.part, old.cells(linear.state.best)
        _, states = simulate(old, linear.state.best, part.features, part.phi)
        if not shape.turned:  # turning pairs keep their coordinates
            cells = [rescale(old, cell, states, whiten=number % 2 == 1) for cell in cells]
        cells = in_substeps(cells, shape.substeps)
        seed = (self.training.seed * START_STRIDE + number) % 2**32
        theta = widen_all(cells, shape, torch.Generator().manual_seed(seed))
        name = f"start {number}, {order} states, {n_units} units"
        return self.run(name, shape, theta, part, self.training.expert.start_iterations)

    def best_of(self, starts: Sequence[Candidate]) -> Candidate:
        """Run the best starts for more iterations on the same data, and return the best."""
        ranked = sorted(starts, key=lambda start: start.error)
        kept, expert = [], self.training.expert
        for place, start in enumerate(ranked[: expert.kept]):
            name = f"kept {place}, {start.shape.n_states} states, {start.shape.n_units} units"
            kept.append(self._go_on(name, start, self.data.part, expert.kept_iterations))
        return min(kept, key=lambda candidate: candidate.error)

    def judged(self, candidate: Candidate, number: int = 0) -> Candidate:
        """Run the best start of a size as long as the kept ones, on the same data.

        A network that was judged before is run further; ``number`` counts the times. Each time is
        a separate run, so that a resumed fit compares the same errors as an uninterrupted one.
        """
        name = f"judged, {candidate.shape.n_states} states, {candidate.shape.n_units} units"
        name += f", again {number}" if number else ""
        iterations = self.training.expert.kept_iterations
        return self._go_on(name, candidate, self.data.part, iterations, afresh=not number)

    def refine(
        self,
        candidate: Candidate,
        name: str = "refined",
        iterations: int | None = None,
        afresh: bool = True,
    ) -> Candidate:
        """Run a network on the data of this fit, by default for the recipe's iterations.

        Of very many data it is a part of every trajectory.

        If it was fitted to less data before, it begins ``afresh``, from its best weights.
        """
        most = iterations or self.training.iterations
        segments = self.data.for_refinement(candidate.shape)
        return self._go_on(name, candidate, segments, most, afresh)

    def _go_on(
        self,
        name: str,
        candidate: Candidate,
        segments: Segments,
        iterations: int,
        afresh: bool = True,
    ) -> Candidate:
        """Run a network from its best weights, or from the last state of its run."""
        begin = candidate.state.best if afresh else candidate.state
        assert not isinstance(begin, Descent)
        return self.run(name, candidate.shape, begin, segments, iterations)

    def refine_known(self, candidate: Candidate) -> Candidate:
        """Run a known network on all data, and return the best result by validation.

        Measured data have a prior on its weights that becomes weaker. Simulated ones need none,
        and the start is no candidate then: it may lack kinds that are learnt but not validated.
        """
        shape, theta, whole = candidate.shape, candidate.state.best, self.data.whole
        begin = Iterate.begin(theta, self.data.least_squares(shape, whole))
        if self.problem.eigenvalues is not None:  # simulated, without noise
            unproven = Candidate(shape, replace(begin, best_error=math.inf))
            done = self.refine(unproven, afresh=False)
            return done if math.isfinite(done.error) else Candidate(shape, begin)  # no step
        refined = [Candidate(shape, begin)]
        most = max(1, self.training.iterations // len(STRENGTHS))
        for strength in STRENGTHS:
            last, prior = refined[-1].state.theta, Prior.around(shape, theta, strength)
            refined.append(
                self.run(f"refined, prior {strength:g}", shape, last, whole, most, prior)
            )
        return min(refined, key=lambda one: one.error)

    def widened(self, candidate: Candidate, n_units: int) -> Candidate:
        """Give a network more hidden units than normal equations can be solved for, and run it.

        Its first response is that of the smaller network.
        """
        old, training = candidate.shape, self.training
        shape = self.shape(old.n_states - self.network.padding, n_units)
        generator = torch.Generator().manual_seed(training.seed)
        theta = widen_all(old.cells(candidate.state.best), shape, generator)
        validation = self.data.least_squares(shape, self.data.validation).validation
        radius = self.data.penalty(shape, 1).radius

        def advance(state: Descent) -> Descent:
            return preconditioned_descent.advance_round(
                state, shape, self.data.whole, validation, radius, training.seed
            )

        begin, rounds = Descent.begin(theta, validation(theta)), training.expert.refinements
        done = self.ledger.run(f"widened to {n_units}", begin, advance, rounds)
        return Candidate(shape, done)

    def run(
        self,
        name: str,
        shape: CellShape,
        begin: torch.Tensor | Iterate,
        segments: Segments,
        iterations: int,
        prior: Prior | None = None,
    ) -> Candidate:
        """Do a run of Levenberg-Marquardt from parameters, (P,), or from another run's state."""
        theta = begin if isinstance(begin, torch.Tensor) else begin.theta
        if shape.is_plain and prior is None and has_sections(shape.split(theta).a.cpu().numpy()):
            return self._run_sections(name, shape, begin, segments, iterations)
        problem = self.data.least_squares(shape, segments, prior)
        if isinstance(begin, torch.Tensor):
            begin = Iterate.begin(begin, problem)
        step = partial(levenberg_marquardt.advance, problem=problem)
        return Candidate(shape, self.ledger.run(name, begin, step, iterations))

    def _run_sections(
        self,
        name: str,
        shape: CellShape,
        begin: torch.Tensor | Iterate,
        segments: Segments,
        iterations: int,
    ) -> Candidate:
        """Do a run of a plain linear cell by its sections, which have fewer parameters."""
        theta = begin if isinstance(begin, torch.Tensor) else begin.theta
        fit = self._modal_fit(shape, segments, Sections.of_cell(shape, theta))
        problem = fit.least_squares()
        step = partial(levenberg_marquardt.advance, problem=problem)
        done = self.ledger.run(name, Iterate.begin(fit.first, problem), step, iterations)
        last, best = (
            balanced(shape, fit.theta(one), segments).to(theta) for one in (done.theta, done.best)
        )
        return Candidate(shape, replace(done, theta=last, best=best))

    @cached_property
    def _subspace(self) -> Subspace:
        """The subspace of the training trajectories."""
        roles, targets = self.data.roles, self.problem.training[1]
        # what is no state input acts on the outputs at once
        seen = [*roles.drive, *(index for index in roles.static if index not in roles.drive)]
        inputs = self.problem.training[0][:, :, seen].double().cpu().numpy()
        return subspace_of(list(inputs), list(targets[:, 1:].double().cpu().numpy()))
