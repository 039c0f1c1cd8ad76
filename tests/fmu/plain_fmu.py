"""A co-simulation FMU in a few lines of Python: what every call does, of either standard.

Deliberately apart from the C runtime: an oracle that shares its code would prove nothing.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, field

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.surrogate_variables import memory_lengths
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import MovingOracle
from tests.fmu.native import DISCARD, ERROR, OK, WARNING
from tests.fmu.plain import ResamplingOracle

INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED = "instantiated", "initial", "step", "end"

HUGE = 1e20
"""Inputs beyond it have outputs that are not finite, of surrogates with cubic units."""

SLACK = 1e-6
"""Times that differ by less, in sample steps, are the same."""

Inputs = tuple[float, ...]


@dataclass(frozen=True)
class Plan:
    """What an importer does that watches a step of several samples.

    Attributes:
        inputs: set after samples, which count from 1.
        asked: the sample after which it asks for an early end; 0: it does not.
        until: where it wants the end, in sample steps after the start of the step.
    """

    inputs: dict[int, Inputs] = field(default_factory=dict)
    asked: int = 0
    until: float = 0.0


@dataclass
class PlainFmu:
    """Inputs, the steps of the past, and the mode.

    Every call gives the status of the standard; one that is refused changes nothing.

    Attributes:
        rates: derivatives of the inputs in the next step, in 1/s.
        prehistory: 1: the inputs before the start were ``initial``; 2: ``window``, oldest first.
        steps: length in s, inputs, and their derivatives, of each step.
        ended_early: the last step did, as its watcher had asked.
    """

    surrogate: Surrogate
    mode: str = INSTANTIATED
    time: float = 0.0
    stop: float = math.inf
    inputs: Inputs = ()
    rates: Inputs = ()
    prehistory: int = 0
    initial: Inputs = ()
    window: tuple[Inputs, ...] = ()
    steps: tuple[tuple[float, Inputs, Inputs], ...] = ()
    ended_early: bool = False

    def __post_init__(self) -> None:
        starts = tuple(signal.start_value for signal in self.surrogate.inputs)
        self.inputs, self.initial, self.rates = starts, starts, (0.0,) * len(starts)
        self.window = (starts,) * self.surrogate.memory_length

    def kept(self) -> PlainFmu:
        """The state, to be gone back to."""
        return copy(self)

    def go_back(self, kept: PlainFmu) -> None:
        """To another state; the stop time is that of the run."""
        self.__dict__.update({**kept.__dict__, "stop": self.stop})

    def reset(self) -> int:
        self.go_back(PlainFmu(self.surrogate))
        self.stop = math.inf
        return OK

    def initialize(self, time: float, stop: float | None = None) -> int:
        wrong = stop is not None and not stop >= time
        if self.mode != INSTANTIATED or not math.isfinite(time) or wrong:
            return ERROR
        self.mode, self.time = INITIALIZATION, time
        self.stop = math.inf if stop is None else stop
        return OK

    def change_mode(self, before: str, after: str) -> int:
        if self.mode != before:
            return ERROR
        self.mode = after
        return OK

    def set_inputs(self, values: Inputs) -> int:
        if self.mode == TERMINATED:
            return ERROR
        if not all(map(math.isfinite, values)):
            return DISCARD
        self.inputs = values
        return OK

    def set_rates(self, rates: Inputs, order: int = 1) -> int:
        """Derivatives of the inputs (FMI 2.0), of which only the first ones count."""
        if self.mode == TERMINATED or order < 1:
            return ERROR
        if not all(map(math.isfinite, rates)):
            return DISCARD
        if order > 1:
            return WARNING if any(rates) else OK
        self.rates = rates
        return OK

    def set_prehistory(self, known: float, values: Inputs, largest: int) -> int:
        """largest: of the values that the standard has for what is known."""
        if self.mode not in (INSTANTIATED, INITIALIZATION):
            return ERROR
        if known not in range(largest + 1) or not all(map(math.isfinite, values)):
            return DISCARD
        self.prehistory, self.initial = int(known), values
        return OK

    def set_window(self, rows: FloatArray) -> int:
        """Samples before the start (FMI 3.0), (n, n_inputs)."""
        if rows.shape[0] != len(self.window) or self.mode not in (INSTANTIATED, INITIALIZATION):
            return ERROR
        if not np.all(np.isfinite(rows)):
            return DISCARD
        self.window = tuple(map(tuple, rows.tolist()))
        return OK

    def _past(self) -> ResamplingOracle:
        """What is known before the first step, and all steps."""
        before = {0: None, 1: np.array([self.initial]), 2: np.array(self.window)}[self.prehistory]
        if not self.steps:  # what is set counts as held for ever, where nothing else is known
            start = ResamplingOracle(self.surrogate)
            for row in [self.inputs] if before is None else before:
                start.append(self.surrogate.window.step, np.array(row))
            return start
        past = MovingOracle(self.surrogate, known=True, before=before)
        for length, inputs, rates in self.steps:
            past.step(length, np.array(inputs), np.array(rates) if any(rates) else None)
        return past

    def _finite(self) -> bool:
        """Are the present outputs? They are where the network sees no huge inputs."""
        taken = [value for _, inputs, rates in self.steps for value in (*inputs, *rates)]
        if max(map(abs, (*taken, *self.inputs))) < HUGE:
            return True
        samples = self._past().samples(self.surrogate.network.n_samples)
        return bool(np.abs(samples).max() < HUGE)

    def _misses(self, time: float, length: float) -> bool:
        """Is a step wrong, that is neither tiny nor far from 0?"""
        slack = SLACK * self.surrogate.window.step
        here = abs(time - self.time) < slack
        fine = self.mode == STEPPING and here and 0 < length < math.inf
        return not fine or self.time + length > self.stop + slack

    def _take(self, length: float) -> int:
        kept = self.kept()
        self.steps = (*self.steps, (length, self.inputs, self.rates))
        if not self._finite():
            self.go_back(kept)
            return ERROR
        self.time += length
        self.rates = (0.0,) * len(self.rates)
        return OK

    def do_step(self, time: float, length: float) -> int:
        if self._misses(time, length):
            return ERROR
        self.ended_early = False
        return self._take(length)

    def watched_step(self, time: float, length: float, plan: Plan) -> int:
        """Sample by sample, in a step of several; ramps go on until inputs are set."""
        h = self.surrogate.window.step
        count = round(length / h) if math.isfinite(length) else 0
        if self._misses(time, length):
            return ERROR
        if abs(count * h - length) > SLACK * h or any(self.rates):
            return self.do_step(time, length)
        kept, until, self.ended_early = self.kept(), math.inf, False
        begin, end = self._reached(), self.inputs
        moves = self.surrogate.hold == "first_order"
        for sample in range(1, count + 1):
            if moves:
                left = 1 - sample / count
                self.inputs = tuple(b - left * (b - a) for a, b in zip(begin, end, strict=True))
            if self._take(h) != OK:
                self.go_back(kept)
                return ERROR
            if sample == plan.asked:
                until = kept.time + plan.until * h
            if sample in plan.inputs and sample < count:
                self.inputs, moves = plan.inputs[sample], False
            if sample < count and self.time >= until:
                self.ended_early = True
                break
        if moves:
            self.inputs = end
        return OK

    def _reached(self) -> Inputs:
        """The inputs until now, or before the first step."""
        past = self._past()
        if isinstance(past, MovingOracle):
            return tuple(past.goal.tolist())
        return (self.inputs, self.initial, self.window[-1])[self.prehistory]

    def results_status(self) -> int:
        if self.mode == INSTANTIATED:
            return ERROR
        return OK if self.steps or self._finite_at_start() else DISCARD

    def _finite_at_start(self) -> bool:
        return self.prehistory > 0 or self._finite()

    def results(self) -> tuple[FloatArray, FloatArray | None]:
        """Outputs and error estimates: before the first step, of inputs held for ever."""
        return self._past().results()

    def block(self) -> FloatArray:
        """All outputs that the network knows, (n, n_outputs)."""
        return self._past().block()

    def filled(self) -> list[float]:
        """Part of the inputs behind outputs and, with an estimator, behind its estimates."""
        taken = sum(length for length, _, _ in self.steps) / self.surrogate.window.step
        counts = memory_lengths(self.surrogate).values()
        return [1.0 if self.prehistory else min(1.0, taken / count) for count in counts]
