"""The FMU that is judged, called in the ways in which its users call it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import slide_fmu
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.description.variables import (
    AT_STEP_END,
    BOUND_FILLED,
    ERROR_BOUND,
    HELD,
    TRUSTED,
    WINDOW_FILLED,
)
from slide_fmu.importer.file import UnpackedFmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.benchmarks.unprepared.kinds import Motion

QUARTERS = {"h": 4, "h/2": 2, "h/4": 1, "known": 4, "predict": 4, "simulate": 1}
"""All calls, with the number of quarters of the FMU's step from one output to the next."""
PLAIN = ("h", "h/2", "h/4")
WITH_BOUND = (*PLAIN, "known")
PART = 16
"""A held input that moves is known by its mean over this number of parts of a step."""


@dataclass(frozen=True, eq=False)
class Answer:
    """An Answer is what a call gives.

    Attributes:
        outputs: shape (N, n_outputs).
        counted: whether each sample counts, (N,).
        bounds: as outputs; None where the call has no bound.
        trusted: shape (N,), likewise.
    """

    outputs: FloatArray
    counted: Any
    bounds: FloatArray | None = None
    trusted: Any = None


@dataclass(frozen=True, eq=False)
class Judged:
    """A Judged is the FMU that is judged, along motions of a number of its steps.

    Attributes:
        fmu: the unpacked FMU.
        surrogate: what it holds.
        steps: number of steps of a motion.
    """

    fmu: UnpackedFmu
    surrogate: Surrogate
    steps: int

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(signal.name for signal in self.surrogate.inputs)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(signal.name for signal in self.surrogate.outputs)

    @property
    def step(self) -> float:
        """The FMU's step h in s."""
        return self.surrogate.window.step

    @property
    def held(self) -> bool:
        """Whether inputs are held over each step."""
        return AT_STEP_END not in self.fmu.variables

    @cached_property
    def times(self) -> FloatArray:
        """Quarters of steps, in s, at which the truth is wanted."""
        return np.arange(4 * self.steps + 1, dtype=np.float64) * (self.step / 4)

    @cached_property
    def after_window(self) -> Any:
        """Whether the window is full at these times."""
        return self.times >= self.surrogate.window.n_in * self.step

    def calls(self, motion: Motion, nature: str) -> list[str]:
        """Return the calls that a kind of motion allows.

        A held FMU cannot be given an input that moves within its steps in advance; curves between
        samples do not jump.
        """
        knowable = not self.held or motion.drawn.on_grid
        smooth = not self.held and nature != "jumps"
        return [*PLAIN, *(["known", "predict"] if knowable else []), *["simulate"] * smooth]

    def answer(self, call: str, motion: Motion) -> Answer:
        """Return what a call gives at all its points; ``predict`` has none at the start."""
        if call == "predict":
            outputs = self.surrogate.predict(self._known(motion))
            return Answer(outputs, self.after_window[4::4])
        if call == "simulate":
            outputs = slide_fmu.simulate(self.fmu.path, self.times, motion(self.times))
            return Answer(outputs, self.after_window)
        if call == "known":
            named = {HELD if self.held else AT_STEP_END: 1.0}
            return self._run(call, self._known(motion), named)
        begins = self.times[: -1 : QUARTERS[call]]
        return self._run(call, motion(begins + 1e-9 * self.step), {})

    def _known(self, motion: Motion) -> FloatArray:
        """Return the inputs of each step as they are known by its end, (steps, n_inputs)."""
        k = np.arange(1, self.steps + 1)
        if not self.held:
            return motion(k * self.step - 1e-9 * self.step)
        parts = (np.arange(PART) + 0.5) / PART
        times = ((k - 1)[:, None] + parts).ravel() * self.step
        return np.asarray(motion(times).reshape(self.steps, PART, -1).mean(axis=1))

    def _run(self, call: str, rows: FloatArray, parameters: dict[str, float]) -> Answer:
        """Set rows of inputs before the steps of a call, and read what an importer reads."""
        quarters, n = QUARTERS[call], len(self.outputs)
        bounded = TRUSTED in self.fmu.variables
        names = [*self.outputs, WINDOW_FILLED]
        if bounded:
            names += [BOUND_FILLED, TRUSTED]
            names += [ERROR_BOUND.replace("{signal}", name) for name in self.outputs]
        inputs = dict(zip(self.inputs, rows.T, strict=True))
        values = run_fmu(self.fmu, inputs, names, parameters, self.step * quarters / 4).values
        filled = (values[:, n : n + 1 + bounded] >= 1).all(axis=1)
        counted = self.after_window[::quarters] & filled
        if not bounded:
            return Answer(values[:, :n], counted)
        return Answer(values[:, :n], counted, values[:, n + 3 :], values[:, n + 2] != 0)
