"""A first look at a window takes a limited time, and says what was left out for that.

How much can be looked at in the time depends on the machine, so what is found here is not kept.
"""

from __future__ import annotations

import math
import time


class Patience:
    """A Patience ends after a time; it hears what was left out since then. Final.

    Attributes:
        seconds: the time in s; infinite if there is no hurry.
        left_out: what was left out, in the order in which it was heard.
    """

    def __init__(self, seconds: float = math.inf) -> None:
        self.seconds, self.left_out = seconds, list[str]()
        self._begin = time.monotonic()

    def gone(self, leaves_out: str) -> bool:
        """Whether the time is over, so that something is left out."""
        over = time.monotonic() - self._begin > self.seconds
        if over:
            self.hear(leaves_out)
        return over

    def hear(self, leaves_out: str) -> None:
        """Hear that something is left out."""
        if leaves_out not in self.left_out:
            self.left_out.append(leaves_out)

    @property
    def remark(self) -> str | None:
        """The text says what was left out; None if nothing was."""
        if not self.left_out:
            return None
        return (
            f"the system is slow: in {self.seconds:g} s there was no time for "
            f"{'; '.join(self.left_out)}. The window is a first estimate; slide-fmu window or run "
            "find it with all motions"
        )
