"""How long a benchmark measures.

The command line shows it in its help, so this module imports no number crunching.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """An Effort says how long is measured.

    Attributes:
        rounds: rounds in which all take turns.
        steps: steps of each in a round.
        windows: windows of a batch.
    """

    rounds: int = 20
    steps: int = 100
    windows: int = 1200
