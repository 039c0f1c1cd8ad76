"""A co-simulation FMU in a few lines of Python: what every call does, of either standard."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, field

import numpy as np

from slide_fmu.fmu.model_description import samples_behind
from slide_fmu.signals import FloatArray
from slide_fmu.surrogate import Surrogate

from .native import DISCARD, ERROR, OK
from .plain import Resampling

INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED = "instantiated", "initial", "step", "end"


@dataclass
class PlainFmu:
    """Inputs, the steps of the past, and the mode. Final.

    Every call gives the status of the standard; one that is refused changes nothing.

    Attributes:
        steps: length in s and inputs of each step.
    """

    surrogate: Surrogate
    mode: str = INSTANTIATED
    time: float = 0.0
    inputs: tuple[float, ...] = ()
    initial: tuple[float, ...] = ()
    prehistory_known: bool = False
    steps: tuple[tuple[float, tuple[float, ...]], ...] = field(default=())

    def __post_init__(self) -> None:
        starts = tuple(
            float(signal.low if signal.start is None else signal.start)
            for signal in self.surrogate.inputs
        )
        self.inputs, self.initial = self.inputs or starts, self.initial or starts

    def kept(self) -> PlainFmu:
        """The state, to be gone back to."""
        return copy(self)

    def go_back(self, kept: PlainFmu) -> None:
        self.__dict__.update(kept.__dict__)

    def reset(self) -> int:
        self.go_back(PlainFmu(self.surrogate))
        return OK

    def initialize(self, time: float) -> int:
        if self.mode != INSTANTIATED or not math.isfinite(time):
            return ERROR
        self.mode, self.time = INITIALIZATION, time
        return OK

    def change_mode(self, before: str, after: str) -> int:
        if self.mode != before:
            return ERROR
        self.mode = after
        return OK

    def set_inputs(self, values: tuple[float, ...]) -> int:
        if self.mode == TERMINATED:
            return ERROR
        if not all(map(math.isfinite, values)):
            return DISCARD
        self.inputs = values
        return OK

    def set_prehistory(self, known: float, values: tuple[float, ...]) -> int:
        if self.mode not in (INSTANTIATED, INITIALIZATION):
            return ERROR
        if known not in (0, 1) or not all(map(math.isfinite, values)):
            return DISCARD
        self.prehistory_known, self.initial = known == 1, values
        return OK

    def do_step(self, time: float, length: float) -> int:
        """Of a step that is neither tiny nor far from 0."""
        sample_step = self.surrogate.window.step
        here = abs(time - self.time) < 1e-6 * sample_step
        if self.mode != STEPPING or not here or not (0 < length < math.inf):
            return ERROR
        self.steps = (*self.steps, (length, self.inputs))
        self.time += length
        return OK

    def results_status(self) -> int:
        return ERROR if self.mode == INSTANTIATED else OK

    def results(self) -> tuple[FloatArray, FloatArray | None]:
        """Outputs and error estimates: before the first step, of inputs held for ever."""
        h, past = self.surrogate.window.step, Resampling(self.surrogate)
        before = [(h, self.initial)] if self.prehistory_known else []
        steps = [*before, *self.steps] or [(h, self.inputs)]
        past.lengths = [length for length, _ in steps[:-1]]
        past.inputs = [np.array(inputs) for _, inputs in steps[:-1]]
        length, inputs = steps[-1]
        return past.step(length, np.array(inputs))

    def filled(self) -> list[float]:
        """Part of the inputs behind outputs and, with an estimator, behind its estimates."""
        taken = sum(length for length, _ in self.steps) / self.surrogate.window.step
        counts = samples_behind(self.surrogate).values()
        return [1.0 if self.prehistory_known else min(1.0, taken / count) for count in counts]
