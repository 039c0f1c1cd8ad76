"""A network is fitted from known states: over short spans first, then over longer ones.

A step of the fit then neither leads in from zero state nor goes through the whole memory of the
system, and motions that a long run would leave are learnt nevertheless. First all states count,
later the outputs alone. What selects the weights is the validation from zero state, as of every
network. (Multiple shooting from known values: Bock, 1983; its effect on fits of recurrent
networks: Ribeiro et al., 2020.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import torch

from slide_fmu.fitting.history import SizeTrial
from slide_fmu.fitting.ladder import WORTHWHILE, Ladder
from slide_fmu.fitting.state_space import levenberg_marquardt
from slide_fmu.fitting.state_space.amounts import (
    LATER_SPANS,
    MOST_OF_SPANS,
    MOST_OF_VALIDATION,
    OF_OUTPUTS,
    OF_STATES,
    SAMPLES_PER_PARAMETER,
    SEGMENT,
    SPAN,
)
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.coordinates import random_arguments
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.known_states import KnownStates
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate, LeastSquares
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.fitting.state_space.normal_equations import normal_equations, sum_of_squares
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.sizes import FIRST_UNITS, GOOD, MOST_UNITS
from slide_fmu.memory.decay_figures import finite
from slide_fmu.recipe.learning import StateSpaceRecipe

APART, EXPLAINED = 0.02, 1 / 3
"""Outputs from zero state and from the true state stay apart if they differ by the first number of
their deviation after the burn-in, and those from the true state err by less than the second
fraction of that."""
MOST_APART = 0.5
"""If more than this fraction of the motions stay apart, the network itself does not forget."""


@dataclass(frozen=True, eq=False)
class FromStates:
    """A FromStates is a network that was fitted from known states to its size.

    Attributes:
        candidate: the network, over the shorter spans.
        data: the data of the fit; motions whose response depends on more than their inputs do not
            judge.
        table: the recipe's table of the network, with its sizes.
        tried: all sizes that were judged, in their order.
        explanation: one sentence on why the size pays.
        remark: what the user should know of the motions; None if there is nothing.
    """

    candidate: Candidate
    data: FitData
    table: StateSpaceRecipe
    tried: tuple[SizeTrial, ...]
    explanation: str
    remark: str | None


@final
class FitFromStates:
    """A FitFromStates finds the number of hidden units, and fits a network to known states."""

    def __init__(self, multi_start: MultiStart, known: KnownStates) -> None:
        self._multi_start, self._known, self._data = multi_start, known, multi_start.data
        self._judged: dict[int, Candidate] = {}
        self._tried: list[SizeTrial] = []
        self._remark: str | None = None

    def sized(self) -> FromStates:
        """Return the network of the size in the recipe, or of one that is found."""
        network, hidden, explanation = self._multi_start.network, None, ""
        if network.hidden == "auto":
            ladder = Ladder(
                error=lambda n_units: self._candidate(n_units).error,
                dearer=self._larger,
                worth=WORTHWHILE,
                named=self._named,
                enough=self._enough,
            )
            climb = ladder.climb(FIRST_UNITS)
            hidden, explanation = climb.chosen, climb.explanation
        else:
            hidden = network.hidden
            explanation = f"{self._named(hidden)}: error {self._candidate(hidden).error:.3g}"
        sizes = {"order": self._known.count, "hidden": hidden, "padding": 0, "units": "tanh"}
        table, tried = network.model_copy(update=sizes), tuple(self._tried)
        chosen = self._candidate(hidden)
        return FromStates(chosen, self._data, table, tried, explanation, self._remark)

    def refined(self, found: FromStates) -> Candidate:
        """Return a network that was found, after fits over longer spans."""
        multi_start, candidate = self._multi_start, found.candidate
        iterations = multi_start.training.iterations
        multi_start.ledger.plan(iterations)
        for span in LATER_SPANS[1:]:
            candidate = self._over_outputs(candidate, span, iterations)
        multi_start.ledger.finish()
        return candidate

    def _named(self, n_units: int) -> str:
        return f"{self._known.count} known states with {n_units} hidden units"

    def _larger(self, n_units: int) -> list[int]:
        limit, twice = self._multi_start.training.expert.dense_limit, 2 * n_units
        fits = twice <= MOST_UNITS and self._shape(twice).n_parameters <= limit
        return [twice] if fits else []

    def _enough(self, n_units: int) -> str | None:
        accurate = self._candidate(n_units).error < GOOD
        return "it is accurate enough to be trained on" if accurate else None

    def _shape(self, n_units: int) -> CellShape:
        n_outputs = self._known.training.targets.shape[2]
        return CellShape(self._known.count, n_units, n_outputs, self._data.roles, "tanh")

    def _candidate(self, n_units: int) -> Candidate:
        """Return the network of a number of hidden units; it is fitted first if necessary."""
        if n_units not in self._judged:
            shape = self._shape(n_units)
            self._multi_start.ledger.plan(OF_STATES + OF_OUTPUTS, self._named(n_units))
            theta = self._over_states(shape)
            if not self._judged:
                self._judge_by_windows(shape, theta)
            begin = Candidate(shape, Iterate(theta, theta, math.inf))
            candidate = self._over_outputs(begin, LATER_SPANS[0], OF_OUTPUTS)
            self._judged[n_units] = candidate
            error, parameters = finite(candidate.error), shape.n_parameters
            self._tried.append(SizeTrial(self._known.count, n_units, parameters, error, None))
        return self._judged[n_units]

    def _over_states(self, shape: CellShape) -> torch.Tensor:
        """Fit the map from one sample to the next; return the weights with the map to outputs."""
        known, n_units = self._known, shape.n_units
        own = replace(shape, n_outputs=known.moving, roles=replace(shape.roles, static=()))
        begin = own.split(known.a.new_zeros(own.n_parameters))
        begin.a[:], begin.b[:] = known.a, known.b
        begin.c[:] = torch.eye(known.count)[: known.moving]
        generator = torch.Generator().manual_seed(self._multi_start.training.seed)
        begin.w[:] = random_arguments(begin.w.shape, generator)
        begin.w[:, known.own : known.moving] = 0
        spans, judging = self._spans(own, SPAN, of_states=True)
        problem = LeastSquares(
            lambda theta: normal_equations(own, theta, spans),
            lambda theta: sum_of_squares(own, theta, spans),
            spans.counted,
            lambda theta: math.sqrt(sum_of_squares(own, theta, judging) / judging.counted),
        )
        free = self._free(own)
        free = free[free < own.n_dynamic]  # the states are what they are
        name = f"states, {n_units} units"
        theta = self._run(name, own.join(begin), problem, free, OF_STATES).best
        return shape.join(replace(own.split(theta), c=known.c, d=known.d, d0=known.d0))

    def _over_outputs(self, candidate: Candidate, span: int, iterations: int) -> Candidate:
        """Fit outputs over spans from known states; validation from zero state selects."""
        shape = candidate.shape
        spans, _ = self._spans(shape, span, of_states=False)
        name = f"outputs over {span} samples, {shape.n_units} units"
        problem = self._data.least_squares(shape, spans)
        theta, free = candidate.state.best, self._free(shape)
        return Candidate(shape, self._run(name, theta, problem, free, iterations))

    def _run(
        self,
        name: str,
        theta: torch.Tensor,
        problem: LeastSquares,
        free: torch.Tensor,
        iterations: int,
    ) -> Iterate:
        """Do a run from weights, of which those with the numbers ``free`` are fitted."""
        some = problem.restricted(theta, free)
        step = partial(levenberg_marquardt.advance, problem=some)
        begin = Iterate.begin(theta[free], some)
        done = self._multi_start.ledger.run(name, begin, step, iterations)
        last, best = (theta.index_copy(0, free, part) for part in (done.theta, done.best))
        return replace(done, theta=last, best=best)

    def _free(self, shape: CellShape) -> torch.Tensor:
        """Return the numbers of the weights that are fitted.

        An output that is a state acts on no state: it only shows the others. Else the network
        would be free to move where no system does, beside its motions.
        """
        known = self._known
        free = shape.split(known.a.new_ones(shape.n_parameters))
        for weights in (free.a, free.w):
            weights[:, known.own : known.moving] = 0
        return torch.nonzero(shape.join(free))[:, 0]

    def _spans(self, shape: CellShape, length: int, of_states: bool) -> tuple[Segments, Segments]:
        """Return spans to learn from, and others to judge by."""
        seed, known = self._multi_start.training.seed, self._known
        samples = min(SAMPLES_PER_PARAMETER * shape.n_parameters, MOST_OF_SPANS)
        count = max(64, math.ceil(samples / length))
        parts = []
        for part, some in ((known.training, count), (known.validation, max(64, count // 4))):
            targets = part.states[..., : known.moving] if of_states else part.targets
            parts.append(part.spans(targets, length, some, seed + length))
        return parts[0], parts[1]

    def _judge_by_windows(self, shape: CellShape, theta: torch.Tensor) -> None:
        """Judge by windows of the validation whose outputs follow from their inputs alone.

        A spring with play or one that hardens may have two steady motions under one lasting tone.
        From its true state a good network goes on in the right one, and from zero state perhaps
        in the other one: then no network can be right.
        """
        known, window = self._known.validation, self._data.problem.window
        motions, burn_in = len(known.features), window.n_truncated
        each = MOST_OF_VALIDATION // (motions * known.targets.shape[2])
        scored = max(SEGMENT, min(each, max(SEGMENT, burn_in)))
        judging = known.windows(burn_in, scored, motions)
        outputs = [
            simulate(shape, theta, judging.features, None, initial)[0][judging.burn_in :]
            for initial in (judging.initial, None)
        ]
        error, differs = (
            (one - outputs[0]).square().mean((0, 2)).sqrt()
            for one in (judging.targets, outputs[1])
        )
        apart = (differs > APART) & (error < EXPLAINED * differs)
        number, count = int(apart.sum()), judging.count
        judging = replace(judging, initial=None)
        if 0 < number <= MOST_APART * count:
            judging = judging.chosen(torch.nonzero(~apart)[:, 0])
            self._remark = (
                f"in {number} of {count} motions of the validation the outputs depend on more "
                "than the inputs of a window: the model has several lasting motions under the "
                "same inputs, and the FMU may follow another one. These motions did not select "
                "its weights"
            )
        self._data = replace(self._data, validation=judging)
