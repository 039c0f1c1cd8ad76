"""Time and past inputs of an FMU that carries a torch module. Becomes part of that FMU.

As ``torch_slave.py`` it imports nothing of slide_fmu where it runs. Both classes mean what
``clock.c``, ``stream.c`` and ``history.c`` of the native runtime mean: this is the one law of
clock and history in Python, for the other FMUs that hold Python as well. The oracle of the tests,
``tests/fmu/plain.py`` and ``plain_fmu.py``, deliberately does not use it: an oracle that shares
the code proves nothing.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SAME = 1e-6
"""In sample steps: what counts as rounding."""
SAME_TIME = 1e-9
"""Relative to a time: what counts as rounding in it."""
RESOLUTION = 1e-3
"""In sample steps: the largest rounding of a time, beyond which steps are blurred."""
SHORTEST = 1 / 32
"""In sample steps: with a zero-order hold a shorter step is joined to the one after it; with a
first-order hold steps are joined that are together not longer than twice that."""


class Clock:
    """The time of the present state: equal steps are counted, never accumulated. Final.

    Attributes:
        step: sample step h in s.
        anchor, stride: communication point and length, in s, of the first of the equal steps.
        count: their number.
        stop: time in s that no step may end after.
    """

    def __init__(self, step: float) -> None:
        self.step = step
        self.anchor, self.stride, self.count = 0.0, 0.0, 0
        self.stop = math.inf

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self.anchor + self.count * self.stride

    @property
    def farthest(self) -> float:
        """Largest distance from 0, in s, at which steps can be told apart."""
        return 2 * RESOLUTION * self.step / sys.float_info.epsilon

    def fault_of(self, point: float, length: float) -> str | None:
        """Say why a step of a length from a communication point, both in s, cannot be taken."""
        last = min(self.stride, self.step) if self.count else self.step
        slack = SAME * self.step + SAME_TIME * abs(self.time)
        if not abs(point - self.time) <= min(slack, last / 4):
            return (
                f"communication point {point:.15g} s; expected {self.time:.15g} s, the end of "
                "the last step"
            )
        step = f"communication step {length:.9g} s at {self.time:.9g} s"
        if not (length > 0 and math.isfinite(length)):
            return f"{step}: expected a positive, finite step"
        if abs(self.time + length) > self.farthest:
            return f"{step}: its end is so far from 0 that steps cannot be told apart there"
        if abs(self.time + length - self.time - length) > length / 4:
            return f"{step}: it is too small to be told apart from zero"
        if not self.time + length - self.stop <= slack:
            return f"{step} ends after the stop time {self.stop:.9g} s"
        return None

    def meant(self, length: float) -> tuple[float, int]:
        """Give the step that an importer means, in s, and its samples: 0 if it is no multiple."""
        count = round(length / self.step)
        rounding = 2 * sys.float_info.epsilon * abs(self.time)
        if count > 0 and abs(length - count * self.step) <= SAME * self.step + rounding:
            return count * self.step, count
        return length, 0

    def advance(self, point: float, length: float) -> None:
        """Count a step that was taken from a communication point, both in s."""
        if length != self.stride:
            self.anchor, self.stride, self.count = point, length, 0
        self.count += 1


class PastInputs:
    """The window and the communication steps behind it. Final.

    Args:
        n_samples: memory length in samples.
        step: sample step h in s.
        first_order: whether the inputs have a first-order hold; else they have a zero-order hold.

    Attributes:
        window: samples of the inputs, oldest first, shape (n_samples, n_inputs).
        steps: length in s and inputs of every step that is remembered, oldest first.
    """

    def __init__(self, n_samples: int, step: float, first_order: bool) -> None:
        self._n, self._h, self._first_order = n_samples, step, first_order
        self.window: FloatArray | None = None
        self.steps: list[tuple[float, list[float]]] = []

    def begin(self, inputs: list[float]) -> None:
        """Take over known inputs before the first step: they are a step of their own."""
        self.window = np.tile(inputs, (self._n, 1))
        self._remember(self._h, inputs)

    def take(self, length: float, count: int, inputs: list[float]) -> FloatArray:
        """Take in a step, as ``Clock.meant`` gives it, under these inputs; give the new window."""
        if self.window is None:
            self.window = np.tile(inputs, (self._n, 1))
            self._remember(length, inputs)
        elif 0 < count <= self._n:
            newest, reached = np.array(self.steps[-1][1]), np.array(inputs)
            left = (
                np.arange(count - 1.0, -1.0, -1.0)[:, None] / count if self._first_order else 0.0
            )
            added = reached - left * (reached - newest) + np.zeros((count, 1))
            self.window = np.concatenate([self.window[count:], added])
            self._remember(length, inputs)
        else:
            self._remember(length, inputs)
            self.window = self._sampled()
        return self.window

    def _remember(self, length: float, inputs: list[float]) -> None:
        if len(self.steps) > 1:
            before, held = self.steps[-1]
            if self._first_order:
                joins = before + length <= 2 * SHORTEST * self._h
            else:
                joins = before < SHORTEST * self._h or held == inputs
            if joins:
                self.steps.pop()
                length += before
        self.steps.append((length, list(inputs)))
        covered = sum(length for length, _ in self.steps[1:])
        while len(self.steps) > 2 and covered - self.steps[1][0] > (self._n + 1) * self._h:
            covered -= self.steps[1][0]
            # the one before those that cover the window is left: a first-order hold begins there
            del self.steps[0]

    def _sampled(self) -> FloatArray:
        """Form all samples anew, up to the end of the newest step."""
        inputs = np.array([row for _, row in self.steps])
        lengths = np.array([length for length, _ in self.steps])
        begins = -np.cumsum(lengths[::-1])[::-1]
        left = np.arange(self._n, 0, -1.0)
        times = -(left - 1) * self._h if self._first_order else -left * self._h + SAME * self._h
        at = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
        if not self._first_order:
            return np.asarray(inputs[at])
        part = np.clip((times - begins[at]) / lengths[at], 0.0, 1.0)[:, None]
        return np.asarray(inputs[at] - (1 - part) * (inputs[at] - inputs[np.maximum(at - 1, 0)]))
