"""Features are named signals that a network takes in place of the newest inputs.

A set of features is a pure function of the newest input and the three before it. Its signals have
names; a network picks the signals it needs by their roles. All are formed in float64, because
differences cancel. The sets are registered in ``sets.py``.
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
"""Number of inputs before the newest one that features may depend on."""

PullBack = Callable[[FloatArray], FloatArray]
"""Reverse mode of a function at a point: it maps weights of the results to the gradient of their
weighted sum. Shapes are those of results and arguments."""


@dataclass(frozen=True, eq=False)
class FeatureOffer:
    """A FeatureOffer holds what a system offers to the sets of features.

    Attributes:
        inputs: the input signals, in channel order.
        scaling: scaling of the inputs.
        step: sample step h in s.
        chain: geometry and masses of the serial chain if the inputs are set points of its joints;
            else None.
        law: how the chain's joints follow their set points.
    """

    inputs: tuple[Signal, ...]
    scaling: Affine
    step: float
    chain: SerialChain | None
    law: DriveLaw = DRIVE_LAWS[DEFAULT_LAW]

    @property
    def geometry(self) -> tuple[SerialChain, DriveLaw] | None:
        """The chain and its law; None without a chain. Features see it, but data need not."""
        return None if self.chain is None else (self.chain, self.law)


class Features(abc.ABC):
    """A set of features of scaled inputs. Interface; implementations are final.

    Attributes:
        TITLE: the set's name for people.
        NUMBER: the set's number in a surrogate file.
        NAMES: names of all signals that the set can have, in their order.
        CHANGES_OF: names of signals that are changes over one step, with the name of the signal
            that changes.
        linear: whether the signals are a linear function of the inputs, so that they change their
            sign with them.
        n_before: number of inputs before the newest that the signals depend on.
        n_channels: number of input channels.
        blocks: names of the signals in their order, with the number of channels of each.
        centred: names of signals whose mean is removed before they are scaled.
        bounded: names of signals that always lie within -1 and 1 and are not scaled.
        vectors: names of signals of which some components may rest, as in planar machines.
        cosines: channels that must be the cosine of an angle; the next channel is its sine.
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
    def of_system(cls, names: tuple[str, ...], offered: FeatureOffer) -> Features:
        """Make the set for the inputs of a system; it must have the signals with these names.

        Raises:
            ValueError: the system does not offer what the set needs.
        """

    @classmethod
    @abc.abstractmethod
    def read(cls, section: Reader, n_inputs: int) -> Features:
        """Read what ``parameters`` wrote.

        Raises:
            ValueError: the bytes are not such a set for ``n_inputs`` inputs.
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

        Weights have the shape of the signals, (B, N, n_signals); the gradient has the shape of the
        inputs.
        """

    @property
    def n_signals(self) -> int:
        """The number of all signals."""
        return sum(self.blocks.values())

    def along(self, sequences: NDArray[Any]) -> FloatArray:
        """Form the signals along sequences: scaled inputs (B, N, n_channels) to (B, N, n_signals).

        Inputs before a sequence count as equal to its first input.
        """
        inputs = np.asarray(sequences, dtype=np.float64)
        return self.of(np.pad(inputs, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge"))

    def indices(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Return the indices of the signals with these names, in the order of the names.

        Raises:
            ValueError: a name is unknown.
        """
        unknown = [name for name in names if name not in self.blocks]
        if unknown:
            raise ValueError(f"no features named {unknown}; expected some of {list(self.blocks)}")
        ends = dict(zip(self.blocks, np.cumsum(list(self.blocks.values())), strict=True))
        return tuple(
            int(i) for name in names for i in range(ends[name] - self.blocks[name], ends[name])
        )
