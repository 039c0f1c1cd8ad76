"""Networks as data: what is left of a trained network, evaluated with numpy. The interface.

A family is a package beside this module: a final class of ``Network``, its byte layout and its
gradient, registered in ``bytes.py``; and its kernel in the C runtime.
"""

from __future__ import annotations

import abc
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.parameters import Parameter
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.feature_map import FeatureMap

Float32Array = NDArray[np.float32]

BATCH = 4096
"""Windows evaluated at once: bounds the memory of a long prediction."""


def batches(count: int, size: int) -> list[slice]:
    """Give slices of at most ``size`` of so many rows, at least one in each."""
    return [slice(first, first + max(1, size)) for first in range(0, count, max(1, size))]


class Network(abc.ABC):
    """A Network is a pure function from scaled inputs to scaled values. Interface.

    Scaled inputs come as float64: a family may form their differences before it rounds.

    Attributes:
        features: what it sees of the inputs.
        n_samples: length of the input sequence.
        n_channels: number of input channels.
        n_values: number of values it gives.
        memory_length: number of newest samples whose features its values depend on: those it
            sees; for a network that runs along them, those behind the oldest sample of the output
            window, before which it has forgotten. The ``BEFORE`` samples that the features of the
            oldest one look at do not count; ``Surrogate.memory_length`` has them.
    """

    features: FeatureMap
    n_samples: int
    memory_length: int
    n_channels: int
    n_values: int

    @abc.abstractmethod
    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        """Evaluate a batch of sequences: (B, n_samples, n_channels) to (B, n_values).

        Scaled inputs have the oldest sample first; scaled values are float32.
        """

    @abc.abstractmethod
    def block(self, sequences: NDArray[Any], n_out: int) -> Float32Array:
        """Evaluate the output windows of a batch of input windows, sample by sample.

        Scaled inputs (B, n_in, n_channels) give scaled values (B, n_out, n_outputs), float32, the
        newest that of ``evaluate``.
        """

    @abc.abstractmethod
    def stream(self, records: NDArray[Any]) -> Float32Array:
        """Evaluate at every sample of long records, as the FMU does.

        Scaled inputs (B, N, n_channels), N >= 1, give scaled values (B, N, n_values), float32. The
        first input of each record counts as held for ever before.
        """

    @abc.abstractmethod
    def require_window(self, window: Window, n_outputs: int) -> None:
        """Reject a window, or a number of outputs, that the network does not fit.

        Raises:
            ValueError: with the sizes found and those expected.
        """

    @abc.abstractmethod
    def block_length(self, n_outputs: int) -> int:
        """Give the number of samples of the outputs that it knows at a time."""

    @property
    @abc.abstractmethod
    def measures_truncation(self) -> bool:
        """It is true when it measures what its finite memory costs (``truncation_error``)."""

    @property
    @abc.abstractmethod
    def is_affine(self) -> bool:
        """It is true when the values are an affine function of the sequence."""

    @abc.abstractmethod
    def count_parameters(self) -> int:
        """Count the weights and biases."""


class Parametric(abc.ABC):
    """A Parametric network has weights that may follow physical parameters. Interface.

    It is an offer of some families beside ``Network``.
    """

    @property
    @abc.abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The physical parameters that the weights follow; none where they are fixed."""

    @abc.abstractmethod
    def at(self, values: FloatArray) -> Network:
        """Give the network for fixed values of the parameters, (n_parameters,), in their units.

        It has no parameters any more; a network without any gives itself.
        """

    @abc.abstractmethod
    def starting_at(self, values: FloatArray) -> Network:
        """Give the network whose parameters start at values, (n_parameters,), in their units."""
