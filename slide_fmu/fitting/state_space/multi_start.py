"""The runs of a state-space fit are a multi-start with successive halving.

Linear models come first; random starts of the units follow; the best of these candidates go on,
fewer in every round, and the last one is refined on all data. (Successive halving: Jamieson and
Talwalkar, 2016, with rounds of the recipe's own sizes.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.fitting.state_space import levenberg_marquardt, preconditioned_descent
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.coordinates import in_substeps, rescale, widen_all
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.ledger import Ledger
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.linear_start import (
    LinearModel,
    Responses,
    from_eigenvalues,
    from_turned_pairs,
    impulse_responses,
    lowest_eigenvalues,
    realize,
    states_of,
    states_shown,
)
from slide_fmu.fitting.state_space.penalties import STRENGTHS, Prior
from slide_fmu.fitting.state_space.preconditioned_descent import Descent
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.recipe.systems import require_turned_pairs

LINEAR_ITERATIONS = 15
"""A linear model is fitted in at most this many iterations."""
MOST_RESIDUALS = 200_000
"""Linear models are fitted to all data up to this many residuals, else to the starts' data."""
SHORTEST_RESPONSE, LONGEST_RESPONSE = 40, 200
"""A linear model is realized from impulse responses of this many samples at least and at most;
between these limits they are as long as the truncated part of the window."""
START_STRIDE = 1009
"""A seed has this many random starts of its own, so that two seeds share none."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A candidate is a network in the multi-start, and where its run stands.

    Attributes:
        shape: shape of its cell.
        state: the last state of its run, with its best parameters.
    """

    shape: CellShape
    state: Iterate | Descent

    @property
    def error(self) -> float:
        """The candidate's best validation error is an RMS in scaled units."""
        return self.state.best_error

    @property
    def training_error(self) -> float:
        """The candidate's last error on what it learnt from is an RMS in scaled units."""
        rows = self.state.history
        return rows[-1][1] if rows else math.inf


def while_it_pays(
    candidate: Candidate,
    rounds: Sequence[Callable[[Candidate], Candidate]],
    pays: Callable[[Candidate, Candidate], bool],
) -> Candidate:
    """Run a candidate on, round after round, until one hardly helps; return the last one.

    A round pays by the candidates after it and before it. Other searches differ for a reason. That
    for sizes chooses among several larger networks at each step, and may look one step further
    (``sizes``). Kinds of features and of hidden units have no order in size: all are tried, and a
    richer one must be clearly better (``feature_search``, ``unit_choice``). Companions of an error
    bound are equals, of which the first good one is taken. A learning curve says why it ends.
    """
    for go_on in rounds:
        before, candidate = candidate, go_on(candidate)
        if not pays(candidate, before):
            break
    return candidate


class MultiStart:
    """A multi-start does all runs of one fit, each named and stored in the ledger. Final.

    The progress is called after every iteration.

    Attributes:
        data: what the runs work on.
        ledger: has the parts of the fit and their runs.

    Raises:
        TrainingError: the checkpoint cannot be read.
    """

    def __init__(self, data: FitData, progress: Progress) -> None:
        self.data, self.problem = data, data.problem
        self.network, self.training = data.network, data.training
        self.ledger = Ledger(data.problem.checkpoint, data.features.device, progress)

    def shape(self, order: int, n_units: int) -> CellShape:
        """Return the shape of a cell; one with hidden units has states to spare (the padding).

        Raises:
            ValueError: more pairs of states are turned than there are.
        """
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

        It is all of them up to the limit. Beyond it, it is that of half the limit: the fit is
        widened from there by gradient steps.
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
        """Every weight is a sum of this many terms of the physical parameters; 1 without any."""
        physical = self.problem.physical
        return 1 if physical is None else len(physical.basis.degrees)

    @property
    def eigenvalues_known(self) -> bool:
        """Tell whether the first order is that of known eigenvalues, else a guess from data."""
        return self.data.excited is not None

    def first_order(self) -> int:
        """Guess the number of states: from the excited eigenvalues, else the impulse responses."""
        excited = self.data.excited
        if excited is not None:
            return states_of(excited)
        return min(states_shown(self._impulse_responses), self.highest_order())

    def highest_order(self) -> int:
        """Return the number of states that impulse responses of this length can show."""
        return self._impulse_responses.highest_order

    def linear(self, order: int) -> Candidate:
        """Fit linear models of an order from all linear starts, and return the best.

        They are fitted to all data, or to those of the starts where there are very many.

        Raises:
            ValueError: the order is too high for the window, or its turned pairs do not fit.
        """
        shape, data = self.shape(order, 0), self.data
        many = data.whole.targets.numel() > MOST_RESIDUALS
        found = []
        for source, model in self._linear_starts(shape).items():
            theta = shape.linear(*model).to(data.features)
            name = f"linear, {order} states, from {source}"
            segments = data.part if many else data.whole
            found.append(self.run(name, shape, theta, segments, LINEAR_ITERATIONS))
        return min(found, key=lambda candidate: candidate.error)

    def _linear_starts(self, shape: CellShape) -> dict[str, LinearModel]:
        """Return the linear models to start from, by the name of what they come from."""
        order, step, n_drive = shape.n_states, self.problem.window.step, len(shape.roles.drive)
        generator = torch.Generator().manual_seed(self.training.seed)
        unknown = np.zeros(0, np.complex128)
        known = unknown if self.problem.eigenvalues is None else self.problem.eigenvalues
        if shape.turned:
            sizes = (order, shape.turned, n_drive, shape.n_outputs)
            return {"turned pairs": from_turned_pairs(known, step, sizes, generator)}
        starts, lowest = {}, lowest_eigenvalues(known, order)
        if lowest is not None:
            sizes_of = (n_drive, shape.n_outputs)
            starts["eigenvalues"] = from_eigenvalues(lowest, step, sizes_of, generator)
        if order <= self.highest_order() or not starts:
            starts["impulse responses"] = realize(self._impulse_responses, order)
        return starts

    def start(self, linear: Candidate, n_units: int, number: int) -> Candidate:
        """Run a random start from a linear model; every second one in whitened coordinates.

        The number of the start, from 0, fixes the random numbers together with the seed.

        Raises:
            ValueError: the linear model cannot be divided into sub-steps.
        """
        old, order = linear.shape, linear.shape.n_states
        shape = self.shape(order, n_units)
        features = self.data.part.features
        _, states = simulate(old, linear.state.best, features, self.data.part.phi)
        cells = old.cells(linear.state.best)
        if not shape.turned:  # pairs that turn keep their coordinates
            cells = [rescale(old, cell, states, whiten=number % 2 == 1) for cell in cells]
        cells = in_substeps(cells, shape.substeps)
        seed = (self.training.seed * START_STRIDE + number) % 2**32
        theta = widen_all(cells, shape, torch.Generator().manual_seed(seed))
        name = f"start {number}, {order} states, {n_units} units"
        return self.run(name, shape, theta, self.data.part, self.training.expert.start_iterations)

    def best_of(self, starts: Sequence[Candidate]) -> Candidate:
        """Run the best starts some iterations more on the same data, and return the best."""
        ranked = sorted(starts, key=lambda start: start.error)
        kept = []
        for place, start in enumerate(ranked[: self.training.expert.kept]):
            name = f"kept {place}, {start.shape.n_states} states, {start.shape.n_units} units"
            iterations = self.training.expert.kept_iterations
            kept.append(self._go_on(name, start, self.data.part, iterations))
        return min(kept, key=lambda candidate: candidate.error)

    def judged(self, candidate: Candidate, number: int = 0) -> Candidate:
        """Run the best start of a size as long as those that are kept, on the same data.

        A network that was judged before goes on, the ``number``-th time. Each time is a run of its
        own, so that a fit that goes on after it was stopped compares the same errors as one that
        was not.
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
        """Run a network on all data of this fit, by default as long as the recipe says.

        It may have been learnt from fewer data: then it begins ``afresh``, from its best weights.
        """
        most = iterations or self.training.iterations
        return self._go_on(name, candidate, self.data.whole, most, afresh)

    def _go_on(
        self,
        name: str,
        candidate: Candidate,
        segments: Segments,
        iterations: int,
        afresh: bool = True,
    ) -> Candidate:
        """Run a network from its best weights, or from where its run stands."""
        begin = candidate.state.best if afresh else candidate.state
        assert not isinstance(begin, Descent)
        return self.run(name, candidate.shape, begin, segments, iterations)

    def refine_known(self, candidate: Candidate) -> Candidate:
        """Run a known network on all data, held ever less strongly to what it was at first.

        What is best by validation is returned.
        """
        shape, theta = candidate.shape, candidate.state.best
        least_squares = self.data.least_squares(shape, self.data.whole)
        found = [Candidate(shape, Iterate.begin(theta, least_squares))]
        iterations = max(1, self.training.iterations // len(STRENGTHS))
        for strength in STRENGTHS:
            last, name = found[-1].state.theta, f"refined, prior {strength:g}"
            prior = Prior.around(shape, theta, strength)
            found.append(self.run(name, shape, last, self.data.whole, iterations, prior))
        return min(found, key=lambda one: one.error)

    def widened(self, candidate: Candidate, n_units: int) -> Candidate:
        """Give a network more hidden units than normal equations can be solved for, and run it.

        At first it answers as the smaller network does.
        """
        old, training = candidate.shape, self.training
        shape = self.shape(old.n_states - self.network.padding, n_units)
        generator = torch.Generator().manual_seed(training.seed)
        theta = widen_all(old.cells(candidate.state.best), shape, generator)
        validation = self.data.least_squares(shape, self.data.validation).validation
        radius = self.data.penalty(shape, 1).radius

        def stretch(state: Descent) -> Descent:
            return preconditioned_descent.advance_stretch(
                state, shape, self.data.whole, validation, radius, training.seed
            )

        begin = Descent.begin(theta, validation(theta))
        done = self.ledger.run(
            f"widened to {n_units}", begin, stretch, training.expert.refinements
        )
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
        """Do a run of Levenberg-Marquardt from parameters, (P,), or from where another stands."""
        problem = self.data.least_squares(shape, segments, prior)
        if isinstance(begin, torch.Tensor):
            begin = Iterate.begin(begin, problem)
        step = partial(levenberg_marquardt.advance, problem=problem)
        return Candidate(shape, self.ledger.run(name, begin, step, iterations))

    @cached_property
    def _impulse_responses(self) -> Responses:
        """The impulse responses lead from the state input to the outputs.

        A system whose eigenvalues are known has been simulated: its outputs have no noise.
        """
        longest = min(LONGEST_RESPONSE, self.data.features.shape[1] // 2)
        wanted = max(self.problem.window.memory_length, SHORTEST_RESPONSE)
        taps = max(2, min(wanted, longest))
        targets = self.problem.training[1].to(self.data.features)
        roles, features = self.data.roles, self.data.features
        # what drives the states has a response of its own: only the rest is feedthrough
        others = [index for index in roles.static if index not in roles.drive]
        drive, static = features[:, :, list(roles.drive)], features[:, :, others]
        return impulse_responses(drive, static, targets, taps, not self.eigenvalues_known)
