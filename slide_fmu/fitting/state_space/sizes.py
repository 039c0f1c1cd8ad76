"""A search finds sizes: more states or hidden units, while they pay and there is more to learn.

It begins at the order that eigenvalues tell, if they are known. Else impulse responses show one,
which is a guess: it falls to the fewest states with which a linear model does as well.

A step to a larger network counts as worthwhile when its validation error falls to ``WORTHWHILE``,
at equal effort on equal data. Where no single step is, the search looks one step further, as long
as the residual can still be predicted from the inputs: a few hidden units may gain little alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from slide_fmu.fitting.history import TriedSize
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.multi_start import (
    LINEAR_ITERATIONS,
    Candidate,
    MultiStart,
    while_it_pays,
)
from slide_fmu.fitting.state_space.residual import (
    PART,
    learnable_share,
    noise_in,
    without_noise,
)
from slide_fmu.memory.decay_figures import finite

SEARCH_STARTS = 3
"""A size is judged by this many random starts, of which the best goes on."""
MOST_ROUNDS = 3
"""That one is run on in at most so many rounds."""
WORTHWHILE = 0.8
"""A larger network is chosen when its error is below this part of the smaller one's."""
FIRST_UNITS, MOST_UNITS = 16, 64
"""The search tries 0 hidden units, then the first number, then doubles it up to the second."""
MORE_STATES = 8
"""At most this many states are tried beyond the first guess."""
NEGLIGIBLE = 1e-3
"""A linear network that is good suffices where less can be learnt, relative to the outputs'
deviation. One that is not good does not: hidden units may predict what merely looks
unpredictable."""
UNFINISHED, POOR = 3e-3, 1e-2
"""Where more than the first could still be learnt, the search looks a step further; where it is
more than the second in the end, the user is told."""

AS_GOOD = 1.01
"""A linear model of few states counts as good as one of more when its error is at most this many
times the other's. Most of a linear model's error may be what hidden units will learn: a small rise
of the whole is a large one of the rest."""
USED = 0.98
"""Hidden units make use of more states where the error falls below this part, after all
iterations: short runs do not show it. Linear models, most of whose error is due to what only
hidden units learn, do not show such states."""
MORE_SHOWN = 2
"""Impulse responses may hide so many states, as they may show too many."""
GOOD = 5e-3
"""A network whose error is below this, relative to the outputs' deviation, is not made larger: the
fit on all data comes still, and mostly makes it about twice as accurate. The error is that of the
validation or of the training: where only the first is larger, more data are wanted, not more
parameters, and the search sees a part of the data."""
BESIDE_NOISE = 0.15
"""Beside noise, a network is good whose own error is below this part of the noise: it raises the
whole error by one per cent."""
ACCURATE = 1e-3
"""It is also good below this, relative to the outputs' deviation, however small the noise is."""
FITTED = 0.3
"""It is large enough if so much is left over of what it learnt from, beside the noise: a larger
one would learn the noise. The fit on all data brings the rest."""

Place = tuple[int, int]
"""A size, by its positions among the orders and among the numbers of hidden units."""
STATES, UNITS = (1, 0), (0, 1)
"""A step to more states, and a step to more hidden units."""


@dataclass(frozen=True, eq=False)
class Chosen:
    """The search has chosen a size.

    Attributes:
        order: number of states that carry the response.
        n_units: number of hidden units.
        judged: the network of this size as far as the search has run it; None without a search.
        larger: a network of more states that is worth the same effort, since the order is a guess
            from linear models; None where it is known.
        tried: all sizes that were judged, in their order.
    """

    order: int
    n_units: int
    judged: Candidate | None = None
    larger: Candidate | None = None
    tried: tuple[TriedSize, ...] = ()


def choose_sizes(multi_start: MultiStart) -> Chosen:
    """Return order and number of hidden units as the recipe says, or as a search finds them."""
    order, n_units = multi_start.network.order, multi_start.network.hidden
    if order != "auto" and n_units != "auto":
        return Chosen(order, n_units)
    search = _Search(multi_start, orders_to_try(multi_start), _numbers_of_units(n_units))
    place = (0, 0)
    if n_units != "auto" or not multi_start.eigenvalues_known:
        # where the order is known, linear models of more states only imitate what units will learn
        place = search.climb(place, [STATES])
    if n_units == "auto":
        place = search.climb(place, [STATES, UNITS])
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
    """Return the lowest order whose linear model is as good as one of more states than are shown.

    Low orders are tried first: they cost least, and their fits converge best.
    """
    most = min(shown + MORE_SHOWN, max(shown, multi_start.highest_order()))
    multi_start.ledger.plan(2 * LINEAR_ITERATIONS * (most + 1), "number of states")
    wanted = AS_GOOD * min(multi_start.linear(order).error for order in (shown, most))
    return next(n for n in range(1, most + 1) if multi_start.linear(n).error <= wanted)


def _numbers_of_units(n_units: int | str) -> list[int]:
    if isinstance(n_units, int):
        return [n_units]
    numbers = [0, FIRST_UNITS]
    while numbers[-1] < MOST_UNITS:
        numbers.append(2 * numbers[-1])
    return numbers


class _Search:
    """A search judges sizes, each once, and climbs from size to size. Final."""

    def __init__(self, multi_start: MultiStart, orders: list[int], units: list[int]) -> None:
        self._multi_start, self._orders, self._units = multi_start, orders, units
        self._data = multi_start.data
        self._samples = self._data.part.targets.numel()
        self._judged: dict[Place, Candidate] = {}
        self._learnable: dict[Place, float] = {}
        self._noise = 0.0

    def climb(self, place: Place, steps: Sequence[Place]) -> Place:
        """Go to larger sizes by the given kinds of steps, while one of them is worthwhile."""
        while not (self._linear_suffices(place) or self._is_good(place)):
            found = self._best_of(self._beyond(place, steps))
            unfinished = self._learnable_at(place) >= UNFINISHED
            if found is not None and unfinished and not self._pays(found, place):
                found = self._best_of([found, *self._beyond(found, steps)])
            if found is None or not self._pays(found, place):
                break
            place = found
        return place

    def with_more_states(self, place: Place) -> Candidate | None:
        """Return the network of more states than at a place, for hidden units to make use of.

        There is none for a linear network, whose states the guess of the order has counted, and
        none where a network leaves hardly more than noise.
        """
        linear = self._units[place[1]] == 0
        if linear or _leaves_noise_alone(self._candidate(place), self._noise, self._samples):
            return None
        found = self._best_of(self._beyond(place, [STATES]))
        return None if found is None else self._candidate(found)

    def chosen(self, place: Place, larger: Candidate | None) -> Chosen:
        """Return the size at a place, with all that were tried."""
        tried = tuple(self._tried(place) for place in self._judged)
        order, n_units = self._orders[place[0]], self._units[place[1]]
        return Chosen(order, n_units, self._judged[place], larger, tried)

    def _beyond(self, place: Place, steps: Sequence[Place]) -> list[Place]:
        """Return the places one step beyond, as far as the search goes."""
        beyond = [(place[0] + states, place[1] + more) for states, more in steps]
        return [(i, j) for i, j in beyond if i < len(self._orders) and j < len(self._units)]

    def _best_of(self, places: list[Place]) -> Place | None:
        return min(places, key=self._error, default=None)

    def _pays(self, larger: Place, smaller: Place) -> bool:
        return self._error(larger) < WORTHWHILE * self._error(smaller)

    def _candidate(self, place: Place) -> Candidate:
        """Return the network of a size, which is judged if it was not yet."""
        if place not in self._judged:
            order, n_units = self._orders[place[0]], self._units[place[1]]
            found = judge(self._multi_start, order, n_units)
            noise = noise_in(found, self._data.validation)
            if noise:  # the lowest level is the nearest to white noise
                self._noise = min(noise, self._noise or noise)
            self._judged[place] = found
        return self._judged[place]

    def _error(self, place: Place) -> float:
        """Return the validation error of a size, without the noise that was found so far."""
        return without_noise(self._candidate(place).error, self._noise)

    def _is_good(self, place: Place) -> bool:
        """Tell whether the network has hidden units, and is accurate enough for the search."""
        if self._units[place[1]] == 0:
            return False
        return _good(self._candidate(place), self._noise, self._samples)

    def _linear_suffices(self, place: Place) -> bool:
        """Tell whether the network is linear and good, and its residual cannot be predicted."""
        good = self._units[place[1]] == 0 and self._error(place) < GOOD
        return good and self._learnable_at(place) < NEGLIGIBLE

    def _learnable_at(self, place: Place) -> float:
        """Return how much of a size's error can be predicted; without end if it is unstable."""
        if place not in self._learnable:
            stable = math.isfinite(self._error(place))
            found = still_learnable(self._data, self._judged[place]) if stable else math.inf
            self._learnable[place] = found
        return self._learnable[place]

    def _tried(self, place: Place) -> TriedSize:
        candidate, learnable = self._judged[place], self._learnable.get(place, math.inf)
        return TriedSize(
            self._orders[place[0]],
            candidate.shape.n_units,
            candidate.shape.n_parameters,
            finite(candidate.error),
            finite(learnable),
        )


def _good(candidate: Candidate, noise: float, samples: int) -> bool:
    """Tell whether a network, which learnt from samples, is accurate enough to stay so small."""
    if not noise:
        return min(candidate.error, candidate.training_error) < GOOD
    own = without_noise(candidate.error, noise)
    # an error far below the noise says that the training has no such noise
    known = candidate.training_error < min(GOOD, PART * noise)
    accurate = own < max(ACCURATE, min(GOOD, BESIDE_NOISE * noise))
    return known or accurate or _leaves_noise_alone(candidate, noise, samples)


def _leaves_noise_alone(candidate: Candidate, noise: float, samples: int) -> bool:
    """Tell whether a network leaves hardly more than noise of the samples that it learnt from.

    Its parameters have learnt some of the noise, which the training error lacks.
    """
    free = samples - candidate.shape.n_parameters
    if not noise or free <= 0:
        return False
    left = without_noise(candidate.training_error * math.sqrt(samples / free), noise)
    return left < min(GOOD, FITTED * noise)


def judge(multi_start: MultiStart, order: int, n_units: int) -> Candidate:
    """Return a network of a size after a few short runs, of which the best was longer.

    It runs on while that pays as a larger network would have to pay: iterations are cheaper.
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
    found = multi_start.judged(best)
    if _is_accurate(multi_start, found):
        return found
    further = [partial(multi_start.judged, number=number) for number in range(1, MOST_ROUNDS)]
    return while_it_pays(found, further, partial(_pays, multi_start))


def _is_accurate(multi_start: MultiStart, candidate: Candidate) -> bool:
    """Tell whether a network is good, by the noise that it shows itself."""
    noise = noise_in(candidate, multi_start.data.validation)
    return _good(candidate, noise, multi_start.data.part.targets.numel())


def _pays(multi_start: MultiStart, after: Candidate, before: Candidate) -> bool:
    """A round pays that helps as much as more hidden units would have to, and is not enough."""
    noise = noise_in(before, multi_start.data.validation)
    error, former = (without_noise(one.error, noise) for one in (after, before))
    return error < WORTHWHILE * former and not _is_accurate(multi_start, after)


def still_learnable(data: FitData, candidate: Candidate) -> float:
    """Return how much of a network's validation error can be predicted from the inputs."""
    both = data.part, data.validation
    share = learnable_share(candidate.shape, candidate.state.best, both)
    return candidate.error * math.sqrt(share)
