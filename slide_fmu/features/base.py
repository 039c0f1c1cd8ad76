"""Features: what a network sees of the newest inputs, as named signals, and what each is for.

A set of features is a pure function of the newest input and the three before it. Its signals
have names; a network picks those it needs by their roles. All are formed in float64: differences
cancel.
"""

from __future__ import annotations

import abc
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray

BEFORE = 3
"""Inputs before the newest that features may depend on."""


class Features(abc.ABC):
    """A set of features of scaled inputs. Interface; implementations are final.

    Attributes:
        n_channels: number of input channels.
        blocks: names of the signals in their order, with the number of each.
        centred: names of those whose mean is removed before they are scaled.
        bounded: names of those that lie within -1 and 1 anyway and are left as they are.
        of_angle: whether the channels must be the cosine and sine of an angle.
    """

    n_channels: int
    blocks: dict[str, int]
    centred: frozenset[str] = frozenset()
    bounded: frozenset[str] = frozenset()
    of_angle: bool = False

    @abc.abstractmethod
    def of(self, inputs: FloatArray) -> FloatArray:
        """Signals at every sample that has ``BEFORE`` samples before it.

        Args:
            inputs: scaled inputs, shape (B, N + BEFORE, n_channels).

        Returns:
            Shape (B, N, n_signals).
        """

    @property
    def n_signals(self) -> int:
        """Number of all signals."""
        return sum(self.blocks.values())

    def along(self, sequences: NDArray[Any]) -> FloatArray:
        """Signals along sequences; inputs before a sequence count as equal to its first.

        Args:
            sequences: scaled inputs, shape (B, N, n_channels).

        Returns:
            Shape (B, N, n_signals).
        """
        inputs = np.asarray(sequences, dtype=np.float64)
        return self.of(np.pad(inputs, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge"))

    def indices(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Indices of the signals of some names, in their order.

        Raises:
            ValueError: there are no signals of a name.
        """
        unknown = [name for name in names if name not in self.blocks]
        if unknown:
            raise ValueError(f"no features named {unknown}; expected some of {list(self.blocks)}")
        ends = dict(zip(self.blocks, np.cumsum(list(self.blocks.values())), strict=True))
        return tuple(
            int(i) for name in names for i in range(ends[name] - self.blocks[name], ends[name])
        )
