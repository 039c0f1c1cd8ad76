"""Methods take a step of a coupled system: explicit ones at once, implicit ones repeatedly."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple, final

import numpy as np

from slide_fmu.apps.couple.component import StepOutputs
from slide_fmu.apps.couple.loop import Loop
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError

FIRST_RELAXATION = 0.5
"""Part of its correction that the fixed point takes first; Aitken's rule finds the next ones."""

SLOW = 3
"""Iterations of a step after which Newton's method measures its derivatives again."""


CLEAR = 10.0
"""Corrections smaller than this number of tolerances show rounding rather than derivatives."""


class Solution(NamedTuple):
    """A Solution has the outputs of a step, the linked inputs, and the number of iterations.

    ``guess`` are the linked inputs that an explicit step would have taken; ``given`` are those
    that the outputs give. Implicit steps continue from these; of explicit ones, they are known
    once outputs have settled, and tell how far ``inputs`` were wrong.
    """

    stepped: StepOutputs
    inputs: FloatArray
    iterations: int
    guess: FloatArray
    given: FloatArray


class Method(ABC):
    """A Method takes one step. Interface: never instantiated.

    Attributes:
        settles: whether outputs that follow held inputs are read again at the end of a step, with
            the inputs of that time; without it they belong to the middle of the step.
    """

    settles = True

    @abstractmethod
    def step(self, loop: Loop, time: float, length: float) -> Solution:
        """Take a step from a time, both in s; ``Loop.accept`` then goes on."""


@final
class Explicit(Method):
    """An Explicit method takes each component through one step.

    Args:
        sequential: whether a component sees the new outputs of those before it (Gauss-Seidel);
            otherwise all see the former outputs (Jacobi).
        linear: whether unknown inputs continue linearly; otherwise they are held.
    """

    def __init__(self, sequential: bool, linear: bool) -> None:
        self._sequential, self._linear = sequential, linear
        self.settles = linear  # held values are those of other masters, to rounding

    def step(self, loop: Loop, time: float, length: float) -> Solution:
        """Take a step, in the order of the components."""
        now, stepped, all_ = loop.continued(length, self._linear), loop.empty(), loop.components
        onward = 0.5 * loop.change(length)
        guess = now.copy()
        if not self._sequential:
            loop.step(range(len(all_)), time, length, now, stepped)
            return Solution(stepped, now, 1, guess, now)
        before, waits = loop.values(loop.outputs), ~loop.discrete
        for k in range(len(all_)):
            loop.step([k], time, length, now, stepped)
            part, waits[loop.places[k]] = loop.parts[k], False
            known = np.array([part.start <= source < part.stop for source in loop.sources], bool)
            new = loop.values(stepped.end)
            # an output that follows held inputs belongs to the middle of the step
            of_middle = np.where(loop.held, new, new + onward)
            of_end = np.where(loop.held, 0.5 * (before + new), new)
            better = np.where(loop.following, of_middle, of_end) if self._linear else new
            now = np.where(known & waits, better, now)
        return Solution(stepped, now, 1, guess, now)


class EndlessError(CoSimulationError):
    """An EndlessError tells that iterations of a step do not come to an end."""


class _Trial(NamedTuple):
    """A _Trial is one iteration of a step: what was tried, and how far it is from agreement."""

    time: float
    length: float
    states: dict[int, object]
    now: FloatArray
    stepped: StepOutputs
    left: FloatArray
    number: int


@final
class Implicit(Method):
    """An Implicit method repeats a step until outputs and linked inputs agree.

    Components that cannot go back take the step once, with inputs that continue linearly.

    Args:
        newton: whether corrections come from derivatives; otherwise from Aitken's relaxation.
        tolerance: largest difference that is left, as a part of the size of an input.
        most: largest number of iterations of a step.
    """

    def __init__(self, newton: bool, tolerance: float, most: int) -> None:
        self._newton, self._tolerance, self._most = newton, tolerance, most
        self._jacobian: FloatArray | None = None
        self._length = 0.0
        self._left: FloatArray = np.zeros(0)
        self._last: FloatArray = np.zeros(0)

    def step(self, loop: Loop, time: float, length: float) -> Solution:
        """Take a step.

        Raises:
            EndlessError: the iterations do not come to an end.
        """
        back = [k for k, one in enumerate(loop.components) if one.rolls_back]
        once = [k for k, one in enumerate(loop.components) if not one.rolls_back]
        now, stepped = loop.guess(length), loop.empty(slopes=self._newton)
        guess, free = now.copy(), np.zeros(len(now), dtype=bool)
        for k in back:
            free[loop.places[k]] = True
        once.sort(key=lambda k: len(loop.components[k].linked) > 0)  # sources come first
        now = self._evaluate(loop, once, (time, length), now, stepped, in_turn=True)
        states = loop.save(back)
        try:
            for number in range(1, self._most + 1):
                if number > 1:
                    loop.restore(states)
                now = self._evaluate(
                    loop, back, (time, length), now, stepped, in_turn=not self._newton
                )
                given = loop.given(stepped)
                left = np.where(free, now - given, 0.0)
                if number == 1:  # without a solution, later iterates grow beyond all bounds
                    largest = np.maximum(loop.motions_with(now), loop.motions_with(given))
                moving = largest > loop.rounding  # others may rest until signals reach them
                size = np.minimum(loop.motions_with(now), np.where(moving, largest, np.inf))
                allowed = self._tolerance * size
                if np.all(np.abs(left) <= np.maximum(allowed, loop.rounding)):
                    if number > SLOW:
                        self._jacobian = None
                    return Solution(stepped, now, number, guess, np.where(free, now, given))
                trial = _Trial(time, length, states, now, stepped, left, number)
                change = self._newtons(loop, trial) if self._newton else self._relaxed(loop, trial)
                now = now + np.where(free, change, 0.0)
        finally:
            loop.free(states)
        raise _endless(loop, trial, self._newton)

    @staticmethod
    def _evaluate(
        loop: Loop,
        which: list[int],
        when: tuple[float, float],
        now: FloatArray,
        stepped: StepOutputs,
        in_turn: bool,
    ) -> FloatArray:
        """Take a step with some components, and return the linked inputs that were used.

        In turn, each of them sees the new outputs of those before it.
        """
        if not in_turn:
            loop.step(which, *when, now, stepped)
            return now
        waits = np.ones(len(now), dtype=bool)
        for k in which:
            loop.step([k], *when, now, stepped)
            part, waits[loop.places[k]] = loop.parts[k], False
            new = np.array([part.start <= source < part.stop for source in loop.sources], bool)
            now = np.where(waits & new, loop.given(stepped), now)
        return now

    def _newtons(self, loop: Loop, trial: _Trial) -> FloatArray:
        """Return Newton's correction; derivatives are kept, and updated as Broyden does."""
        stale = trial.number > 1 and trial.number % SLOW == 1
        if self._jacobian is None or self._length != trial.length or stale:
            self._jacobian, self._length = self._derivatives(loop, trial), trial.length
        elif trial.number > 1:
            weighted = self._last / _sizes(loop) ** 2
            square = float(weighted @ self._last)
            if square > (CLEAR * self._tolerance) ** 2:
                rise = trial.left - self._left - self._jacobian @ self._last
                self._jacobian = self._jacobian + np.outer(rise, weighted) / square
        try:
            change = np.asarray(-np.linalg.solve(self._jacobian, trial.left), np.float64)
        except np.linalg.LinAlgError as error:  # the inputs may be anything, or nothing
            raise _endless(loop, trial, self._newton) from error
        self._left, self._last = trial.left, change
        return change

    @staticmethod
    def _derivatives(loop: Loop, trial: _Trial) -> FloatArray:
        """Return the derivatives of what is left, by the linked inputs."""
        own = [k for k in trial.states if loop.components[k].has_slopes(trial.length)]
        others = [k for k in trial.states if k not in own]
        loop.restore(trial.states)
        loop.step(own, trial.time, trial.length, trial.now, trial.stepped, slopes=True)
        loop.difference(others, trial.time, trial.length, trial.now, trial.stepped)
        return np.asarray(np.eye(len(trial.now)) - loop.slopes(trial.stepped))

    def _relaxed(self, loop: Loop, trial: _Trial) -> FloatArray:
        """Return Aitken's correction."""
        left = trial.left / _sizes(loop)
        if trial.number == 1:
            self._part = FIRST_RELAXATION
        else:
            change = left - self._left
            if (square := float(change @ change)) > 0:
                self._part *= -float(self._left @ change) / square
        self._left = left
        return -self._part * trial.left


def _sizes(loop: Loop) -> FloatArray:
    return np.where(loop.sizes > 0, loop.sizes, 1.0)


def _endless(loop: Loop, trial: _Trial, newton: bool) -> EndlessError:
    worst = int(np.argmax(np.abs(trial.left) / _sizes(loop)))
    owner = next(k for k, place in enumerate(loop.places) if place.start <= worst < place.stop)
    one = loop.components[owner]
    name = f"{one.name}.{one.linked[worst - loop.places[owner].start]}"
    return EndlessError(
        f"step of {trial.length:g} s from {trial.time:.9g} s: {name} and its source differ by "
        f"{trial.left[worst]:.3g} after {trial.number} iterations; expected agreement: choose "
        f"{'' if newton else 'the method newton, '}a shorter step or a larger "
        "tolerance, if there is a solution at all"
    )
