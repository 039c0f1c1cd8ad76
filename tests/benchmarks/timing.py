"""Times of the parts of a communication step inside C, without FMI."""

from __future__ import annotations

import time

from slide_fmu.fmu.native import NativeSurrogate, Part

LOOP_SECONDS, MOST_LOOPS = 4e-4, 2000
"""A loop inside C is short enough to run undisturbed, and much longer than calling it."""


def part_times(native: NativeSurrogate, part: Part, loops: int, times: int) -> list[float]:
    """Seconds of a part of a step inside C, one for each of the loops.

    Args:
        native: the surrogate in the C runtime.
        part: what is repeated.
        loops: number of loops.
        times: repetitions in each loop.
    """
    found = []
    for _ in range(loops):
        begin = time.perf_counter()
        native.repeat(part, times)
        found.append((time.perf_counter() - begin) / times)
    return found


def repetitions(native: NativeSurrogate, part: Part) -> int:
    """How many repetitions make a loop."""
    (seconds,) = part_times(native, part, 1, 20)
    return min(MOST_LOOPS, max(1, int(LOOP_SECONDS / seconds)))
