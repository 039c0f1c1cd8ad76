"""A search finds sizes: more states or hidden units, while they pay and there is more to learn.

It begins at the order given by eigenvalues, if they are known. Otherwise a subspace of the data
gives a first guess, which is lowered to the fewest states with which a linear model is as good.

A step to a larger network is worthwhile if its validation error falls to ``WORTHWHILE``, at equal
effort on equal data. The validation error of measured records is the median over blocks that are
spread over them. If no single step is, the search looks one step further, as long as the
residual can still be predicted from the inputs: a few hidden units may gain little alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import final

import numpy as np

from slide_fmu.fitting.history import SizeTrial
from slide_fmu.fitting.ladder import (
    WORTHWHILE,
    Ladder,
    cheapest_as_good,
    fewest_by_halving,
    pays,
    run_while_it_pays,
)
from slide_fmu.fitting.state_space.amounts import (
    LINEAR_ITERATIONS,
    MANY_STATES,
    MORE_SHOWN,
    halving_orders,
)
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.fitting.state_space.residual import (
    PART,
    learnable_share,
    noise_in,
    without_noise,
)
from slide_fmu.memory.decay_figures import finite

SEARCH_STARTS = 3
"""Number of random starts that judge a size; the best one is run further."""
MOST_ROUNDS = 3
"""Largest number of further rounds of this start."""
FIRST_UNITS, MOST_UNITS = 16, 64
"""The search tries 0 hidden units, then the first number, then doubles it up to the second."""
MORE_STATES = 8
"""Largest number of states tried beyond the first guess."""
NEGLIGIBLE = 1e-3
"""A good linear network is enough if less than this can be learnt, relative to the outputs'
deviation. A linear network that is not good is not enough: hidden units may predict what only
seems unpredictable."""
UNFINISHED, POOR = 3e-3, 1e-2
"""If more than the first could still be learnt, the search looks one step further; if more than
the second at the end, the user gets a remark."""

AS_GOOD = 1.01
"""A linear model of few states is as good as one of more if its error is at most this multiple.
Most of a linear model's error may be what hidden units will learn: a small increase of the whole
error is a large increase of the rest."""
USED = 0.98
"""Hidden units use additional states if the error falls below this fraction, after all iterations:
short runs do not show it. Linear models do not show such states, since most of their error is
learnt by hidden units only."""
GOOD = 5e-3
"""A network with an error below this, relative to the outputs' deviation, is not enlarged: the fit
on all data follows, and usually halves the error. Validation and training error are both checked:
if only the validation error is larger, more data are needed, not more parameters, and the search
uses a part of the data."""
BESIDE_NOISE = 0.15
"""With noise, a network is good if its own error is below this fraction of the noise: it raises
the whole error by one per cent."""
ACCURATE = 1e-3
"""It is also good below this, relative to the outputs' deviation, for any noise."""
FITTED = 0.3
"""A network is large enough if this fraction of the noise remains in its training error in
addition to the noise: a larger one would learn the noise. The fit on all data reduces the rest."""

Place = tuple[int, int]
"""A size, by its positions among the orders and among the numbers of hidden units."""
STATES, HIDDEN_UNITS = (1, 0), (0, 1)
"""A step to more states, and a step to more hidden units."""


@dataclass(frozen=True, eq=False)
class SizeChoice:
    """A SizeChoice is the size that the search has chosen.

    Attributes:
        order: number of states that carry the response.
        n_units: number of hidden units.
        judged: the network of this size after its runs in the search; None without a search.
        larger: a network of more states that is worth the same effort, since the order is a guess
            from linear models; None if the order is known.
        tried: all sizes that were judged, in their order.
        explanations: one sentence for each climb of the search, on why the size pays.
    """

    order: int
    n_units: int
    judged: Candidate | None = None
    larger: Candidate | None = None
    tried: tuple[SizeTrial, ...] = ()
    explanations: tuple[str, ...] = ()


def choose_sizes(multi_start: MultiStart) -> SizeChoice:
    """Return order and number of hidden units from the recipe, or from a search."""
    order, n_units = multi_start.network.order, multi_start.network.hidden
    if order != "auto" and n_units != "auto":
        return SizeChoice(order, n_units)
    search = _Search(multi_start, orders_to_try(multi_start), _numbers_of_units(n_units))
    place = (0, 0)
    if n_units != "auto" or not multi_start.eigenvalues_known:
        # if the order is known, more states of a linear model only imitate hidden units
        place = search.climb(place, [STATES])
    if n_units == "auto":
        place = search.climb(place, [STATES, HIDDEN_UNITS])
    larger = None
    if order == "auto" and not multi_start.eigenvalues_known:
        larger = search.with_more_states(place)
    return search.chosen(place, larger)


def orders_to_try(multi_start: MultiStart) -> list[int]:
    """Return the orders to try: by two, since an oscillation has two states."""
    order = multi_start.network.order
    if isinstance(order, int):
        return [order]
    first = multi_start.first_order()
    if not multi_start.eigenvalues_known:
        first = _fewest_states(multi_start, first)
    last = min(first + MORE_STATES, max(first, multi_start.highest_order()))
    return list(range(first, last + 1, 2))


def _fewest_states(multi_start: MultiStart, shown: int) -> int:
    """Return the lowest order whose linear model is as good as one of more states than shown.

    Low orders are tried first: they cost least, and their fits converge best. Of many, halves of
    the range are left out: the time of a fit grows with the square of the order.
    """
    most = min(shown + MORE_SHOWN, max(shown, multi_start.highest_order()))
    tried = len(halving_orders(most)) + 1 if shown > MANY_STATES else most + 1
    multi_start.ledger.plan(2 * LINEAR_ITERATIONS * tried, "number of states")
    error = cache(lambda order: multi_start.linear(order).error)
    wanted = AS_GOOD * min(error(order) for order in (shown, most))
    if shown > MANY_STATES:
        fewest = fewest_by_halving(shown if error(shown) <= wanted else most, error, wanted)
    else:
        fewest = cheapest_as_good(range(1, most + 1), error, wanted)
    return shown if fewest is None else fewest


def _numbers_of_units(n_units: int | str) -> list[int]:
    if isinstance(n_units, int):
        return [n_units]
    numbers = [0, FIRST_UNITS]
    while numbers[-1] < MOST_UNITS:
        numbers.append(2 * numbers[-1])
    return numbers


@final
class _Search:
    """A search judges sizes, each once, and climbs from size to size."""

    def __init__(self, multi_start: MultiStart, orders: list[int], units: list[int]) -> None:
        self._multi_start, self._orders, self._units = multi_start, orders, units
        self._data = multi_start.data
        self._samples = self._data.part.targets.numel()
        self._judged: dict[Place, Candidate] = {}
        self._blocks: dict[Place, tuple[float, ...]] = {}
        self._learnable: dict[Place, float] = {}
        self._noise = 0.0
        self.explanations: list[str] = []

    def climb(self, place: Place, steps: Sequence[Place]) -> Place:
        """Go to larger sizes by the given kinds of steps, while one of them is worthwhile."""
        ladder = Ladder(
            error=self._error,
            dearer=lambda place: self._beyond(place, steps),
            worth=WORTHWHILE,
            named=self._named,
            enough=self._enough,
            # a few hidden units may gain little alone
            ahead=lambda place: int(self._learnable_at(place) >= UNFINISHED),
        )
        climb = ladder.climb(place)
        if climb.explanation not in self.explanations:
            self.explanations.append(climb.explanation)
        return climb.chosen

    def with_more_states(self, place: Place) -> Candidate | None:
        """Return the network of more states than at a place, for hidden units to use.

        There is none for a linear network, whose states were counted by the guess of the order,
        and none if a network leaves hardly more than noise.
        """
        linear = self._units[place[1]] == 0
        if linear or _leaves_noise_alone(self._candidate(place), self._noise, self._samples):
            return None
        larger = self._beyond(place, [STATES])
        return self._candidate(larger[0]) if larger else None

    def chosen(self, place: Place, larger: Candidate | None) -> SizeChoice:
        """Return the size at a place, with all sizes that were tried."""
        tried = tuple(self._tried(place) for place in self._judged)
        order, n_units = self._orders[place[0]], self._units[place[1]]
        explanations = tuple(self.explanations)
        return SizeChoice(order, n_units, self._judged[place], larger, tried, explanations)

    def _beyond(self, place: Place, steps: Sequence[Place]) -> list[Place]:
        """Return the places one step beyond, within the limits of the search."""
        beyond = [(place[0] + states, place[1] + more) for states, more in steps]
        return [(i, j) for i, j in beyond if i < len(self._orders) and j < len(self._units)]

    def _named(self, place: Place) -> str:
        return f"{self._orders[place[0]]} states with {self._units[place[1]]} hidden units"

    def _enough(self, place: Place) -> str | None:
        """Return the reason why nothing larger than a place is needed, or None."""
        if self._linear_suffices(place):
            return "what it misses cannot be predicted from the inputs"
        return "it is accurate enough to be trained on all data" if self._is_good(place) else None

    def _candidate(self, place: Place) -> Candidate:
        """Return the network of a size; it is judged first if necessary."""
        if place not in self._judged:
            order, n_units = self._orders[place[0]], self._units[place[1]]
            candidate = judge(self._multi_start, order, n_units)
            noise = noise_in(candidate, self._data.validation)
            if noise:  # the lowest level is nearest to white noise
                self._noise = min(noise, self._noise or noise)
            self._judged[place] = candidate
            self._blocks[place] = _errors_of_blocks(self._data, candidate)
        return self._judged[place]

    def _error(self, place: Place) -> float:
        """Return the validation error of a size, without the noise found so far."""
        self._candidate(place)
        return without_noise(float(np.median(self._blocks[place])), self._noise)

    def _is_good(self, place: Place) -> bool:
        """Return whether the network has hidden units, and is accurate enough for the search."""
        if self._units[place[1]] == 0:
            return False
        return _good(self._candidate(place), self._noise, self._samples)

    def _linear_suffices(self, place: Place) -> bool:
        """Return whether the network is linear and good, and its residual cannot be predicted."""
        good = self._units[place[1]] == 0 and self._error(place) < GOOD
        return good and self._learnable_at(place) < NEGLIGIBLE

    def _learnable_at(self, place: Place) -> float:
        """Return the predictable part of a size's error; infinite if it is unstable."""
        if place not in self._learnable:
            stable = math.isfinite(self._error(place))
            learnable = still_learnable(self._data, self._judged[place]) if stable else math.inf
            self._learnable[place] = learnable
        return self._learnable[place]

    def _tried(self, place: Place) -> SizeTrial:
        candidate, learnable = self._judged[place], self._learnable.get(place, math.inf)
        blocks = self._blocks[place]
        several = len(blocks) > 1
        return SizeTrial(
            self._orders[place[0]],
            candidate.shape.n_units,
            candidate.shape.n_parameters,
            finite(float(np.median(blocks))),
            finite(learnable),
            finite(min(blocks)) if several else None,
            finite(max(blocks)) if several else None,
        )


def _errors_of_blocks(data: FitData, candidate: Candidate) -> tuple[float, ...]:
    """Return the validation error of a network by blocks; infinite if it is unstable."""
    if not data.problem.measured or not math.isfinite(candidate.error):
        return (candidate.error,)
    return data.errors_of_blocks(candidate.shape, candidate.state.best)


def _good(candidate: Candidate, noise: float, samples: int) -> bool:
    """Return whether a network, fitted to ``samples`` samples, need not be larger."""
    if not noise:
        return min(candidate.error, candidate.training_error) < GOOD
    own = without_noise(candidate.error, noise)
    # if an error is far below the noise, the training has no such noise
    known = candidate.training_error < min(GOOD, PART * noise)
    accurate = own < max(ACCURATE, min(GOOD, BESIDE_NOISE * noise))
    return known or accurate or _leaves_noise_alone(candidate, noise, samples)


def _leaves_noise_alone(candidate: Candidate, noise: float, samples: int) -> bool:
    """Return whether a network leaves hardly more than the noise of its training samples.

    Its parameters have learnt some of the noise, so the training error lacks it.
    """
    free = samples - candidate.shape.n_parameters
    if not noise or free <= 0:
        return False
    left = without_noise(candidate.training_error * math.sqrt(samples / free), noise)
    return left < min(GOOD, FITTED * noise)


def judge(multi_start: MultiStart, order: int, n_units: int) -> Candidate:
    """Return a network of a size after a few short runs, of which the best was longer.

    It is run further while that pays as much as a larger network would have to: iterations are
    cheaper.
    """
    training, linear_ones = multi_start.training, 2 * LINEAR_ITERATIONS
    if n_units == 0:
        multi_start.ledger.plan(linear_ones, f"{order} states")
        return multi_start.linear(order)
    rounds = training.search_iterations(SEARCH_STARTS, MOST_ROUNDS)
    multi_start.ledger.plan(linear_ones + rounds, f"{order} states and {n_units} units")
    linear, n_units = multi_start.linear(order), multi_start.dense_units(order, n_units)
    starts = [multi_start.start(linear, n_units, number) for number in range(SEARCH_STARTS)]
    best = min(starts, key=lambda start: start.error)
    judged = multi_start.judged(best)
    if _is_accurate(multi_start, judged):
        return judged
    further = [partial(multi_start.judged, number=number) for number in range(1, MOST_ROUNDS)]
    return run_while_it_pays(judged, further, partial(_pays, multi_start))


def _is_accurate(multi_start: MultiStart, candidate: Candidate) -> bool:
    """Return whether a network is good, by the noise that it shows itself."""
    noise = noise_in(candidate, multi_start.data.validation)
    return _good(candidate, noise, multi_start.data.part.targets.numel())


def _pays(multi_start: MultiStart, after: Candidate, before: Candidate) -> bool:
    """Return whether a round helped as much as more hidden units must, and more is needed."""
    noise = noise_in(before, multi_start.data.validation)
    error, former = (without_noise(one.error, noise) for one in (after, before))
    return pays(error, former, WORTHWHILE) and not _is_accurate(multi_start, after)


def still_learnable(data: FitData, candidate: Candidate) -> float:
    """Return the part of a network's validation error that can be predicted from the inputs."""
    both = data.part, data.validation
    share = learnable_share(candidate.shape, candidate.state.best, both)
    return candidate.error * math.sqrt(share)
