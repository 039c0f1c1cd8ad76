"""A linear oscillator that logs every simulation it begins; for workers of other processes."""

from __future__ import annotations

import os

import numpy as np

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearizable, Linearization, RandomStates, State

LOG = "SLIDE_FMU_TEST_LOG"
"""Environment variable that names the log."""


class LoggingSystem(RandomStates, Linearizable):
    """Appends one line per simulated trajectory: its initial position, which is its own."""

    def __init__(self, *, step: float, damping: float, substeps: int) -> None:
        self._inner = LinearOscillator(step=step, damping=damping, substeps=substeps)
        self.step = step
        self.inputs, self.outputs = self._inner.inputs, self._inner.outputs

    def set_state(self, state: State) -> None:
        log = os.open(os.environ[LOG], os.O_APPEND | os.O_CREAT | os.O_WRONLY)
        os.write(log, f"{identity(state)}\n".encode())
        os.close(log)
        self._inner.set_state(state)

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        return self._inner.random_state(rng, first_input)

    def rest_state(self, held_input: FloatArray) -> State:
        return self._inner.rest_state(held_input)

    def get_state(self) -> State:
        return self._inner.get_state()

    def output(self) -> FloatArray:
        return self._inner.output()

    def advance(self, inputs: FloatArray) -> FloatArray:
        return self._inner.advance(inputs)

    def linearize(self, state: State) -> Linearization:
        return self._inner.linearize(state)


def identity(state: State) -> str:
    """What a trajectory's line in the log says."""
    return repr(float(state.coordinates[0]))
