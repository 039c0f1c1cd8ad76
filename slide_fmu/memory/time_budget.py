"""A first estimate of a window takes a limited time, and reports what was left out.

The result depends on the speed of the machine, so it is not stored.
"""

from __future__ import annotations

import math
import time
from typing import final

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate

TIMED_SAMPLES, PART = 50, 0.1
"""Number of samples that are timed, and fraction of the time that one motion may take."""


@final
class TimeBudget:
    """A TimeBudget ends after a time, and notes what is left out after that.

    Attributes:
        seconds: the time in s; infinite without a limit.
        left_out: names of what was left out, in order.
    """

    def __init__(self, seconds: float = math.inf) -> None:
        self.seconds, self.left_out = seconds, list[str]()
        self._begin = time.monotonic()

    def gone(self, leaves_out: str, part: float = 1.0) -> bool:
        """Return whether the fraction ``part`` of the time is over; if so, note ``leaves_out``."""
        over = time.monotonic() - self._begin > part * self.seconds
        if over:
            self.leave_out(leaves_out)
        return over

    def leave_out(self, name: str) -> None:
        """Note that something is left out."""
        if name not in self.left_out:
            self.left_out.append(name)

    def samples(self, system: System, inputs: FloatArray) -> float:
        """Return the number of samples that a motion may have; a few inputs show the time."""
        begin = time.perf_counter()
        simulate(system, inputs)
        return self.seconds * PART * len(inputs) / max(time.perf_counter() - begin, 1e-9)

    @property
    def remark(self) -> str | None:
        """What was left out, as text; None if nothing was."""
        if not self.left_out:
            return None
        return (
            f"in {self.seconds:g} s there was no time for "
            f"{'; '.join(self.left_out)}. The window is a first estimate; slide-fmu window or run "
            "find it with all motions"
        )
