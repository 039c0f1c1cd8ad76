"""Parts of a recipe's trajectories, for processes that share nothing but a disk."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Shard:
    """A shard is the part ``number``, counted from 1, of ``count`` equal parts.

    Every part has trajectories of every split, so that all parts take about as long.
    """

    number: int = 1
    count: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise ValueError(
                f"shard {self}; expected I/N with 1 <= I <= N, as 1/8 for the first of eight parts"
            )

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def indices(self, total: int, before: int) -> range:
        """Return the indices of a split that belong to this part.

        Args:
            total: number of the split's trajectories.
            before: number of trajectories of all splits before it.
        """
        return range((self.number - 1 - before) % self.count, total, self.count)


WHOLE = Shard()
"""All trajectories."""


def shard_of(text: str) -> Shard:
    """Read a part as it is written, ``I/N``.

    Raises:
        ValueError: it is written otherwise, or there is no such part.
    """
    match = re.fullmatch(r"(\d+)/(\d+)", text)
    if match is None:
        raise ValueError(f"shard {text!r}; expected I/N, as 1/8 for the first of eight parts")
    return Shard(int(match[1]), int(match[2]))
