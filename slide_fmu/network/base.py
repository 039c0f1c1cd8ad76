"""Networks are data: the trained weights, evaluated with numpy; this is their interface.

A family is a package next to this module: a final class of ``Network``, its byte layout and its
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
"""Number of windows evaluated at once; it limits the memory of a long prediction."""


def batches(count: int, size: int) -> list[slice]:
    """Return slices of ``count`` rows, each of at most ``size`` and at least one row."""
    return [slice(first, first + max(1, size)) for first in range(0, count, max(1, size))]


class Network(abc.ABC):
    """A Network is a pure function from scaled inputs to scaled values. Interface.

    Scaled inputs come as float64: a family may form differences before it rounds.

    Attributes:
        features: the features that it takes, formed from the inputs.
        n_samples: length of the input sequence.
        n_channels: number of input channels.
        n_values: number of values that it returns.
        memory_length: number of newest samples whose features its values depend on: n_samples for
            a feed-forward network, n_samples - n_out + 1 for a state-space network, which has
            forgotten the inputs before. The ``BEFORE`` samples before the oldest feature do not
            count here; ``Surrogate.memory_length`` counts them.
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

        Scaled inputs (B, n_in, n_channels) give scaled values (B, n_out, n_outputs), float32; the
        newest values are equal to ``evaluate``.
        """

    @abc.abstractmethod
    def stream(self, sequences: NDArray[Any]) -> Float32Array:
        """Evaluate at every sample of long sequences, as the FMU does.

        Scaled inputs (B, N, n_channels), N >= 1, give scaled values (B, N, n_values), float32.
        Before its start, each sequence counts as constant, equal to its first input.
        """

    @abc.abstractmethod
    def require_window(self, window: Window, n_outputs: int) -> None:
        """Reject a window, or a number of outputs, that does not fit the network.

        Raises:
            ValueError: with the sizes found and those expected.
        """

    @abc.abstractmethod
    def block_length(self, n_outputs: int) -> int:
        """Return the number of output samples that one evaluation gives."""

    @property
    @abc.abstractmethod
    def measures_truncation(self) -> bool:
        """Whether the network measures the effect of its finite memory (``truncation_error``)."""

    @property
    @abc.abstractmethod
    def is_affine(self) -> bool:
        """Whether the values are an affine function of the sequence."""

    @abc.abstractmethod
    def count_parameters(self) -> int:
        """Count the weights and biases."""


class Parametric(abc.ABC):
    """A Parametric network has weights that may follow physical parameters. Interface.

    Some families implement it in addition to ``Network``.
    """

    @property
    @abc.abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The physical parameters that the weights follow; empty if the weights are fixed."""

    @abc.abstractmethod
    def at(self, values: FloatArray) -> Network:
        """Return the network for fixed values of the parameters, (n_parameters,), in their units.

        The result has no parameters; a network without parameters returns itself.
        """

    @abc.abstractmethod
    def starting_at(self, values: FloatArray) -> Network:
        """Return the network with other start values of its parameters, (n_parameters,)."""
