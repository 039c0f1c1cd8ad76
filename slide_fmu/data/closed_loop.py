"""This module draws inputs as they occur where outputs of the system decide some of them.

The system is stepped together with its partners. Only the inputs are kept: the outputs are
simulated from them as from all others. So the steps need not couple both exactly. The partners
are implicit in what the system answers at once, so they stay stable where they are light.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind
from slide_fmu.data.followers import (
    DeformedSpring,
    Follower,
    MovedMass,
    OwnModel,
    SystemAnswers,
    called,
)
from slide_fmu.excitation.loop import LoopRecipe, Partner
from slide_fmu.recipe.loop_partner import own_partner
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.errors import LoadError, SimulationError

TRIES, SMALLER = 5, 0.5
"""Number of runs of a loop. Where one leaves the range of its input, the outer inputs of the next
one are this many times as large."""
SMALL = 0.01
"""A step that shows what the system answers at once, as a part of half the range of the input."""
TURNS = 4
"""Largest number of steps by which the common state of rest is looked for."""
LEAST, LATER = 1e-6, 400
"""Least change of an output when its input goes through its range, as a share of its own. It is
looked for in this number of samples."""
NEARLY_NONE = 1e-3
"""Outer inputs that are this many times as large should not move a model out of its range."""


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains hold what a system answers to small steps of the loops' inputs, in SI units.

    Attributes:
        first: change of each output by the end of the step in which an input changes, over the
            change of the input, (n_loops, n_loops), inputs last.
        second: their further change in the step after that, likewise.
        lasting: change of each output at rest, by its own input, (n_loops,).
        rest: outputs at rest, with all inputs in the middle of their ranges, (n_loops,).
    """

    first: FloatArray
    second: FloatArray
    lasting: FloatArray
    rest: FloatArray


@final
class ClosedLoop:
    """A ClosedLoop is a system with loops around it, each with a partner.

    Values inside are in SI units, and relative to the middles of the inputs and to the outputs
    there at rest.

    Args:
        closed: tables of a recipe, whose inputs differ, with a partner each.
        system: the system; both go by its sample step.

    Raises:
        LoadError: a partner cannot be made, or an output does not follow its input.
        ValueError: a loop does not fit the signals.
        SimulationError: the system failed.
    """

    def __init__(self, closed: Sequence[tuple[LoopRecipe, Partner]], system: Stepping) -> None:
        self._loops, self._partners = zip(*closed, strict=True)
        self._system = system
        self._at = [loop.interface(system.inputs, system.outputs) for loop in self._loops]
        self._middles = np.array([0.5 * (s.low + s.high) for s in system.inputs])
        self._columns = [at.input for at in self._at]
        self._signals = [system.inputs[column] for column in self._columns]
        widths = zip(self._at, self._signals, strict=True)
        self._half = np.array([0.5 * at.input_unit * (s.high - s.low) for at, s in widths])
        self._models = [
            None if loop.partner is None else own_partner(loop, system, partner.own)
            for loop, partner in closed
        ]
        none = np.zeros(len(closed))
        self._gains = Gains(np.diag(none), np.diag(none), none, none)  # no output is known yet
        self._gains = self._measured()

    @property
    def gains(self) -> Gains:
        """What the system answers to small steps of the loops' inputs."""
        return self._gains

    def inputs(
        self,
        outer: FloatArray,
        parts: int = 1,
        factor: float = 1.0,
        draw: Callable[[], FloatArray] | None = None,
    ) -> FloatArray:
        """Return the inputs of a run with the partners, (parts * N, n_inputs).

        Args:
            outer: drawn inputs, shape (parts * N, n_inputs). What is drawn for a loop's input is
                the displacement at which an outer force would hold the partner; or the force that
                a displacement of the partner's other end adds; or another input of a model.
            parts: number of moments in a sample step; the last one is that of the sample. Between
                samples, the inputs of the loops are cubic splines.
            factor: the half range in which a loop's input must stay is multiplied by it.
            draw: draws such inputs again, for models with several other inputs.

        Raises:
            SimulationError: an input left its range in all tries, or the system failed.
        """
        self._require_stable()
        shares = np.ones_like(self._middles)
        shares[self._columns] = [partner.outer for partner in self._partners]
        further = [self._further(k, outer, parts, draw) for k in range(len(self._loops))]
        left = None
        for smaller in SMALLER ** np.arange(TRIES):
            inputs = self._middles + smaller * shares * (outer - self._middles)
            at_samples = inputs[parts - 1 :: parts].copy()
            left = self._run(at_samples, further, smaller, factor)
            if left is None:
                for column in self._columns:
                    inputs[:, column] = smooth(at_samples[:, column], parts)
                return np.asarray(inputs)
        assert left is not None
        k, time = left
        raise SimulationError(
            f"{self._place(k)}, input {self._signals[k].name!r} leaves its range, "
            f"{self._signals[k].low:g} .. {self._signals[k].high:g}"
            f"{behind(self._signals[k].unit)}, even where the outer inputs are {1 / smaller:g} "
            f"times smaller than in the other kinds{self._by_itself(outer, further, parts)}",
            time,
        )

    def _by_itself(self, outer: FloatArray, further: Sequence[FloatArray], parts: int) -> str:
        """Say that a model leaves the range although hardly anything drives it."""
        inputs = self._middles + NEARLY_NONE * (outer[parts - 1 :: parts] - self._middles)
        if not any(self._models) or self._run(inputs, further, NEARLY_NONE, 1.0) is None:
            return ""
        return (
            f", and even where they are {1 / NEARLY_NONE:g} times smaller: the loop is unstable, "
            "or does not rest in the range; expected an answer that stays in it: correct the "
            "sign, the start or the damping of the partner, or widen the range"
        )

    def _place(self, k: int) -> str:
        words = self._loops[k].partner_words(self._at[k].turning, self._partners[k])
        return f"in a loop with {words}"

    def _further(
        self, k: int, outer: FloatArray, parts: int, draw: Callable[[], FloatArray] | None
    ) -> FloatArray:
        """Return what is drawn for the other inputs of a model, about their middles, (N, m)."""
        model, column, signal = self._models[k], self._columns[k], self._signals[k]
        found = [np.empty((len(outer) // parts, 0))]
        for number, channel in enumerate(() if model is None else model.further):
            assert model is not None
            drawn = draw() if number and draw is not None else outer
            if len(drawn) == len(outer):
                drawn = drawn[parts - 1 :: parts]
            other = model.system.inputs[channel]
            wider = (other.high - other.low) / (signal.high - signal.low)
            away = wider * (drawn[:, [column]] - self._middles[column])
            found.append(self._partners[k].outer * away)
        return np.hstack(found)

    def _run(
        self, inputs: FloatArray, further: Sequence[FloatArray], smaller: float, factor: float
    ) -> tuple[int, float] | None:
        """Write the loops' inputs into their columns, which hold the outer values before.

        Returns:
            The loop that leaves its range, and the time in s; None if none does.
        """
        half = factor * self._half
        followers = [
            self._follower(k, inputs[:, column], smaller * further[k])
            for k, column in enumerate(self._columns)
        ]
        values = self._rest(inputs[0], followers, half)
        outputs = self._advanced(inputs[0])
        for one, value, output in zip(followers, values, outputs, strict=True):
            one.begin(value, output)
        first, second = self._gains.first, self._gains.second
        slopes = np.array([one.slope for one in followers])
        solved = np.linalg.inv(self._at_once(first * slopes))
        change = np.zeros_like(values)
        for k in range(1, len(inputs)):
            carried = outputs + second @ change
            likely = carried + first @ change
            answers = [one.answer(k, y) for one, y in zip(followers, likely, strict=True)]
            offsets = answers - slopes * likely
            ends = solved @ (carried + first @ (offsets - values))  # outputs at the step's end
            found = offsets + slopes * ends
            left = ~(np.abs(found) <= half)  # or it is not a number
            if left.any():
                return int(np.argmax(left)), k * self._system.step
            self._write(inputs[k], found)
            outputs = self._advanced(inputs[k])
            for one, value, output in zip(followers, found, outputs, strict=True):
                one.reach(k, value, output)
            change, values = found - values, found
        return None

    def _follower(self, k: int, outer: FloatArray, further: FloatArray) -> Follower:
        """Return a partner, with outer values of its input (N,) and of a model's others (N, m)."""
        at, model, gains = self._at[k], self._models[k], self._gains
        middle = self._middles[at.input]
        if model is not None:
            others = [model.system.inputs[channel] for channel in model.further]
            further = further + np.array([0.5 * (s.low + s.high) for s in others])
            output = self._system.outputs[at.output]
            return OwnModel(model, further, middle, gains.rest[k], output.high - output.low)
        answers = SystemAnswers(gains.first[k, k], gains.lasting[k], self._system.step)
        kind = MovedMass if at.force_out else DeformedSpring
        return kind(self._partners[k], at.input_unit * (outer - middle), answers)

    def _rest(
        self, row: FloatArray, followers: Sequence[Follower], half: FloatArray
    ) -> FloatArray:
        """Look for the inputs under which system and partners rest, in their ranges.

        The system is then there, and the row (n_inputs,) has the inputs.
        """
        values = np.zeros(len(followers))
        for _ in range(TURNS):
            self._write(row, values)
            pairs = zip(followers, values, self._begin(row), strict=True)
            better = np.array([one.rest(value, output) for one, value, output in pairs])
            better = np.minimum(np.maximum(better, -half), half)
            if np.array_equal(better, values):
                return values
            values = better
        self._write(row, values)
        self._begin(row)
        return values

    def _measured(self) -> Gains:
        """Measure what the system answers to small steps in the middle of all ranges."""
        small, middles = SMALL * self._half, self._middles
        rest = self._begin(middles)
        still = self._two_steps(middles)  # one that does not begin at rest moves too
        first, second = np.empty((2, len(small), len(small)))
        lasting = np.empty(len(small))
        for k, size in enumerate(small):
            stepped = middles.copy()
            self._write(stepped, np.where(np.arange(len(small)) == k, size, 0.0))
            answer = (self._two_steps(stepped) - still) / size
            first[:, k], second[:, k] = answer[0], answer[1] - answer[0]
            lasting[k] = (self._begin(stepped)[k] - rest[k]) / size
            changes = np.abs([*answer[:, k], lasting[k]])
            if not changes.max() > self._least(k):
                self._require_answer(k)
        return Gains(first, second, lasting, rest)

    def _two_steps(self, row: FloatArray) -> FloatArray:
        """Return the outputs after each of two steps under inputs (n_inputs,), (2, n_loops)."""
        self._begin(self._middles)
        self._advanced(self._middles)
        return np.array([self._advanced(row), self._advanced(row)])

    def _least(self, k: int) -> float:
        """Return the answer below which an output counts as one that does not follow."""
        signal = self._system.outputs[self._at[k].output]
        width = self._at[k].output_unit * (signal.high - signal.low)
        return float(LEAST * width / (2.0 * self._half[k]))

    def _require_answer(self, k: int) -> None:
        """Refuse an output that does not follow its input, even after large and long steps."""
        signal, runs = self._signals[k], []
        for value in (self._middles[self._columns[k]], signal.low, signal.high):
            row = self._middles.copy()
            self._begin(row)
            row[self._columns[k]] = value
            runs.append([self._advanced(row)[k] for _ in range(LATER)])
        change = float(np.abs(np.array(runs[1:]) - runs[0]).max())
        if not change > self._least(k) * self._half[k]:
            loop = self._loops[k]
            raise LoadError(no_answer(f"[[loop]] of {loop.output!r} and {loop.input!r}", change))

    def _require_stable(self) -> None:
        """Refuse loops with simple partners in which an answer drives its cause on."""
        for k, (at, partner) in enumerate(zip(self._at, self._partners, strict=True)):
            lasting, first = self._gains.lasting[k], self._gains.first[k, k]
            if self._models[k] is not None:
                continue
            if at.force_out:
                held = partner.stiffness - lasting
                at_once = partner.mass / self._system.step**2 - first
                remedy = "the force on the partner, which pushes it back"
            else:
                held = 1.0 + partner.stiffness * lasting
                at_once = 1.0 + partner.stiffness * first
                remedy = "the displacement along the force that is the input"
            if min(held, at_once) < 0.0:
                raise self._driven_on(k, remedy)

    def _at_once(self, gains: FloatArray) -> FloatArray:
        """Return I - G of the gains round the loops in one step; refuse such as drive on."""
        found = np.eye(len(gains)) - gains
        if not np.linalg.det(found) > 0.0:
            worst = int(np.argmax(np.diag(gains)))
            raise self._driven_on(worst, "a gain below 1 round the loop in one step")
        return found

    def _driven_on(self, k: int, expected: str) -> SimulationError:
        return SimulationError(
            f"{self._place(k)}, output {self._loops[k].output!r} drives input "
            f"{self._loops[k].input!r} on and on; expected {expected}: give the output the other "
            "sign, or a stiffer partner",
            0.0,
        )

    def _write(self, row: FloatArray, values: FloatArray) -> None:
        """Write the loops' inputs into a row of inputs, (n_inputs,); rounding keeps ranges."""
        for at, value in zip(self._at, values, strict=True):
            row[at.input] = self._middles[at.input] + value / at.input_unit

    def _begin(self, held: FloatArray) -> FloatArray:
        """Go to the start under constant inputs, (n_inputs,); return the outputs, (n_loops,)."""
        called(self._system, "begin", self._system.begin, held)
        return self._outputs(called(self._system, "output", self._system.output))

    def _advanced(self, row: FloatArray) -> FloatArray:
        """Go on by one step; return the outputs, (n_loops,)."""
        return self._outputs(called(self._system, "advance", self._system.advance, row))

    def _outputs(self, outputs: FloatArray) -> FloatArray:
        values = np.array([float(outputs[at.output]) for at in self._at])
        if not np.isfinite(values).all():
            k = int(np.argmin(np.isfinite(values)))
            raise SimulationError(
                f"in a loop, output {self._loops[k].output!r} becomes {values[k]}; expected "
                "finite numbers: correct the model, or narrow the ranges of the partner"
            )
        sizes = np.array([at.output_unit for at in self._at])
        return np.asarray(sizes * values - self._gains.rest)


def no_answer(label: str, change: float) -> str:
    """Say that an output does not follow its input; the label begins the message."""
    return (
        f"{label}: the output changes by {change:.2g} (SI units) where the input goes through its "
        f"range; expected at least {LEAST:g} of the output's range: name an output that follows "
        "the input"
    )


def _moments(count: int, parts: int) -> FloatArray:
    """Return the ends of the parts of all steps, in steps, from sample 0, (parts * count,)."""
    return np.maximum((np.arange(parts * count) + 1 - parts) / parts, 0.0)


def straight(inputs: FloatArray, parts: int) -> FloatArray:
    """Return inputs that go straight from sample to sample at finer moments, (parts * N, n)."""
    if parts == 1:
        return inputs
    samples, at = np.arange(len(inputs), dtype=np.float64), _moments(len(inputs), parts)
    return np.stack([np.interp(at, samples, column) for column in inputs.T], axis=1)


def smooth(values: FloatArray, parts: int) -> FloatArray:
    """Return values (N,) at finer moments, (parts * N,), on a cubic spline through the samples."""
    if parts == 1 or len(values) < 2:
        return np.repeat(values, parts)
    from scipy.interpolate import CubicSpline  # slow to import

    at = _moments(len(values), parts)
    return np.asarray(CubicSpline(np.arange(len(values)), values)(at))
