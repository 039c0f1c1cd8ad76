"""A baseline is a trained model of another kind; what it costs to train one is a budget."""

from __future__ import annotations

import abc
import time
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.network.base import Network


class Baseline(abc.ABC):
    """A Baseline answers inputs in free simulation, in scaled units. Interface.

    Attributes:
        parameters: number of parameters.
        start_length: number of outputs that a simulation is given, the first of a record; from
            then on it knows inputs alone.
    """

    parameters: int
    start_length: int

    @abc.abstractmethod
    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        """Simulate a record: inputs (N, n_inputs) to outputs at samples 1 .. N, (N, n_outputs).

        The outputs at samples 0 .. start_length - 1 are given, (start_length, n_outputs). Outputs
        of a model that diverges may be infinite, or no numbers.
        """


class Stepped(Baseline):
    """A Stepped is a baseline that no FMU holds: its library takes its steps. Interface."""

    @abc.abstractmethod
    def step_along(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        """Give what ``simulate`` gives, one sample after the other as a co-simulation does."""


class Frozen(Baseline):
    """A Frozen is one of our networks as a baseline; it needs no outputs to start from. Final.

    Attributes:
        network: scaled inputs to scaled outputs.
        window: the window that the network fits.
    """

    def __init__(self, network: Network, window: Window, n_outputs: int) -> None:
        self.network, self.window, self._n_outputs = network, window, n_outputs
        self.parameters, self.start_length = network.count_parameters(), 0

    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        values = self.network.stream(inputs[None])[0, :, -self._n_outputs :]
        return np.asarray(values, dtype=np.float64)


class Budget:
    """A budget is CPU time of this process, on all its cores, from now on. Final."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self._begin = seconds, time.process_time()

    @property
    def spent(self) -> float:
        """The CPU time in s that was spent so far."""
        return time.process_time() - self._begin

    @property
    def left(self) -> float:
        """The CPU time in s that is left; it is negative where the budget was exceeded."""
        return self.seconds - self.spent


@dataclass(frozen=True, eq=False)
class Learnt:
    """This says what a baseline's fit gives.

    Attributes:
        baseline: the trained model.
        structure: its size in words, such as "8 lags".
        cut: whether the budget ended the search or the training before its own end.
    """

    baseline: Baseline
    structure: str
    cut: bool
