"""Features: what a network sees of the newest inputs, as named signals, and what each is for.

A set of features is a pure function of the newest input and the three before it. Its signals
have names; a network picks those it needs by their roles. All are formed in float64: differences
cancel. The sets are registered in ``sets.py``.
"""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.features.drive_law import DEFAULT_LAW, DRIVE_LAWS, DriveLaw
from slide_fmu.features.serial_chain import SerialChain

BEFORE = 3
"""Inputs before the newest that features may depend on."""

PullBack = Callable[[FloatArray], FloatArray]
"""Reverse mode of a function at a point: from weights of its results to the gradient of their
weighted sum, of the same shapes as results and arguments."""


@dataclass(frozen=True, eq=False)
class Offered:
    """This says what a system offers to the sets of features.

    Attributes:
        inputs: the input signals, in channel order.
        scaling: of the inputs.
        step: sample step h in s.
        chain: geometry and masses of the serial chain whose joints' set points the inputs are; or
            None.
        law: how its joints follow them.
    """

    inputs: tuple[Signal, ...]
    scaling: Affine
    step: float
    chain: SerialChain | None
    law: DriveLaw = DRIVE_LAWS[DEFAULT_LAW]


class Features(abc.ABC):
    """A set of features of scaled inputs. Interface; implementations are final.

    Attributes:
        TITLE: the set's name for people.
        NUMBER: the set's number in a surrogate file.
        NAMES: names of all signals that the set can have, in their order.
        CHANGES_OF: of signals that are the changes of others in a step, the names of those.
        linear: whether the signals are a linear function of the inputs: they then change their
            sign with them.
        n_before: number of inputs before the newest that the signals depend on.
        n_channels: number of input channels.
        blocks: names of the signals in their order, with the number of each.
        centred: names of those whose mean is removed before they are scaled.
        bounded: names of those that lie within -1 and 1 anyway and are left as they are.
        vectors: names of those of which single components may rest, as in planar machines.
        cosines: channels that must be the cosine of an angle; the next one is its sine.
    """

    TITLE: ClassVar[str]
    NUMBER: ClassVar[int]
    NAMES: ClassVar[tuple[str, ...]]
    CHANGES_OF: ClassVar[dict[str, str]] = {}
    linear: ClassVar[bool] = False
    n_before: int = BEFORE
    n_channels: int
    blocks: dict[str, int]
    centred: frozenset[str] = frozenset()
    bounded: frozenset[str] = frozenset()
    vectors: frozenset[str] = frozenset()
    cosines: tuple[int, ...] = ()

    @classmethod
    @abc.abstractmethod
    def of_system(cls, names: tuple[str, ...], offered: Offered) -> Features:
        """Make the set on the inputs of a system, with the signals of some names among its own.

        Raises:
            ValueError: the system has not what the set needs.
        """

    @classmethod
    @abc.abstractmethod
    def read(cls, section: Reader, n_inputs: int) -> Features:
        """Read what ``parameters`` wrote.

        Raises:
            ValueError: the bytes are no such set on so many inputs.
        """

    @abc.abstractmethod
    def parameters(self) -> bytes:
        """Write the bytes that follow the set's number in a surrogate file, little-endian."""

    @abc.abstractmethod
    def of(self, inputs: FloatArray) -> FloatArray:
        """Form the signals at every sample that has ``BEFORE`` samples before it.

        Scaled inputs of the shape (B, N + BEFORE, n_channels) give (B, N, n_signals).
        """

    @abc.abstractmethod
    def pull_back(self, inputs: FloatArray) -> PullBack:
        """Prepare the reverse mode of ``of`` at its inputs, in float64.

        Weights of the signals have the shape (B, N, n_signals), the gradient of their weighted sum
        that of the inputs.
        """

    @property
    def n_signals(self) -> int:
        """The number of all signals."""
        return sum(self.blocks.values())

    def along(self, sequences: NDArray[Any]) -> FloatArray:
        """Form the signals along sequences: scaled inputs (B, N, n_channels) to (B, N, n_signals).

        Inputs before a sequence count as equal to its first.
        """
        inputs = np.asarray(sequences, dtype=np.float64)
        return self.of(np.pad(inputs, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge"))

    def indices(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Give the indices of the signals of some names, in their order.

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
