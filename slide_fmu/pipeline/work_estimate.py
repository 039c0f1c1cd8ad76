"""The computing time of a run is estimated before it begins, from counted work.

Trajectories are counted and cost what a simulation takes; iterations are counted and cost what
their sums take. Searches may end early or late: they have a least and a largest time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import final

from slide_fmu.fitting.state_space.amounts import (
    FORGOTTEN_BY_STARTS,
    LINEAR_ITERATIONS,
    LONG_BURN_IN,
    MANY_STATES,
    MORE_SHOWN,
    MOST_OF_LINEAR,
    MOST_OF_SPANS,
    MOST_OF_STARTS,
    OF_OUTPUTS,
    OF_STATES,
    PER_PARAMETER,
    SAMPLES_PER_PARAMETER,
    SEGMENT,
    SPAN,
    THINNEST,
    halving_orders,
)
from slide_fmu.pipeline.numbers import (
    FIRST,
    MOST,
    VALIDATION,
    numbers_of_bound,
    without_curve,
)
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe
from slide_fmu.recipe.recipe import OF_BOUND, SPLITS, Recipe

WINDOW, CURVE, DATA, TRAINING = "window", "learning curve", "trajectories", "training"
COMPANION, ESTIMATE, HEAD, MEASURING = "companion", "error estimate", "error bound", "measuring"
ORDER = WINDOW, CURVE, DATA, TRAINING, ESTIMATE, COMPANION, HEAD, MEASURING
"""The stages of a run in their order; a recipe may lack some."""

OPERATIONS = 1e10
"""Floating point operations of a core in a second, in the sums of an iteration: on 54 to 320
segments of 1152 samples, a network with 5 states and 16 hidden units reached 1.0e10 to 1.2e10."""
OF_SIGNAL = 2e-8
"""Time in s of a sample of a signal that a section of a linear model filters."""
OF_SAMPLE = 1.5e-4
"""Time in s of a sample in an iteration, however few segments there are: calls of torch."""
STATES, UNITS = 6, 16
SIZES = UNITS, 2 * UNITS
"""Numbers of states and hidden units that are assumed where a search finds them. It tries more
units, too, where these do not suffice, which is rare."""
SEARCHED, ROUNDS = 3, 2
"""Random starts that judge a size, and rounds after them; a third round is rare."""
ENDS_EARLY = 0.4
"""Part of the iterations after which a fit may have ended, since nothing changes any more."""
STEP_OF_HEAD = 2e-3
"""Time of a step of the head of a bound, or of another small network, in s."""
FURTHER, CONSTANT = 16, 12
"""Number of further kinds of input, which have as many motions as a kind in range: one of smooth
inputs, ten cells of tones, and about five as users set them. Then come constant inputs."""
OF_SIMULATION, STEP_OF_FMU, CALLS, WRITING = 2.5, 3e-6, 6, 5.0
"""Measuring simulates all motions this many times, since some go by finer steps, and runs the FMU
in this number of calls; documents and FMU take WRITING s."""


@final
@dataclass(frozen=True)
class Span:
    """A Span is a time in s between a least and a largest one."""

    low: float = 0.0
    high: float = 0.0

    def __add__(self, other: Span) -> Span:
        return Span(self.low + other.low, self.high + other.high)

    def times(self, factor: float) -> Span:
        """Return the span of a multiple of its times."""
        return Span(self.low * factor, self.high * factor)


def estimated_work(
    recipe: Recipe,
    open_keys: Collection[str],
    cost: float,
    n_signals: tuple[int, int],
    states: int | None = None,
    known_states: int | None = None,
) -> dict[str, Span]:
    """Return the computing time of each stage of a run in s.

    Args:
        recipe: the recipe; its numbers may still be first guesses.
        open_keys: keys that are still to be found.
        cost: time in s in which one process simulates a second.
        n_signals: numbers of inputs and outputs.
        states: number of states that a linear fit of records has; None of a model.
        known_states: number of states that the system shows and the fit begins at; None if it
            finds its own.
    """
    of_simulated = cost * (recipe.data.duration + recipe.data.burn_in)
    is_open, known = "data.train" in open_keys and states is None, recipe.data.train
    given = without_curve(of_simulated, known_states) if is_open else known
    known, found = given or known, given is None
    train = Span(FIRST, MOST) if found else Span(known, known)
    fits = _Fits(recipe, *n_signals, states, known_states)
    work = {
        WINDOW: Span(),
        DATA: _numbers(recipe, open_keys, train, of_simulated).times(of_simulated),
    }
    if found:
        work[CURVE] = Span(*(sum(curve_points(recipe, fits, of_simulated)[:n]) for n in (1, None)))
    work[TRAINING] = Span(fits.surrogate(train.low, True), fits.surrogate(train.high, False))
    if recipe.estimator is not None:
        steps = getattr(recipe.estimator.training, "steps", 0)
        work[ESTIMATE] = Span(STEP_OF_HEAD * steps, 3 * STEP_OF_HEAD * steps)
    if recipe.bound is not None:
        work[COMPANION] = Span(fits.companion(train.low, True), fits.companion(train.high, False))
        work[HEAD] = Span(*(STEP_OF_HEAD * recipe.bound.expert.steps,) * 2)
    work[MEASURING] = _measuring(recipe, cost)
    return work


def curve_points(recipe: Recipe, fits: _Fits, of_simulated: float) -> list[float]:
    """Return the time of each point of a learning curve in s, data and fit.

    A trajectory takes ``of_simulated`` s.
    """
    points, made = [], 0
    for number in range(1 + round(math.log2(MOST / FIRST))):
        train = FIRST * 2**number
        new = train + VALIDATION - made
        made = train + VALIDATION
        points.append(new * of_simulated + (30 if number == 0 else 10) * fits.iteration(train))
    return points


def _numbers(recipe: Recipe, open_keys: Collection[str], train: Span, cost: float) -> Span:
    """Return how many trajectories a run makes, of which each takes ``cost`` s."""
    known = Span(*(sum(recipe.count(s) for s in SPLITS if s not in OF_BOUND),) * 2)
    if "data.train" in open_keys:
        known = train.times(1.25)
    if recipe.bound is None:
        return known
    if "data.bound" not in open_keys:
        return known + Span(*(sum(recipe.count(split) for split in OF_BOUND),) * 2)
    kinds = len(recipe.mix())
    ends = []
    for count in (train.low, train.high):
        companion, head, calibration = numbers_of_bound(round(count), cost, kinds)
        own = 0 if companion == "train" else int(companion)
        ends.append(own + 1.5 * head + calibration)
    return known + Span(*ends)


def _measuring(recipe: Recipe, cost: float) -> Span:
    each_takes = cost * (recipe.data.duration + recipe.data.burn_in)
    further = FURTHER * recipe.unseen_of_kind(None, each_takes) + CONSTANT
    simulated = (recipe.unseen(None, each_takes) + further) * (
        recipe.measured_duration() + recipe.data.burn_in
    )
    steps = simulated / recipe.window.step
    time = OF_SIMULATION * cost * simulated + CALLS * STEP_OF_FMU * steps + WRITING
    return Span(time / 1.5, 1.5 * time)


@final
@dataclass(frozen=True)
class _Pieces:
    """Pieces are what an iteration runs on: samples of a burn-in and scored ones of segments."""

    burn_in: int
    scored: int
    count: float

    def of_residuals(self, residuals: float, n_outputs: int, kept: float = 1.0) -> _Pieces:
        """Return pieces with fewer residuals, with a part of the burn-in (``fit_data``)."""
        burn_in, scored = self.burn_in, self.scored
        if burn_in > LONG_BURN_IN:
            burn_in = math.ceil(kept * burn_in)
            scored = max(SEGMENT, burn_in // 4)
        return _Pieces(burn_in, scored, max(1.0, residuals / (scored * n_outputs)))


@final
@dataclass(frozen=True)
class _Fits:
    """The fits of a recipe's networks, of which each iteration has a time."""

    recipe: Recipe
    n_inputs: int
    n_outputs: int
    states: int | None = None
    known_states: int | None = None

    def iteration(
        self,
        train: float,
        units: int | None = None,
        start: bool = False,
        linear: int | None = None,
    ) -> float:
        """Return the time in s of an iteration of a network on a number of trajectories.

        Starts are fitted to a part of them; ``linear`` is the number of states of a linear model,
        which is fitted by sections of two states.
        """
        network, window = self.recipe.network, self.recipe.window
        training = self.recipe.training
        if not isinstance(network, StateSpaceRecipe):
            return 0.0
        assert isinstance(training, LeastSquaresRecipe)
        known = self.states or STATES
        order = known if network.order == "auto" else network.order + network.padding
        hidden = (units or UNITS) if network.hidden == "auto" else network.hidden
        burn_in = window.n_in - window.n_out
        samples = round(self.recipe.data.duration / window.step)
        pieces = max(1, round((samples - burn_in) / max(SEGMENT, burn_in)))
        whole = _Pieces(burn_in, (samples - burn_in) // pieces, train * pieces)
        residuals = whole.count * whole.scored * self.n_outputs
        dynamic = order * (order + self.n_inputs + hidden) + hidden * (order + self.n_inputs + 1)
        weights = dynamic + self.n_outputs * (order + self.n_inputs + 1)
        if start:
            most = min(residuals / training.expert.part, MOST_OF_STARTS)
            whole = whole.of_residuals(most, self.n_outputs, FORGOTTEN_BY_STARTS)
        elif residuals >= 2 * PER_PARAMETER * weights:  # of very many data, some
            whole = whole.of_residuals(PER_PARAMETER * weights, self.n_outputs)
        length = whole.burn_in + whole.scored
        if linear is not None:
            signals = (linear + 1) // 2 * (2 * self.n_inputs + 4) + self.n_inputs + 1
            sums = 2 * signals**2 * whole.scored / OPERATIONS
            return length * OF_SAMPLE + whole.count * (OF_SIGNAL * length * signals + sums)
        run = 2 * order * order * dynamic * network.substeps * length
        summed = self.n_outputs * (weights * weights / THINNEST + order * dynamic) * whole.scored
        return length * OF_SAMPLE + whole.count * (run + summed) / OPERATIONS

    def surrogate(self, train: float, least: bool) -> float:
        """Return the least or the largest time in s of the surrogate's fit, with its search.

        A network of given sizes has no search. A record of a linear machine takes the least time.
        """
        training, network = self.recipe.training, self.recipe.network
        if not isinstance(training, LeastSquaresRecipe):
            return STEP_OF_HEAD * training.steps
        assert isinstance(network, StateSpaceRecipe)
        if least and self.states is not None and network.hidden == "auto":
            # a linear machine needs no hidden units
            refined = ENDS_EARLY * training.iterations * self.iteration(train, linear=self.states)
            return refined + self._states_found(train, least)
        if self.known_states is not None:
            return self._from_states(training.iterations, least)
        last = self._last(training, train, least) + self._states_found(train, least)
        if network.hidden != "auto" and network.order != "auto":
            starts = training.search_iterations(training.starts, training.expert.kept)
            return last + starts * self.iteration(train, start=True)
        runs = training.search_iterations(SEARCHED, 1 if least else ROUNDS)
        sizes = [UNITS] if least or network.hidden != "auto" else SIZES
        return last + sum(runs * self.iteration(train, size, start=True) for size in sizes)

    def _states_found(self, train: float, least: bool) -> float:
        """Return the time in s of the linear models that tell the number of states of records."""
        network = self.recipe.network
        assert isinstance(network, StateSpaceRecipe)
        if self.states is None or network.order != "auto":
            return 0.0
        most = self.states if least else self.states + MORE_SHOWN
        orders = [most, *halving_orders(most)] if self.states > MANY_STATES else range(1, most + 1)
        ends = ENDS_EARLY if least else 1.0
        lead = self.recipe.window.n_in - self.recipe.window.n_out
        scored = round(self.recipe.data.duration / self.recipe.window.step) - lead
        few = train * scored * self.n_outputs > MOST_OF_LINEAR
        each = [self.iteration(train, start=few, linear=order) for order in orders]
        return ends * LINEAR_ITERATIONS * sum(each)

    def companion(self, train: float, least: bool) -> float:
        """Return the least or the largest time in s of a companion, whose sizes are known."""
        training, bound = self.recipe.training, self.recipe.bound
        if bound is None or not isinstance(training, LeastSquaresRecipe):
            return 0.0
        own = bound.expert.companion.of_training(training, 0)
        if self.known_states is not None:
            return self._from_states(own.iterations, least)
        starts = own.search_iterations(own.starts, min(own.starts, own.expert.kept))
        units = SIZES[0 if least else -1]
        of_starts = starts * self.iteration(train, units, start=True)
        return of_starts + self._last(own, train, least)

    def _from_states(self, iterations: int, least: bool) -> float:
        """Return the time in s of a fit that begins at known states, of 16 units or also of 32."""
        sizes = SIZES[:1] if least else SIZES
        count = OF_STATES + OF_OUTPUTS + iterations
        ends = ENDS_EARLY if least else 1.0
        return ends * count * sum(self._of_spans(units) for units in sizes)

    def _of_spans(self, units: int) -> float:
        """Return the time in s of an iteration over spans from known states, with its judging."""
        window, order = self.recipe.window, (self.known_states or 0) + self.n_inputs
        dynamic = order * (order + self.n_inputs + units) + units * (order + self.n_inputs + 1)
        weights = dynamic + self.n_outputs * (order + self.n_inputs + 1)
        samples = min(SAMPLES_PER_PARAMETER * weights, MOST_OF_SPANS)
        rows = max(order, self.n_outputs)
        summed = rows * (weights * weights / THINNEST + order * dynamic)
        run = 2 * order * order * dynamic
        judged = 2 * window.n_in - window.n_out
        return samples * (run + summed) / OPERATIONS + (judged + SPAN) * OF_SAMPLE

    def _last(self, training: LeastSquaresRecipe, train: float, least: bool) -> float:
        """Return the time in s of the last run of a fit, on all data."""
        if least:
            return ENDS_EARLY * training.iterations * self.iteration(train, SIZES[0])
        return training.iterations * self.iteration(train, SIZES[-1])


CPU_MINUTES = "CPU-minutes"
"""What computing times are counted in; those of hours are in CPU-hours."""


def in_words(time: Span | Mapping[str, Span], what: str = "") -> str:
    """Write a time, as ``about 3 to 9 min``, or ``about 3 CPU-minutes``; ``what`` is the latter.

    A largest time of less than twice the least one is no range.
    """
    whole = time if isinstance(time, Span) else sum(time.values(), Span())
    if whole.high < 2 * whole.low:
        both = [math.sqrt(max(whole.low, 0.5) * max(whole.high, 0.5))]
    else:
        both = [whole.low, whole.high]
    longest = both[-1]
    unit, size = ("h", 3600.0) if longest >= 5400 else ("min", 60.0)
    if longest < 90 and not what:
        unit, size = "s", 1.0
    numbers = [_rounded(one / size, unit) for one in both]
    if what == CPU_MINUTES and unit == "h":
        what = "CPU-hours"
    return f"about {' to '.join(dict.fromkeys(numbers))} {what or unit}"


def _rounded(value: float, unit: str) -> str:
    if unit == "s":
        return str(max(5, 5 * round(value / 5)))
    return f"{value:.1f}".removesuffix(".0") if value < 2 or unit == "h" else str(round(value))
