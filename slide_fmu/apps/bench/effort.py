"""An effort is the number of measurements of a benchmark.

The help of the command line shows it, so this module imports no numerical packages.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """An Effort is the number of measurements.

    Attributes:
        rounds: number of rounds, in which all take turns.
        steps: number of steps of each in a round.
        windows: number of windows in a batch.
    """

    rounds: int = 20
    steps: int = 100
    windows: int = 1200
