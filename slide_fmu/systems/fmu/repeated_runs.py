"""This module runs an FMU repeatedly, and uses its instance again where that is safe."""

from __future__ import annotations

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

FAILURES = (RuntimeError, OSError)
"""Exceptions of calls of an FMU and of fmpy's solver."""


@final
class Runs:
    """Runs are simulated one after another, each from the FMU's own start.

    Args:
        make: makes the steps of a fresh instance.
    """

    def __init__(self, make: Callable[[], FmuSteps]) -> None:
        self._make = make
        self._steps: FmuSteps | None = None
        self._resets: bool | None = None  # whether a reset instance is as a fresh one
        self._first_run: list[tuple[FloatArray, FloatArray, FloatArray]] = []  # of the first run
        self._last, self._number = np.empty(0), 0

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
        return self._read(self._number * self.steps.plan.step, self._last)

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Go on by one sample step under inputs, (n_inputs,), and give the new outputs.

        Raises:
            SimulationError: the FMU or the solver fails; the run cannot go on.
        """
        steps, number, before = self.steps, self._number, self._last
        begin = number * steps.plan.step
        hint = "" if number else _about_step(steps)
        self._guarded(begin, inputs, lambda: steps.advance(number, before, inputs), hint)
        self._number, self._last = number + 1, inputs
        outputs = self._read(begin + steps.plan.step, inputs)
        if self._resets is None and 0 < len(self._first_run) <= COMPARED[0]:
            self._first_run.append((before, inputs, outputs))
        return outputs

    def jump(self, inputs: FloatArray) -> None:
        """Let the inputs jump to values, (n_inputs,), from which the next step begins."""
        self._last = inputs

    def forget(self) -> None:
        """Take this run for no measure of a reset, since it left the FMU's own start."""
        self._first_run = []

    def _initialize(self, held: FloatArray) -> None:
        self.steps.initialize(held)
        self._last, self._number = held, 0

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
        return SimulationError(text + hint, time)

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
