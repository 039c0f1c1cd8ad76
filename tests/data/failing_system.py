"""Systems that fail, or end their process, on some of their inputs."""

from __future__ import annotations

import os

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError


class FailingSystem(System):
    """Its output is its input; it fails at the first sample whose input is above ``fail``.

    Above ``crash`` it ends the process, above ``broken`` its output is no number.
    """

    may_crash = True

    def __init__(
        self, step: float = 0.1, fail: float = 9.0, crash: float = 9.0, broken: float = 9.0
    ) -> None:
        self.step, self.fail, self.crash, self.broken = step, fail, crash, broken
        self.inputs = (Signal("force", "N", -1.0, 1.0),)
        self.outputs = (Signal("position", "m", -1.0, 1.0),)

    def simulate(self, inputs: FloatArray) -> FloatArray:
        if np.max(inputs) > self.crash:
            os._exit(7)
        beyond = np.flatnonzero(inputs[:, 0] > self.fail)
        if len(beyond):
            time = float(self.step * beyond[0])
            raise SimulationError(f"no solution at t = {time:g} s", time)
        outputs = np.concatenate([inputs[:1], inputs])
        return np.where(outputs > self.broken, np.nan, outputs)
