"""A search goes from cheap candidates to dear ones, while the next one pays.

So sizes of a network, kinds of hidden units, features and numbers of trajectories are found. What
differs is what a candidate is, what its error is, and what makes it dear.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar, final

from slide_fmu.core.measures import percent

Rung = TypeVar("Rung")

WORTHWHILE = 0.8
"""A dearer network pays if its error is below this fraction of the cheaper one's. On a spring with
a cubic share, three seeds spread the error of a size that suffices by 4 to 9 %; the rest is the
price of a network that takes more time in every step of an FMU. A size whose short runs may miss
what it can do is spread ninefold: no fraction covers that, so a search may look further ahead."""


def pays(dearer: float, cheaper: float, worth: float) -> bool:
    """Return whether an error is below the fraction ``worth`` of that of a cheaper candidate.

    An infinite or undefined error never pays; every finite one pays against an infinite one.
    """
    return dearer < worth * cheaper


@final
@dataclass(frozen=True)
class Climb(Generic[Rung]):
    """A Climb is the result of a search.

    Attributes:
        chosen: the candidate that was chosen.
        explanation: one sentence on why it pays, and why nothing dearer does.
    """

    chosen: Rung
    explanation: str


@final
@dataclass(frozen=True, eq=False)
class Ladder(Generic[Rung]):
    """A Ladder has candidates in the order of what they cost.

    Attributes:
        error: gives the error of a candidate. It is asked for several times, so whoever fits a
            network for it must keep the result.
        dearer: gives the candidates of the next higher cost. They are equals: the one with the
            least error counts. There are none after the dearest.
        worth: a dearer candidate pays if its error is below this fraction of the cheaper one's.
            The difference to 1 must cover the spread of the errors over random starts, and the
            price of the dearer candidate.
        named: describes a candidate in a few words.
        enough: gives the reason why nothing dearer than a candidate is needed, or None.
        ahead: gives the number of further steps that are looked at where the next candidates do
            not pay, since a small step may gain little alone.
    """

    error: Callable[[Rung], float]
    dearer: Callable[[Rung], Sequence[Rung]]
    worth: float
    named: Callable[[Rung], str] = str
    enough: Callable[[Rung], str | None] = lambda candidate: None
    ahead: Callable[[Rung], int] = lambda candidate: 0

    def climb(self, start: Rung) -> Climb[Rung]:
        """Go from a candidate to dearer ones while they pay."""
        place, before = start, None
        self.error(start)
        while (reason := self.enough(place)) is None:
            best = self._best_beyond(place)
            if best is None or not self._pays(best, place):
                reason = self._refusal(best, place)
                break
            place, before = best, place
        return Climb(place, self._choice(place, before) + f"; {reason}")

    def _best_beyond(self, place: Rung) -> Rung | None:
        """Return the best of the next candidates, and of those after them if none pays."""
        ahead, further = self.ahead(place), self.dearer(place)
        best = last = self._best(further)
        while last is not None and best is not None and ahead and not self._pays(best, place):
            further, ahead = self.dearer(last), ahead - 1
            best, last = self._best([best, *further]), self._best(further)
        return best

    def _best(self, candidates: Iterable[Rung]) -> Rung | None:
        return min(candidates, key=self.error, default=None)

    def _pays(self, dearer: Rung, cheaper: Rung) -> bool:
        return pays(self.error(dearer), self.error(cheaper), self.worth)

    def _choice(self, place: Rung, before: Rung | None) -> str:
        text = f"{self.named(place)}: error {self.error(place):.3g}"
        return text if before is None else f"{text}, {self._change(place, before)}, which pays"

    def _refusal(self, dearer: Rung | None, place: Rung) -> str:
        if dearer is None:
            return "nothing larger is tried"
        change = self._change(dearer, place)
        return f"{self.named(dearer)}: {change}, which does not pay (at least {self._least} would)"

    @property
    def _least(self) -> str:
        return percent(1 - self.worth)

    def _change(self, dearer: Rung, cheaper: Rung) -> str:
        """Say how an error differs from that of another candidate."""
        error, other = self.error(dearer), self.error(cheaper)
        if not (math.isfinite(error) and math.isfinite(other) and other > 0):
            return f"error {error:.3g} instead of {other:.3g}"
        less = error <= other
        change = abs(1 - error / other)
        return f"{percent(change)} {'less' if less else 'more'} than {self.named(cheaper)}"


def cheapest_as_good(
    candidates: Iterable[Rung], error: Callable[[Rung], float], wanted: float
) -> Rung | None:
    """Return the first candidate, from the cheapest on, whose error is at most the wanted one."""
    return next((candidate for candidate in candidates if error(candidate) <= wanted), None)


def fewest_by_halving(most: int, error: Callable[[int], float], wanted: float) -> int | None:
    """Return the least number, up to ``most``, whose error is at most the wanted one.

    Errors should fall with the number: then halves of the range are left out unseen.
    """
    if not error(most) <= wanted:
        return None
    too_few, enough = 0, most
    while enough - too_few > 1:
        middle = (too_few + enough) // 2
        if error(middle) <= wanted:
            enough = middle
        else:
            too_few = middle
    return enough


def run_while_it_pays(
    candidate: Rung,
    rounds: Sequence[Callable[[Rung], Rung]],
    pays: Callable[[Rung, Rung], bool],
) -> Rung:
    """Run a candidate further, round by round, until one hardly helps; return the last one.

    ``pays`` compares the candidates after and before a round. This is no choice as that of a
    ``Ladder``: the last round is kept, since it has been paid for, and the network costs the same
    in every step of an FMU.
    """
    for go_on in rounds:
        before, candidate = candidate, go_on(candidate)
        if not pays(candidate, before):
            break
    return candidate
