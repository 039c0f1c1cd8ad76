"""This module draws inputs as they occur where an output of the system decides one of them.

The system is stepped together with a simple partner. Only the inputs are kept: the outputs are
simulated from them as from all others. So the steps need not couple both exactly. The partner is
implicit in what the system answers at once to its input, so it stays stable where it is light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind
from slide_fmu.excitation.loop import LoopRecipe, Partner
from slide_fmu.systems.base import Stepping, raised, read_only
from slide_fmu.systems.errors import LoadError, SimulationError

TRIES, SMALLER = 5, 0.5
"""Number of runs of a loop. Where one leaves the range of its input, the outer inputs of the next
one are this many times as large."""
SMALL = 0.01
"""A step that shows what the system answers at once, as a part of half the range of the input."""
HOLDS = 1e-3
"""A system and a partner that answer less at rest than this part of the answer at once hold no
outer force."""
SECANTS = 4
"""Largest number of steps by which the common state of rest is looked for."""


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains hold what a system answers to a small step of its input, in SI units.

    Attributes:
        first: change of the output by the end of the step in which the input changes, over the
            change of the input.
        second: its further change in the step after that.
        lasting: its change at rest.
        rest: output at rest, with all inputs in the middle of their ranges.
    """

    first: float
    second: float
    lasting: float
    rest: float


class ClosedLoop:
    """A ClosedLoop is a system with a loop around it. Final.

    Values inside are in SI units, and relative to the middle of the input and to the output there
    at rest.

    Args:
        loop: the table of a recipe.
        system: the system; both go by its sample step.

    Raises:
        ValueError: the loop does not fit the signals.
        SimulationError: the system failed.
    """

    def __init__(self, loop: LoopRecipe, system: Stepping) -> None:
        self._loop, self._system = loop, system
        self._at = loop.interface(system.inputs, system.outputs)
        self._middles = np.array([0.5 * (s.low + s.high) for s in system.inputs])
        self._signal = system.inputs[self._at.input]
        self._half = 0.5 * self._at.input_unit * (self._signal.high - self._signal.low)
        self._gains = Gains(0.0, 0.0, 0.0, 0.0)  # the output at rest is not known yet
        self._gains = self._measured()

    @property
    def gains(self) -> Gains:
        """What the system answers to a small step of its input."""
        return self._gains

    def inputs(
        self, outer: FloatArray, partner: Partner, parts: int = 1, factor: float = 1.0
    ) -> FloatArray:
        """Return the inputs of a run with a partner, (parts * N, n_inputs).

        Args:
            outer: drawn inputs, shape (parts * N, n_inputs). What is drawn for the loop's input is
                the displacement at which an outer force would hold the partner; or the force that
                a displacement of the partner's other end adds.
            partner: the partner.
            parts: number of moments in a sample step; the last one is that of the sample. Between
                samples, the input of the loop is a cubic spline.
            factor: the half range in which the loop's input must stay is multiplied by it.

        Raises:
            SimulationError: the input left its range in all tries, or the system failed.
        """
        self._require_stable(partner)
        column = self._at.input
        shares = np.ones_like(self._middles)
        shares[column] = partner.outer
        for attempt in range(TRIES):
            smaller = SMALLER**attempt
            inputs = self._middles + smaller * shares * (outer - self._middles)
            at_samples = inputs[parts - 1 :: parts].copy()
            left = self._run(at_samples, partner, factor * self._half)
            if left is None:
                inputs[:, column] = smooth(at_samples[:, column], parts)
                return np.asarray(inputs)
        raise SimulationError(
            f"in a loop with {self._loop.partner_words(self._at.turning, partner)}, input "
            f"{self._signal.name!r} leaves its range, {self._signal.low:g} .. "
            f"{self._signal.high:g}{behind(self._signal.unit)}, even where the outer inputs are "
            f"{1 / smaller:g} times smaller than in the other kinds",
            left,
        )

    def _run(self, inputs: FloatArray, partner: Partner, half: float) -> float | None:
        """Write the loop's input into its column, which holds the outer values before.

        Returns:
            The time in s at which it leaves its range; None if it does not.
        """
        outer = self._at.input_unit * (inputs[:, self._at.input] - self._middles[self._at.input])
        if self._at.force_out:
            outer = self._outer_force(outer, partner)
        follow = self._follow_mass if self._at.force_out else self._follow_spring
        motion = _Motion(self._start(inputs[0], outer[0], partner, half))
        self._write(inputs[0], motion.input)
        self._begin(inputs[0])
        motion.output = self._advanced(inputs[0])
        for k in range(1, len(inputs)):
            before = motion.output
            value, finish = follow(motion, partner, outer[k - 1], outer[k])
            if not abs(value) <= half:  # or it is not a number
                return k * self._system.step
            self._write(inputs[k], value)
            motion.output = self._advanced(inputs[k])
            motion.change, motion.input = value - motion.input, value
            motion.speed += finish * 0.5 * (motion.output + before)
        return None

    def _outer_force(self, outer: FloatArray, partner: Partner) -> FloatArray:
        """Return the outer force in N that moves a partner about as far as drawn, both (N,)."""
        gains, step = self._gains, self._system.step
        stiffness = abs(gains.lasting) + partner.stiffness
        if stiffness > HOLDS * abs(gains.first):
            return outer * stiffness
        # nothing holds it: find how far it goes where dampers alone act
        kept = 1.0 / (1.0 + step * (partner.damping + abs(gains.first) * step) / partner.mass)
        force = outer - outer[0]
        speed = place = farthest = 0.0
        for value in force:
            speed = kept * (speed + step / partner.mass * value)
            place += step * speed
            farthest = max(farthest, abs(place))
        return np.asarray(force * (np.abs(outer).max() / farthest if farthest else 1.0))

    def _follow_mass(
        self, motion: _Motion, partner: Partner, outer: float, next_outer: float
    ) -> tuple[float, float]:
        """Move a mass by one step of the trapezoidal rule, with the force that is to be expected.

        Its speed lacks the mean force of the system, which is known after the step.

        Returns:
            The input, and the change of speed by a force.
        """
        h, m, gains = self._system.step, partner.mass, self._gains
        away = motion.place - motion.input
        expected = motion.output + gains.second * motion.change + gains.first * away
        force = 0.5 * (motion.output + expected + outer + next_outer)
        inertia = 2 * m / h**2 + partner.damping / h + 0.5 * partner.stiffness
        moved = 2 * m / h * motion.speed + force - partner.stiffness * motion.place
        moved /= inertia - 0.5 * gains.first
        held = partner.stiffness * (motion.place + 0.5 * moved) + partner.damping * moved / h
        motion.speed += h / m * (0.5 * (outer + next_outer) - held)
        motion.place += moved
        return motion.place, h / m

    def _follow_spring(
        self, motion: _Motion, partner: Partner, outer: float, next_outer: float
    ) -> tuple[float, float]:
        """Return the force of a spring and damper at the end of a step, as in ``_follow_mass``."""
        damping = partner.damping / self._system.step
        carried = self._gains.second * motion.change
        force = next_outer - partner.stiffness * (motion.output + carried) - damping * carried
        stiff = 1.0 + (partner.stiffness + damping) * self._gains.first
        return motion.input + (force - motion.input) / stiff, 0.0

    def _start(self, row: FloatArray, outer: float, partner: Partner, half: float) -> float:
        """Look for the input under which system and partner rest, in its range."""
        lasting, stiffness = self._gains.lasting, partner.stiffness
        slope = lasting - stiffness if self._at.force_out else -1.0 - stiffness * lasting
        held, value = row.copy(), 0.0
        for _ in range(SECANTS if slope else 0):
            self._write(held, value)
            output = self._begin(held)
            excess = (
                output + outer - stiffness * value
                if self._at.force_out
                else outer - stiffness * output - value
            )
            value = min(max(value - excess / slope, -half), half)
        return value

    def _measured(self) -> Gains:
        """Measure what the system answers to a small step in the middle of all ranges."""
        small = SMALL * self._half
        stepped = self._middles.copy()
        self._write(stepped, small)
        runs = []
        for row in (self._middles, stepped):  # one that does not begin at rest moves in both
            rest = self._begin(self._middles)
            self._advanced(self._middles)
            runs.append([self._advanced(row), self._advanced(row)])
        first, second = (np.array(runs[1]) - runs[0]) / small
        lasting = (self._begin(stepped) - rest) / small
        return Gains(float(first), float(second - first), lasting, rest)

    def _require_stable(self, partner: Partner) -> None:
        """Refuse a loop in which an answer drives its cause on."""
        gains = self._gains
        if self._at.force_out:
            held = partner.stiffness - gains.lasting
            at_once = partner.mass / self._system.step**2 - gains.first
            remedy = "the force on the partner, which pushes it back"
        else:
            held = 1.0 + partner.stiffness * gains.lasting
            at_once = 1.0 + partner.stiffness * gains.first
            remedy = "the displacement along the force that is the input"
        if min(held, at_once) < 0.0:
            raise SimulationError(
                f"in a loop with {self._loop.partner_words(self._at.turning, partner)}, output "
                f"{self._loop.output!r} drives input {self._loop.input!r} on and on; expected "
                f"{remedy}: give the output the other sign, or a stiffer partner",
                0.0,
            )

    def _write(self, row: FloatArray, value: float) -> None:
        """Write the loop's input into a row of inputs, (n_inputs,); rounding keeps the range."""
        column = self._at.input
        row[column] = self._middles[column] + value / self._at.input_unit

    def _begin(self, held: FloatArray) -> float:
        """Go to the start under constant inputs, (n_inputs,); return the output."""
        try:
            self._system.begin(read_only(held))
            found = self._system.output()
        except (SimulationError, LoadError):
            raise
        except Exception as error:  # a user's method may raise anything
            raise SimulationError(raised(self._system, "begin", error), 0.0) from error
        return self._output_of(found)

    def _advanced(self, row: FloatArray) -> float:
        """Go on by one step; return the output."""
        try:
            found = self._system.advance(read_only(row))
        except (SimulationError, LoadError):
            raise
        except Exception as error:  # as above
            raise SimulationError(raised(self._system, "advance", error)) from error
        return self._output_of(found)

    def _output_of(self, outputs: FloatArray) -> float:
        value = float(outputs[self._at.output])
        if not math.isfinite(value):
            raise SimulationError(
                f"in a loop, output {self._loop.output!r} becomes {value}; expected finite "
                "numbers: correct the model, or narrow the ranges of the partner"
            )
        return self._at.output_unit * value - self._gains.rest


class _Motion:
    """A _Motion is the state of a run: place and speed of the partner, and the last signals."""

    def __init__(self, start: float) -> None:
        self.place = self.input = start
        self.speed = self.change = self.output = 0.0


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
