"""A baseline is a trained model of another kind; the cost of its training is a budget."""

from __future__ import annotations

import abc
import time
from dataclasses import dataclass
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.network.base import Network


class Baseline(abc.ABC):
    """A Baseline predicts outputs in free simulation, in scaled units. Interface.

    Attributes:
        parameters: number of parameters.
        start_length: number of first outputs that a simulation gets; after them it gets inputs
            only.
    """

    parameters: int
    start_length: int

    @abc.abstractmethod
    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        """Simulate a sequence: inputs (N, n_inputs) to outputs at samples 1 .. N, (N, n_outputs).

        The outputs at samples 0 .. start_length - 1 are given, (start_length, n_outputs). Outputs
        of a model that diverges may be infinite or NaN.
        """


class SteppedBaseline(Baseline):
    """A SteppedBaseline cannot be an FMU: its library takes its steps. Interface."""

    @abc.abstractmethod
    def step_along(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        """Return the values of ``simulate``, sample by sample as a co-simulation does."""


@final
class NetworkBaseline(Baseline):
    """A NetworkBaseline is one of our networks as a baseline; it needs no first outputs.

    Attributes:
        network: maps scaled inputs to scaled outputs.
        window: the window of the network.
    """

    def __init__(self, network: Network, window: Window, n_outputs: int) -> None:
        self.network, self.window, self._n_outputs = network, window, n_outputs
        self.parameters, self.start_length = network.count_parameters(), 0

    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        values = self.network.stream(inputs[None])[0, :, -self._n_outputs :]
        return np.asarray(values, dtype=np.float64)


@final
class Budget:
    """A Budget is CPU time of this process, on all its cores, from now on."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self._begin = seconds, time.process_time()

    @property
    def spent(self) -> float:
        """The CPU time in s spent so far."""
        return time.process_time() - self._begin

    @property
    def left(self) -> float:
        """The CPU time in s that is left; negative if the budget was exceeded."""
        return self.seconds - self.spent


@dataclass(frozen=True)
class Course:
    """A Course says how far the training of a network came.

    Attributes:
        steps: number of its steps.
        error: its smallest validation error, an RMS in scaled units.
        error_half_way: the one at half of its time; None if none was known then.
        cut: whether the budget ended it.
    """

    steps: int
    error: float
    error_half_way: float | None
    cut: bool


@dataclass(frozen=True, eq=False)
class FittedBaseline:
    """A FittedBaseline is the result of fitting a baseline.

    Attributes:
        baseline: the trained model.
        structure: its size in words, such as "8 lags".
        cut: whether the budget ended the search or the training before its own end.
        course: course of the training of a network; None for other models.
    """

    baseline: Baseline
    structure: str
    cut: bool
    course: Course | None = None
