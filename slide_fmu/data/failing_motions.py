"""This module tolerates a few failing motions where a system is examined, as the data do.

Another draw takes the place of each failed motion, and a remark says so.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, final

from slide_fmu.data.draws import Draw, shortened
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

LEAST = 2
"""This many motions may fail in any case: a few motions say little about the share of all."""

Result = TypeVar("Result")


class TooManyFailuresError(SimulationError):
    """A system failed on more motions than are tolerated."""


@final
class Tolerance:
    """A Tolerance counts motions that could not be simulated.

    Attributes:
        share: part of all motions that may fail.
        tried: motions that were begun.
        errors: messages of the system for the failed motions.
    """

    def __init__(self, share: float) -> None:
        self.share, self.tried, self.errors = share, 0, list[str]()

    def count(self, error: SimulationError) -> None:
        """Count a motion that failed.

        Raises:
            TooManyFailuresError: too many motions failed.
        """
        self.errors.append(str(error))
        allowed = max(LEAST, int(self.share * self.tried))
        if len(self.errors) > allowed:
            raise TooManyFailuresError(
                f"{self._failed}, {allowed} may fail ({100 * self.share:g} % of all, "
                f"data.most_failures): {error}. Correct the model, narrow the ranges of its "
                "inputs (system.inputs, data.excitation), or allow more",
                error.time,
            ) from error

    @property
    def _failed(self) -> str:
        count = max(self.tried, len(self.errors))
        return f"{len(self.errors)} of {count} motions could not be simulated"

    @property
    def remark(self) -> str | None:
        """Remark on the motions that failed; None if all succeeded."""
        if not self.errors:
            return None
        return (
            f"{self._failed}, and others took their place; the first failed so: {self.errors[0]}"
        )


@final
class RunnableDraws:
    """Draws of motions on which the system fails are left out.

    A motion is not simulated merely as a test until one has failed.

    Attributes:
        tolerance: counts the failures.
    """

    def __init__(self, system: System, share: float) -> None:
        self.tolerance = Tolerance(share)
        self._system, self._careful, self._first = system, False, 0
        self._fits: dict[tuple[int, int], int] = {}  # the attempt that works, by index and length

    def drawn(self, index: int, count: int | None, draw: Callable[[int], Draw]) -> Draw:
        """Return a draw of motion ``index``, cut to ``count`` samples.

        Once a motion has failed, it is the first attempt that can be simulated.

        Raises:
            TooManyFailuresError: too many attempts failed.
        """
        key = index, count or 0
        attempt = self._fits.get(key, self._first)
        drawn = shortened(draw(attempt), count)
        if key in self._fits:
            return drawn
        self.tolerance.tried += 1
        while self._careful:
            try:
                simulate(self._system, drawn.inputs, drawn.initial)
                break
            except SimulationError as error:
                self.tolerance.count(error)
                self.tolerance.tried += 1
                attempt += 1
                drawn = shortened(draw(attempt), count)
        self._fits[key] = attempt
        return drawn

    def tolerated(self, work: Callable[[], Result]) -> Result:
        """Do work on motions, and again on others while it fails.

        Raises:
            TooManyFailuresError: too many motions failed.
        """
        while True:
            try:
                return work()
            except TooManyFailuresError:
                raise
            except SimulationError as error:
                if self._careful:  # each motion alone can be simulated, but not one after another
                    self.tolerance.count(error)
                    self._first += 1
                self._careful = True
                self._fits.clear()
