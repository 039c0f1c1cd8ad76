"""Times of work are those of this program, also on a machine that others keep busy."""

from __future__ import annotations

import time
from pathlib import Path

SCHEDULED = Path("/proc/thread-self/schedstat")
"""Here Linux says how long this thread ran and waited for a core, in ns."""


def own_time() -> float:
    """Return a time in s whose differences are those of the wall clock without waits for a core.

    Waiting for anything else counts, such as for another program that simulates. Where the system
    does not say how long a thread waited for a core, it is the time of the wall clock.
    """
    return time.perf_counter() - _waited()


def _waited() -> float:
    """Return how long this thread has waited for a core, in s; 0 where that is not known."""
    try:
        return 1e-9 * int(SCHEDULED.read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
