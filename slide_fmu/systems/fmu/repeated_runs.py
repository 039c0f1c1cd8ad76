"""This module runs an FMU repeatedly, and uses its instance again where that is safe."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.calls import FailedCallError
from slide_fmu.importer.logger_callbacks import last_texts
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.fmu.steps import FmuSteps
from slide_fmu.systems.specification import values_text

COMPARED = 1000, 20
"""An instance is trusted to reset itself if that many samples at most, and that many at least, of
its first record come out the same after a reset."""

LEAD_IN = 0.75
"""Part of the FMU's default experiment over which a run leads in that goes on from another one."""

FORGOTTEN = 1e-3
"""A run goes on from another one if, after the lead-in, its outputs differ from those of the other
one by at most this part of what they moved: windows end where as much is left of the past."""

FAR = 1e4
"""A stop time that is told is so many default experiments away: no motion lasts that long."""

FAILURES = (RuntimeError, OSError)
"""Exceptions of calls of an FMU and of fmpy's solver."""


@final
class Runs:
    """Runs are simulated one after another, each from the FMU's own start.

    The standards let an FMU go on for ever where no stop time is defined; the stop time of its
    default experiment is a proposal. Some FMUs end there all the same. They are then told a stop
    time that is far away. Where this does not help, a fresh instance leads in over the newest part
    of that experiment, and goes on in the place of the one that ended: motions here have a memory
    that fades, and the outputs of both must agree.

    Args:
        make: makes the steps of a fresh instance.
    """

    def __init__(self, make: Callable[[], FmuSteps]) -> None:
        self._make = make
        self._steps: FmuSteps | None = None
        self._resets: bool | None = None  # whether a reset instance is as a fresh one
        self._first_run: list[tuple[FloatArray, FloatArray, FloatArray]] = []  # of the first run
        self._last, self._number = np.empty(0), 0
        self._before = 0  # samples of the run before the start of the present instance
        self._past: deque[tuple[FloatArray, FloatArray]] = deque()  # inputs that a run leads in by
        self._outputs = np.empty((3, 0))  # of this run: the least, the largest, the newest
        self._span, self._step = math.inf, 0.0  # s, of the default experiment, and of a sample
        self._stop: float | None = None  # that the FMU is told
        self._failure = ""  # what it said of this
        self._ends = False  # whether it ends with its default experiment all the same

    @property
    def steps(self) -> FmuSteps:
        """The steps of the current run."""
        assert self._steps is not None
        return self._steps

    @property
    def running(self) -> bool:
        """Tell whether there is a run that can go on."""
        return self._steps is not None

    @property
    def last_input(self) -> FloatArray:
        """The input that acted last, shape (n_inputs,)."""
        return self._last

    def begin(self, held: FloatArray) -> None:
        """Begin a run under an input that has always acted, shape (n_inputs,).

        Raises:
            LoadError: the FMU cannot be instantiated.
            SimulationError: it cannot be initialized.
        """
        if self._steps is not None and not self._steps.instance.usable:
            self._drop()  # another instance of an FMU that allows one alone took its place
        if self._steps is not None and self._resets is None:
            self._resets = self._replays()
        if self._steps is not None and self._resets and self._reset(held):
            return
        self._drop()
        self._steps = self._make()
        self._guarded(0.0, held, lambda: self._initialize(held))
        if self._resets is None:
            self._first_run = [(held, held, self._read(0.0, held))]

    def output(self) -> FloatArray:
        """Give the outputs at the current sample in their units, shape (n_outputs,).

        Raises:
            SimulationError: the FMU cannot give them, or one is not finite.
        """
        return self._read(self._time, self._last)

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Go on by one sample step under inputs, (n_inputs,), and give the new outputs.

        Raises:
            SimulationError: the FMU or the solver fails; the run cannot go on.
        """
        before, goes_beyond = self._last, self._goes_beyond
        if goes_beyond and self._ends:
            self._lead_in()
        hint = "" if self._number else _about_step(self.steps)
        try:
            self._go_on(before, inputs, hint)
        except SimulationError as error:
            if not goes_beyond or self._ends:
                raise
            self._ends, self._failure = self._stop is not None, str(error)  # it was told
            self._lead_in()
            self._go_on(before, inputs, hint)
        outputs = self._read(self._time, inputs)
        self._see(outputs)
        if self._resets is None and not self._before and 0 < len(self._first_run) <= COMPARED[0]:
            self._first_run.append((before, inputs, outputs))
        return outputs

    @property
    def _time(self) -> float:
        """The time of the current sample in s, since the start of the present instance."""
        return (self._number - self._before) * self._step

    @property
    def _goes_beyond(self) -> bool:
        """Tell whether the next step ends after the default experiment, and a run can lead in."""
        ends_after = self._time + self._step > self._span * (1 + 1e-9)
        return ends_after and 0 < len(self._past) == self._past.maxlen

    def _go_on(self, before: FloatArray, inputs: FloatArray, hint: str = "") -> None:
        """Let the present instance go on by a sample step."""
        steps, number = self.steps, self._number - self._before
        self._guarded(self._time, inputs, lambda: steps.advance(number, before, inputs), hint)
        self._past.append((before, inputs))
        self._number, self._last = self._number + 1, inputs

    def _see(self, outputs: FloatArray) -> None:
        """Keep the range of the outputs in this run, and the newest ones."""
        low, high, _ = self._outputs if self._outputs.size else (outputs,) * 3
        self._outputs = np.stack([np.minimum(low, outputs), np.maximum(high, outputs), outputs])

    def _lead_in(self) -> None:
        """Go on with a fresh instance, which the newest inputs lead to the current sample.

        Raises:
            SimulationError: it fails, or comes to other outputs.
        """
        rows, seen, reached = list(self._past), self._outputs, self._number
        first = rows[0][0]
        if self._steps is None or not self._resets or not self._reset(first):
            self._drop()
            self._steps = self._make()
            if self._stop is None and not self._ends:
                self._stop = self._steps.time(0) + FAR * self._span
            self._guarded(0.0, first, lambda: self._initialize(first))
        self._before = self._number = reached - len(rows)
        for before, inputs in rows:
            self._go_on(before, inputs)
        outputs = self._read(self._time, self._last)
        low, high, expected = seen
        apart = np.abs(outputs - expected) - 1e-9 * np.abs(expected)
        far = np.flatnonzero(apart > FORGOTTEN * (high - low))
        if far.size:
            signal, stop = self.steps.plan.outputs[far[0]], self.steps.default_stop
            reason = (
                f"{self._failure}. It goes no further than its default experiment, up to {stop:g} "
                f"s. A run that leads in over {len(rows) * self._step:g} s comes to "
                f"{signal.name!r} = {outputs[far[0]]:.6g}, the one that ended to "
                f"{expected[far[0]]:.6g}; expected the same, since its memory fades within that "
                "time: export the FMU with a later end"
            )
            raise self._failed(self._time, self._last, reason)
        self._outputs = seen

    def jump(self, inputs: FloatArray) -> None:
        """Let the inputs jump to values, (n_inputs,), from which the next step begins."""
        self._last = inputs

    def forget(self) -> None:
        """Take this run for no measure of a reset, since it left the FMU's own start."""
        self._first_run, self._span = [], math.inf

    def _initialize(self, held: FloatArray) -> None:
        steps = self.steps
        steps.initialize(held, self._stop)
        self._last, self._number, self._before = held, 0, 0
        self._step, self._span = steps.plan.step, steps.default_stop - steps.time(0)
        lead_in = max(0.0, LEAD_IN * self._span / self._step)
        self._past = deque(maxlen=round(lead_in) if math.isfinite(lead_in) else 0)
        self._outputs = np.empty((3, 0))

    def _reset(self, held: FloatArray) -> bool:
        """Begin a run with the same instance; give whether that worked."""
        try:
            self.steps.instance.reset()
            self._initialize(held)
        except FAILURES:
            self._resets = False
            return False
        return True

    def _replays(self) -> bool:
        """Find out whether the instance, once reset, gives its first run again."""
        first_run, self._first_run = self._first_run, []
        if len(first_run) <= COMPARED[1]:
            return False
        self._resets = True
        with suppress(SimulationError):
            if self._reset(first_run[0][0]):
                again = [self.output()]
                for before, row, _ in first_run[1:]:
                    self._last = before
                    again.append(self.advance(row))
                return all(
                    np.array_equal(a, b) for a, (*_, b) in zip(again, first_run, strict=True)
                )
        return False

    def _read(self, time: float, inputs: FloatArray) -> FloatArray:
        outputs = self._guarded(time, inputs, lambda: np.array(self.steps.outputs.get()))
        broken = np.flatnonzero(~np.isfinite(outputs))
        if broken.size:
            signal = self.steps.plan.outputs[broken[0]]
            raise self._failed(time, inputs, f"output {signal.name!r} = {outputs[broken[0]]}")
        return outputs

    def _guarded(
        self,
        time: float,
        inputs: FloatArray,
        call: Callable[[], FloatArray | None],
        hint: str = "",
    ) -> FloatArray:
        """Call the FMU; what fails is named with its time, its inputs and a hint."""
        try:
            result = call()
        except FAILURES as error:
            logged = last_texts(self.steps.instance.messages)
            reason = f"{error}{': ' + logged if logged else ''}"
            if isinstance(error, FailedCallError):  # it has what was logged
                reason = error.reason
            raise self._failed(time, inputs, reason, hint) from error
        return np.empty(0) if result is None else result

    def _failed(
        self, time: float, inputs: FloatArray, reason: str, hint: str = ""
    ) -> SimulationError:
        steps = self.steps
        plan = steps.plan
        text = (
            f"FMU {plan.file.path.name!r} failed at t = {steps.time(0) + time:.6g} s with "
            f"{values_text(plan.inputs, inputs)}: {reason}"
        )
        self._drop()
        return SimulationError(text + hint, self._before * plan.step + time)

    def _drop(self) -> None:
        """Let the instance go, whatever state it is in."""
        if self._steps is not None:
            with suppress(*FAILURES):
                self._steps.instance.free()
        self._steps = None


def _about_step(steps: FmuSteps) -> str:
    """Say what to do where an FMU does not get over its first step."""
    file, step = steps.plan.file, steps.plan.step
    if file.interface != "co_simulation":
        return ""
    wanted = "" if file.own_step is None else f"; the FMU names a step of {file.own_step:g} s"
    stairs = f" in {file.options.substeps} parts (fmu-substeps)" if steps.plan.ramped else ""
    return f" (the step was window.step = {step:g} s{stairs}{wanted})"
