"""Followers are the partners of loops in a run: each gives an input, which answers an output.

Values are in SI units, and relative to the middle of the input and to the output there at rest.
"""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.loop import Partner
from slide_fmu.recipe.loop_partner import OwnPartner
from slide_fmu.systems.base import Restorable, System, raised, read_only
from slide_fmu.systems.errors import LoadError, SimulationError

HOLDS = 1e-3
"""A system and a partner that answer less at rest than this part of the answer at once hold no
outer force."""
CHANGE = 1e-3
"""Change of an output, as a part of its range, by which the answer of a model is measured."""

T = TypeVar("T")


def called(system: System, method: str, call: Callable[..., T], *arguments: FloatArray) -> T:
    """Call a method of a system; what it raises is a SimulationError or a LoadError."""
    try:
        return call(*map(read_only, arguments))
    except (SimulationError, LoadError):
        raise
    except Exception as error:  # a user's method may raise anything
        raise SimulationError(raised(system, method, error)) from error


class Follower(abc.ABC):
    """A Follower goes from sample to sample. Interface: never instantiated.

    Attributes:
        slope: change of its answer at the end of a step over the change of the output there.
    """

    slope: float = 0.0

    @abc.abstractmethod
    def rest(self, value: float, output: float) -> float:
        """Return a better value of the input at which it rests with the system than ``value``."""

    @abc.abstractmethod
    def begin(self, value: float, output: float) -> None:
        """Rest at sample 0."""

    @abc.abstractmethod
    def answer(self, k: int, output: float) -> float:
        """Return the input at sample ``k`` where the output is likely to be this one there."""

    @abc.abstractmethod
    def reach(self, k: int, value: float, output: float) -> None:
        """Hear what input and output have become at sample ``k``."""


@dataclass(frozen=True)
class SystemAnswers:
    """SystemAnswers are those to a loop's input alone: at once, and at rest; and a step in s."""

    first: float
    lasting: float
    step: float


@final
class MovedMass(Follower):
    """A MovedMass is moved by the output and by an outer force, by the trapezoidal rule.

    Args:
        partner: mass, spring and damper.
        outer: displacements (N,) at which the outer force would hold it.
        answers: what the system answers to it.
    """

    def __init__(self, partner: Partner, outer: FloatArray, answers: SystemAnswers) -> None:
        self._partner, self._step, self._lasting = partner, answers.step, answers.lasting
        self._force = self._outer_force(outer, answers)
        h = self._step
        self._inertia = 2 * partner.mass / h**2 + partner.damping / h + 0.5 * partner.stiffness
        self.slope = 0.5 / self._inertia

    def rest(self, value: float, output: float) -> float:
        slope = self._lasting - self._partner.stiffness
        excess = output + self._force[0] - self._partner.stiffness * value
        return value - excess / slope if slope else value

    def begin(self, value: float, output: float) -> None:
        self._place, self._speed, self._output = value, 0.0, output

    def answer(self, k: int, output: float) -> float:
        h, m = self._step, self._partner.mass
        force = 0.5 * (self._output + output + self._force[k - 1] + self._force[k])
        moving = 2 * m / h * self._speed + force - self._partner.stiffness * self._place
        return float(self._place + moving / self._inertia)

    def reach(self, k: int, value: float, output: float) -> None:
        h, moved = self._step, value - self._place
        held = self._partner.stiffness * (self._place + 0.5 * moved)
        held += self._partner.damping * moved / h
        force = 0.5 * (self._output + output + self._force[k - 1] + self._force[k])
        self._speed += h / self._partner.mass * (force - held)
        self._place, self._output = value, output

    def _outer_force(self, outer: FloatArray, answers: SystemAnswers) -> FloatArray:
        """Return the outer force in N that moves it about as far as drawn, both (N,)."""
        partner, first, step = self._partner, abs(answers.first), answers.step
        stiffness = abs(answers.lasting) + partner.stiffness
        if stiffness > HOLDS * first:
            return outer * stiffness
        # nothing holds it: find how far it goes where dampers alone act
        kept = 1.0 / (1.0 + step * (partner.damping + first * step) / partner.mass)
        force = outer - outer[0]
        speed = place = farthest = 0.0
        for value in force:
            speed = kept * (speed + step / partner.mass * value)
            place += step * speed
            farthest = max(farthest, abs(place))
        return np.asarray(force * (np.abs(outer).max() / farthest if farthest else 1.0))


@final
class DeformedSpring(Follower):
    """A DeformedSpring with a damper is deformed by the output; its other end adds a force.

    Args:
        partner: spring and damper.
        outer: forces (N,) that the motion of its other end adds.
        answers: what the system answers to it.
    """

    def __init__(self, partner: Partner, outer: FloatArray, answers: SystemAnswers) -> None:
        self._partner, self._outer, self._answers = partner, outer, answers
        self._damping = partner.damping / answers.step
        self.slope = -(partner.stiffness + self._damping)

    def rest(self, value: float, output: float) -> float:
        stiffness = self._partner.stiffness
        excess = self._outer[0] - stiffness * output - value
        return float(value + excess / (1.0 + stiffness * self._answers.lasting))

    def begin(self, value: float, output: float) -> None:
        self._output = output

    def answer(self, k: int, output: float) -> float:
        return float(self._outer[k] + self.slope * output + self._damping * self._output)

    def reach(self, k: int, value: float, output: float) -> None:
        self._output = output


@final
class OwnModel(Follower):
    """An OwnModel is the partner model of the user, which steps with the system.

    One that can go back takes each step twice: first with the likely output, which shows its
    answer, then with that which came.

    Args:
        model: the partner.
        further: its other inputs, (N, n_further).
        middle: the middle of the system's input.
        rest: the output there at rest.
        width: width of the range of the output.
    """

    def __init__(
        self, model: OwnPartner, further: FloatArray, middle: float, rest: float, width: float
    ) -> None:
        self._model, self._further = model, further
        self._middle, self._rest, self._width = middle, rest, width
        system = model.system
        # an FMU begins anew to go back
        self._back = isinstance(system, Restorable) and not system.may_crash
        self._before: tuple[float, float] | None = None

    def rest(self, value: float, output: float) -> float:
        """By the secant through the last two values."""
        excess = self._begun(output) - value
        found = value + excess
        if self._before is not None and value != self._before[0]:
            slope = (excess - self._before[1]) / (value - self._before[0])
            found = value - excess / slope if slope else found
        self._before = value, excess
        return found

    def begin(self, value: float, output: float) -> None:
        self._begun(output)
        if self._back:
            self._state = self._restorable.get_state()
            change = CHANGE * self._width
            self.slope = (self.answer(0, output + change) - self.answer(0, output)) / change

    def answer(self, k: int, output: float) -> float:
        if self._back:
            self._restorable.set_state(self._state)
        return self._advanced(k, output)

    def reach(self, k: int, value: float, output: float) -> None:
        if self._back:
            self.answer(k, output)
            self._state = self._restorable.get_state()

    @property
    def _restorable(self) -> Restorable:
        assert isinstance(self._model.system, Restorable)
        return self._model.system

    def _inputs(self, k: int, output: float) -> FloatArray:
        found = np.empty(len(self._model.system.inputs))
        found[self._model.input] = self._rest + output
        found[list(self._model.further)] = self._further[k]
        return found

    def _begun(self, output: float) -> float:
        system = self._model.system
        called(system, "begin", system.begin, self._inputs(0, output))
        return self._given(called(system, "output", system.output))

    def _advanced(self, k: int, output: float) -> float:
        system = self._model.system
        return self._given(called(system, "advance", system.advance, self._inputs(k, output)))

    def _given(self, outputs: FloatArray) -> float:
        return float(outputs[self._model.output]) - self._middle
