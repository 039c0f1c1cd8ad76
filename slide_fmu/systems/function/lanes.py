"""Many motions of one model are integrated at once, each in a lane of its own.

A lane takes its own steps, and goes from sample to sample without waiting for the others. Where
one cannot go on it is left at the sample before, and the others lose nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Beginning, State
from slide_fmu.systems.declared import Parameters
from slide_fmu.systems.function.courses import Course, Intervals
from slide_fmu.systems.function.integration import MOST_STEPS, Solver
from slide_fmu.systems.function.lane_steps import LaneSteps
from slide_fmu.systems.function.user_function import FunctionError, UserFunction

WIDTH = 16
"""Numbers of lanes are multiples of this: there the order of sums, and what numpy makes of
vectors, do not depend on the number."""
BLOCK = 256
"""This number of intervals of a lane's inputs is prepared at once."""
CHECKED, SAME = 64, 1e-9
"""After so many steps the rates of one lane are compared with those of a single call. They may
differ by this part of the largest ones."""


class LaneError(Exception):
    """A function gives other numbers for many lanes at once than for each alone."""


@dataclass(frozen=True, eq=False)
class LaneModel:
    """A LaneModel has the functions of a model, which accept many lanes.

    Attributes:
        f, g: the rates and the outputs.
        step: sample step h in s.
        solver: an explicit one.
        varied: names of the parameters that differ from lane to lane.
        width: the number of lanes with which f is always called; None where it may be any multiple
            of ``WIDTH``.
        together: whether f and g accept many states at once; else they are called for each lane
            alone, which still saves the work of a step for each.
        sizes: the largest rates where f was tried, (n,): at rest all rates are rounding.
    """

    f: UserFunction
    g: UserFunction
    step: float
    solver: Solver
    varied: Collection[str]
    width: int | None
    together: bool = True
    sizes: FloatArray | None = None


@final
class Lane:
    """A Lane has one motion, and its outputs so far.

    Attributes:
        course: the inputs of the motion.
        p: its parameters.
        state: the state at the last sample whose outputs are known, (n,).
        outputs: outputs at the samples, (N + 1, n_outputs); those of ``known`` are there.
        left: whether it cannot go on.
    """

    def __init__(
        self,
        course: Course,
        p: Parameters,
        start: State,
        outputs: FloatArray,
        every: int | None = None,
    ) -> None:
        """Begin at a state with outputs, (n_outputs,); keep some states on the way."""
        self.course, self.p, self.left = course, p, False
        self._every, self._kept = every, list[State]()
        self.outputs = np.empty((len(course.motion.inputs) + 1, len(outputs)))
        self.outputs[0], self.known = outputs, 1
        self.state = start.coordinates
        self._rate, self._first = start.input_rate, 0
        self._block: Intervals | None = None

    def load(self) -> Intervals | None:
        """Give the next intervals of the motion; None at its end."""
        first, self._block = self._first, None
        if first == len(self.course):
            return None
        self._first = min(first + BLOCK, len(self.course))
        self._block = self.course.intervals(first, self._first)
        return self._block

    def close(self, g: UserFunction, together: bool, states: FloatArray) -> None:
        """Find the outputs at the states since the last known ones, (K, n), by their function."""
        number, first = len(states), self.known - 1
        if self._block is None or not number:
            return
        rates = self._block.rates_at_ends(self.course.step)[:number]
        reached = self.course.motion.inputs[first : first + number]
        outputs = _outputs(g, together, (states, reached, rates), self.p)
        finite = np.isfinite(outputs).all(axis=1)
        good = number if finite.all() else int(np.argmin(finite))
        self.left = self.left or good < number
        self.outputs[self.known : self.known + good] = outputs[:good]
        if self._every is not None:
            wanted = range(-self.known % self._every, good, self._every)
            none = np.zeros(0)
            self._kept += [State(states[k].copy(), none, reached[k], rates[k]) for k in wanted]
        self.known += good
        if good:
            self.state, self._rate = states[good - 1].copy(), rates[good - 1]

    def beginning(self) -> Beginning:
        """Give the motion as far as it is known."""
        k = self.known - 1
        last = self.course.motion.inputs[k - 1] if k else self.course.before
        state = State(self.state, np.zeros(0), last.copy(), self._rate)
        return Beginning(self.outputs[: self.known], state, self._kept)


def of_lanes(each: Sequence[Parameters], varied: Collection[str]) -> Parameters:
    """Return parameters of B lanes as one, of which those that vary are arrays, (B,)."""
    arrays = {
        name: np.array([vars(one)[name] for one in each], dtype=np.float64) for name in varied
    }
    return Parameters(**{**vars(each[0]), **arrays})


def _outputs(
    g: UserFunction,
    together: bool,
    points: tuple[FloatArray, FloatArray, FloatArray],
    p: Parameters,
) -> FloatArray:
    """Give the outputs at K states, inputs and their rates, as (K, n_outputs).

    Those at which g fails are not finite.
    """
    count = len(points[0])
    rows = np.minimum(np.arange(max(count, WIDTH) if together else count), count - 1)
    values = np.empty((g.count, len(rows)))
    x, u, du = (np.ascontiguousarray(each[rows].T) for each in points)
    if together:
        lane_values(g, x, u, [p] * len(rows), p, du, values)
    else:
        each_lane(g, x, u, [p] * len(rows), du, values, rows)
    return values[:, :count].T


def lane_values(
    function: UserFunction,
    x: FloatArray,
    u: FloatArray,
    each: Sequence[Parameters],
    p: Parameters,
    du: FloatArray,
    values: FloatArray,
) -> None:
    """Write what a function gives for many lanes to ``values``, (count, B).

    Where it raises an error for all of them, it is asked for each alone, with parameters of its
    own; what is then missing is not finite.
    """
    try:
        function.of_lanes(x, u, p, du, values)
    except FunctionError:
        each_lane(function, x, u, each, du, values, np.arange(len(each)))


def each_lane(
    function: UserFunction,
    x: FloatArray,
    u: FloatArray,
    each: Sequence[Parameters],
    du: FloatArray,
    values: FloatArray,
    lanes: NDArray[np.int64],
) -> None:
    """Write what a function gives for some lanes, each alone, to ``values``, (count, B).

    Numbers of lanes for which it raises an error are not finite.
    """
    of_x, of_u, of_du = (part.T.copy() for part in (x, u, du))
    for lane in lanes.tolist():
        try:
            values[:, lane] = function(of_x[lane], of_u[lane], each[lane], of_du[lane])
        except FunctionError:
            values[:, lane] = np.nan


@final
class Lanes:
    """Lanes are integrated together until all have ended.

    Attributes:
        calls: how often f was called for all lanes, as if for each alone.
    """

    def __init__(self, model: LaneModel, lanes: Sequence[Lane]) -> None:
        """Take at least one lane, all of them at their starts."""
        self._model, self._steps = model, LaneSteps(model.solver)
        self._lanes = list(lanes)
        self._degree = max(lane.course.degree for lane in lanes)
        self._n_inputs = len(lanes[0].course.before)
        n_rows = 2 + (self._degree + 3) * self._n_inputs
        width = model.width or -(-len(lanes) // WIDTH) * WIDTH
        self._lanes += [self._lanes[0]] * (width - len(lanes))
        self._alive = np.arange(width) < len(lanes)
        self._table = np.zeros((BLOCK, n_rows, width))
        self._x = np.stack([lane.state for lane in self._lanes], axis=1)
        self._states = np.empty((width, BLOCK, len(self._x)))
        self._count = np.zeros(width, dtype=np.int64)
        self._at, self._size = np.zeros((2, width), dtype=np.int64)
        self._time, self._step = np.zeros((2, width))
        self._rejected = np.zeros(width, dtype=bool)
        self._accepted = np.zeros(width, dtype=np.int64)
        self._each, self._p = self._parameters()
        self._number = self.calls = 0

    def _parameters(self) -> tuple[list[Parameters], Parameters]:
        """Return the parameters of each lane, and those of all, some of them arrays."""
        each = [lane.p for lane in self._lanes]
        return each, of_lanes(each, self._model.varied)

    def run(self) -> None:
        """Integrate all lanes to their ends, or as far as they can go.

        Raises:
            LaneError: f gives other numbers for many lanes at once.
        """
        with np.errstate(all="ignore"):  # trial steps may go too far
            while True:
                for lane in np.flatnonzero(self._alive & (self._at == self._size)):
                    self._turn(int(lane))
                if not self._alive.any():
                    return
                self._narrow()
                self._try()

    def _turn(self, index: int) -> None:
        """Close what a lane has been through, and load its next intervals."""
        lane = self._close(index)
        block = None if lane.left else lane.load()
        if block is None:
            self._park(index)
            return
        count, powers, n = *block.coefficients.shape[:2], self._n_inputs
        rows = self._table[:count, :, index]
        rows[:, 0], rows[:, 1] = block.durations, block.last
        rows[:, 2 : 2 + n], rows[:, 2 + n : 2 + 2 * n] = block.low, block.high
        first = 2 + 2 * n
        rows[:, first : first + powers * n] = block.coefficients.reshape(count, -1)
        rows[:, first + powers * n :] = 0.0
        self._at[index], self._size[index] = 0, count
        self._begin(np.array([index]))

    def _close(self, index: int) -> Lane:
        """Let a lane find the outputs at its last states, and return it."""
        lane = self._lanes[index]
        states = self._states[index, : self._count[index]]
        lane.close(self._model.g, self._model.together, states)
        self._count[index] = 0
        return lane

    def _park(self, index: int) -> None:
        """Let a lane take no further part; it stays at a state where f can be asked."""
        self._alive[index], self._at[index] = False, 0
        self._x[:, index] = self._lanes[index].state
        self._begin(np.array([index]))

    def _begin(self, lanes: NDArray[np.int64]) -> None:
        """Begin the interval at which lanes are; the first step is all of it."""
        self._time[lanes], self._accepted[lanes], self._rejected[lanes] = 0.0, 0, False
        self._step[lanes] = self._table[self._at[lanes], 0, lanes]

    def _narrow(self) -> None:
        """Leave out lanes that have ended, where that halves the number."""
        count = int(self._alive.sum())
        width = -(-count // WIDTH) * WIDTH
        if self._model.width is not None or 2 * width > len(self._alive):
            return
        kept = np.argsort(~self._alive, kind="stable")[:width]
        self._lanes = [self._lanes[lane] for lane in kept]
        self._table = np.ascontiguousarray(self._table[:, :, kept])
        self._x = np.ascontiguousarray(self._x[:, kept])
        self._states = self._states[kept]
        for name in (
            "_alive",
            "_count",
            "_at",
            "_size",
            "_time",
            "_step",
            "_rejected",
            "_accepted",
        ):
            setattr(self, name, getattr(self, name)[kept])
        self._each, self._p = self._parameters()

    def _try(self) -> None:
        """Try a step in every lane, and take those that are good enough."""
        lanes = np.arange(len(self._alive))
        rows = np.ascontiguousarray(self._table[self._at, :, lanes].T)
        shortest = 10.0 * np.spacing(self._time)
        step = np.where(self._rejected, self._step, np.maximum(self._step, shortest))
        end = np.minimum(self._time + step, rows[0])
        steps = end - self._time
        u, du = self._inputs(rows, steps)
        tried = self._steps.try_steps(self._rates(u, du), self._x, steps)
        self.calls += len(u) * int(self._alive.sum())
        good = self._alive & (tried.errors < 1.0)  # what is not finite is not
        following = self._steps.next_steps(steps, tried.errors, good, self._rejected)
        np.copyto(self._x, tried.reached, where=good)
        self._time = np.where(good, end, self._time)
        self._accepted += good
        self._step, self._rejected = following, ~good
        self._end(good & (end >= rows[0]), rows[1] != 0.0)
        stuck = (step < shortest) | (self._accepted >= MOST_STEPS)
        for lane in np.flatnonzero(self._alive & stuck):
            self._leave(int(lane))

    def _inputs(self, rows: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give the inputs and their rates at the stages of steps, (stages, n_inputs, B) each."""
        n, step = self._n_inputs, self._model.step
        at = ((self._time + self._steps.times[:, None] * steps) / step)[:, None]
        powers = rows[2 + 2 * n :].reshape(self._degree + 1, n, -1)
        u = np.broadcast_to(powers[-1], (len(at), *powers[-1].shape))
        du = np.zeros_like(u)
        of_rates = self._model.f.takes_rates
        for power in powers[-2::-1]:
            if of_rates:
                du = du * at + u
            u = u * at + power
        u = np.minimum(np.maximum(u, rows[2 : 2 + n]), rows[2 + n : 2 + 2 * n])
        return u, du / step if of_rates else du

    def _rates(self, u: FloatArray, du: FloatArray) -> _StageRates:
        self._number += 1
        check = self._number % CHECKED == 0
        lane = self._number // CHECKED % len(self._alive) if check else None
        alone = None if self._model.together else np.flatnonzero(self._alive)
        return _StageRates(self._model, u, du, self._p, self._each, lane, alone)

    def _end(self, ended: NDArray[np.bool_], last: NDArray[np.bool_]) -> None:
        """Go to the next intervals of lanes whose interval has ended."""
        lanes = np.flatnonzero(ended)
        finite = np.asarray(np.isfinite(self._x).all(axis=0))
        sampled = lanes[last[lanes] & finite[lanes]]
        self._states[sampled, self._count[sampled]] = self._x[:, sampled].T
        self._count[sampled] += 1
        self._at[lanes] += 1
        inside = lanes[self._at[lanes] < self._size[lanes]]
        self._begin(inside)
        for index in lanes[~finite[lanes]]:
            self._leave(int(index))

    def _leave(self, index: int) -> None:
        """Leave a lane that cannot go on at its last sample."""
        self._close(index).left = True
        self._park(index)


@dataclass(frozen=True, eq=False)
class _StageRates:
    """The rates of all lanes at a stage of a step.

    Attributes:
        model: has the function f.
        u, du: inputs and their rates at all stages, (stages, n_inputs, B).
        p: parameters, of which those that vary are arrays.
        each: parameters of each lane.
        checked: the lane whose rates at the first stage are compared with a single call, or None.
        alone: lanes for which f is called one by one; None where it is called for all at once.
    """

    model: LaneModel
    u: FloatArray
    du: FloatArray
    p: Parameters
    each: Sequence[Parameters]
    checked: int | None
    alone: NDArray[np.int64] | None = None

    def __call__(self, stage: int, x: FloatArray, values: FloatArray) -> None:
        u, du = self.u[stage], self.du[stage]
        if self.alone is not None:
            each_lane(self.model.f, x, u, self.each, du, values, self.alone)
            return
        lane_values(self.model.f, x, u, self.each, self.p, du, values)
        if stage == 0 and self.checked is not None:
            self._check(self.checked, x, values)

    def _check(self, lane: int, x: FloatArray, values: FloatArray) -> None:
        u, du = self.u[0][:, lane].copy(), self.du[0][:, lane].copy()
        try:
            alone = self.model.f(x[:, lane].copy(), u, self.each[lane], du)
        except FunctionError:
            return  # nothing comes of it in the lane either
        together = values[:, lane]
        sizes = np.max(np.abs(values), axis=1, initial=0.0, where=np.isfinite(values))
        if self.model.sizes is not None:
            sizes = np.maximum(sizes, self.model.sizes)
        same = np.isclose(alone, together, rtol=0.0, atol=SAME * sizes, equal_nan=True)
        if not same.all():
            raise LaneError(f"f gave {together.tolist()} in place of {alone.tolist()}")
