"""A first look at a window takes a limited time, and says what was left out for that.

What the time allows depends on the machine, so what is found here is not kept.
"""

from __future__ import annotations

import math
import time

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate

TIMED_SAMPLES, PART = 50, 0.1
"""This many samples are timed, and one motion may take this part of the time."""


class TimeBudget:
    """A TimeBudget ends after a time, and notes what is left out since then. Final.

    Attributes:
        seconds: the time in s; infinite if there is no hurry.
        left_out: what was left out, in the order of time.
    """

    def __init__(self, seconds: float = math.inf) -> None:
        self.seconds, self.left_out = seconds, list[str]()
        self._begin = time.monotonic()

    def gone(self, leaves_out: str, part: float = 1.0) -> bool:
        """Tell whether the time that there is for this is over: then it is left out."""
        over = time.monotonic() - self._begin > part * self.seconds
        if over:
            self.leave_out(leaves_out)
        return over

    def leave_out(self, name: str) -> None:
        """Note that something is left out."""
        if name not in self.left_out:
            self.left_out.append(name)

    def samples(self, system: System, inputs: FloatArray) -> float:
        """Return how many samples of a system a motion may have; some inputs are for timing.

        Raises:
            SimulationError: the system could not be simulated.
        """
        begin = time.perf_counter()
        simulate(system, inputs)
        return self.seconds * PART * len(inputs) / max(time.perf_counter() - begin, 1e-9)

    @property
    def remark(self) -> str | None:
        """The text says what was left out; None if nothing was."""
        if not self.left_out:
            return None
        return (
            f"in {self.seconds:g} s there was no time for "
            f"{'; '.join(self.left_out)}. The window is a first estimate; slide-fmu window or run "
            "find it with all motions"
        )
