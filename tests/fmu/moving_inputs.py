"""Inputs that move and are set to what they are at the start of a step, in plain loops.

Apart from ``slide_fmu.surrogate.input_forecast`` and from the C runtime, which share no code with
it.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.plain import SLACK, ResamplingOracle, plain_arc, plain_moved, spread
from tests.fmu.samples import forecast_of


def forecasting(
    surrogate: Surrogate, at_step_end: bool = False, planned: bool = False
) -> Surrogate:
    """The surrogate with a forecast of every input."""
    forecast = forecast_of(len(surrogate.inputs), at_step_end, planned)
    return dataclasses.replace(surrogate, forecast=forecast)


@dataclass(frozen=True)
class Rules:
    """How one input, or one angle, is forecast.

    Attributes:
        weights: of the candidates, (n_candidates, n_past).
        largest: the largest change in a step.
        n_scored: points whose forecasts decide.
        least_changes: of these, of an input that moves.
    """

    weights: FloatArray
    largest: float
    n_scored: int
    least_changes: int = 0

    @property
    def n_points(self) -> int:
        """The points that a forecast and its scores look at."""
        return max(self.weights.shape[1], 3) + self.n_scored + 1

    def changes(self, x: list[float], at: int = 0) -> list[float]:
        """What all choices expect after values H apart, newest first, from one of them on: of
        those the first holds, and the last is a cubic."""
        cubic = np.array([-6.0, 4.0, -1.0])
        changes = [
            sum(w * (x[at + i + 1] - x[at]) for i, w in enumerate(weights))
            for weights in ([0.0], *self.weights, cubic)
        ]
        return [min(max(change, -self.largest), self.largest) for change in changes]

    def errors(self, x: list[float]) -> list[list[float]]:
        """How far all choices were off at the newest values, newest first."""
        return [
            [x[j] - x[j + 1] - change for change in self.changes(x, j + 1)]
            for j in range(self.n_scored)
        ]

    def best(self, errors: list[list[float]]) -> tuple[int, bool]:
        """Which choice is taken; and does the input move?"""
        scores = np.sum(np.array(errors[: self.n_scored]) ** 2, axis=0)
        best, least = 0, 0.5 * scores[0]
        for index in range(1, len(self.weights) + 1):
            if scores[index] < least:
                best, least = index, scores[index]
        if len(self.weights) > 0 and scores[-1] < 0.5 * least:
            best = len(scores) - 1
        if best == 0 and self.least_changes > 0:
            before = errors[self.n_scored][0] ** 2 if len(errors) > self.n_scored else 0.0
            best = self.smooth(np.array(errors[: self.n_scored]) ** 2, before)
        n_changes = sum(one[0] != 0 for one in errors[: self.n_scored])
        return best, best > 0 and n_changes >= self.least_changes

    def smooth(self, squares: FloatArray, before: float) -> int:
        """Which choice of a held input is far better than holding it but for up to two points,
        which are kinks and no jumps? (points, choices), and the squared change before; 0 for
        none."""
        rests = {}
        for index in range(1, len(self.weights) + 1):
            held, errors = squares[:, 0], squares[:, index]
            order = np.argsort(errors, kind="stable")
            fails = errors[order] > 0.05 * held[order]
            n_kinks = 0 if not fails[-1] else 2 if fails[-2] else 1
            kept, kinks = np.split(order, [len(order) - n_kinks])
            of_kinks = max((held[k] for k in kinks if errors[k] > 0.25 * held[k]), default=0.0)
            rest = float(errors[kept].sum())
            if rest < 0.05 * held[kept].sum() and of_kinks <= 4 * max(before, held[kept].max()):
                rests[index] = rest
        return min(rests, key=lambda index: rests[index]) if rests else 0


HELD_CANDIDATES = np.array([[-1.0, 0.0], [-3.0, 1.0]])
"""Of held inputs: a straight line and a parabola."""


def rules_of(surrogate: Surrogate, index: int, steps: float) -> Rules:
    """Of steps of a length in h."""
    forecast = surrogate.forecast
    if surrogate.inputs[0].hold == "zero_order":
        return Rules(HELD_CANDIDATES, math.inf, 12, 4)
    assert forecast is not None
    if forecast.weights.shape[1] == 0:
        return Rules(np.zeros((0, 3)), 0.0, 1)
    largest = forecast.largest_change[index] * steps
    return Rules(forecast.weights[index], largest, forecast.n_scored)


def n_points(forecast: InputForecast) -> int:
    """The number of inputs, one step apart, that a forecast looks at."""
    return Rules(forecast.weights[0], 0.0, forecast.n_scored).n_points


def change_to(signal: Signal, before: FloatArray, after: FloatArray, index: int) -> float:
    """How an input goes on from one row to another, or the angle whose cosine it is."""
    if signal.angle == "cosine":
        pair = slice(index, index + 2)
        return float(np.angle(complex(*after[pair]) / complex(*before[pair])))
    return float(after[index] - before[index])


def turned(director: FloatArray, angle: float) -> tuple[float, float]:
    z = complex(*director) * np.exp(1j * angle)
    return z.real, z.imag


Errors = dict[int, list[list[float]]]
"""How far all choices were off, of every input, newest first."""


def channel(surrogate: Surrogate, past: list[FloatArray], index: int) -> list[float]:
    """Values of one input, or of an angle by its cosine's place, relative to the newest."""
    x = [0.0]
    for later, before in itertools.pairwise(past):
        x.append(x[-1] - change_to(surrogate.inputs[index], before, later, index))
    return x


def plain_ahead(
    surrogate: Surrogate, past: list[FloatArray], steps: float, errors: Errors | None = None
) -> tuple[FloatArray, list[bool]]:
    """The inputs expected a step after these, newest first; and which of them move.

    Args:
        errors: of former forecasts; None: those at the past inputs.
    """
    ahead, moves = np.array(past[0]), [False] * len(surrogate.inputs)
    for i, signal in enumerate(surrogate.inputs):
        if signal.angle == "sine":
            continue
        x, rules = channel(surrogate, past, i), rules_of(surrogate, i, steps)
        best, moves[i] = rules.best(rules.errors(x) if errors is None else errors[i])
        change = rules.changes(x)[best]
        if signal.angle == "cosine":
            ahead[i : i + 2] = turned(past[0][i : i + 2], change)
        else:
            ahead[i] = no_further(surrogate, i, past[0][i] + change, past[0][i])
    return ahead, moves


def no_further(surrogate: Surrogate, index: int, value: float, *others: float) -> float:
    """An input that no further leaves its range than others of its values do."""
    scaling = surrogate.input_scaling
    offset, scale = float(scaling.offset[index]), float(scaling.scale[index])
    return float(np.clip(value, min(offset - scale, *others), max(offset + scale, *others)))


def through(times: list[float], values: list[float], time: float) -> float:
    """The polynomial through values at times, at another one: by Lagrange's formula."""
    total = 0.0
    for own, value in zip(times, values, strict=True):
        others = [other for other in times if other != own]
        total += value * math.prod((time - other) / (own - other) for other in others)
    return total


HELD, MOVED, TOLD = range(3)
"""What an input does in a step."""


class MovingOracle(ResamplingOracle):
    """What is known and expected of the inputs, and the exact window behind a step.

    The inputs at communication points; between two of them an input is held, or is on a line, or,
    where it moves smoothly, on the polynomial through them and up to two before.

    Attributes:
        begins: of all steps, in s; the first communication point is 0.
        rows: inputs at the begins.
        ways: HELD, MOVED or TOLD of each input, of every step.
        goal: inputs at the end of the last step.
        now: its end, in s.
        known: is what is set all that the inputs do in a step?
    """

    def __init__(
        self, surrogate: Surrogate, known: bool = False, before: FloatArray | None = None
    ) -> None:
        """before: the inputs until the start, where they are known: a row, or samples one h apart,
        oldest first, (n, n_inputs)."""
        super().__init__(surrogate)
        self.known, self.now = known, 0.0
        self.before = None if before is None else np.atleast_2d(before)
        self.begins: list[float] = []
        self.rows: list[FloatArray] = []
        self.ways: list[list[int]] = []
        self.goal = np.zeros(0)
        self._points: list[FloatArray] = []
        self._errors: Errors = {}
        self._spacing = 0.0

    @property
    def first_order(self) -> bool:
        return self.surrogate.hold == "first_order"

    def _add(self, begin: float, row: FloatArray) -> None:
        self.begins.append(begin)
        self.rows.append(np.array(row, dtype=np.float64))
        self.ways.append([HELD] * len(row))

    def _begin(self, inputs: FloatArray) -> None:
        """What was before the first step."""
        h, forecasts = self.surrogate.window.step, self.first_order and not self.known
        before = np.atleast_2d(inputs) if self.before is None else self.before
        if self.before is not None and forecasts:
            self._add(-2 * h, before[-1])
        begins = before
        if self.first_order and self.known:  # a sample is where its step ends
            begins = np.concatenate([before[:1], before[:-1]])
        for age, row in zip(range(len(begins), 0, -1), begins, strict=True):
            self._add(-age * h, row)
        self.goal = np.array(before[-1], dtype=np.float64)

    def step(
        self, length: float, inputs: FloatArray, rates: FloatArray | None = None
    ) -> MovingOracle:
        """Set inputs and perhaps their derivatives, and take a step."""
        if not self.begins:
            self._begin(inputs)
        ends = self.first_order and self.known
        self._add(self.now, self.goal if ends else inputs)
        begin, self.now, self.goal = self.now, self.now + length, np.array(inputs, dtype=float)
        self._see(begin, length)
        moves = self._tell(length, ends)
        if rates is not None:
            self._move_told(length, inputs, rates, moves)
        return self

    def _see(self, begin: float, length: float) -> None:
        """The points that forecasts look at, H apart until the newest communication point; and
        how far former forecasts were off, of whatever length their steps were."""
        h, anew = self.surrogate.window.step, self._spacing == 0
        angles = [signal.angle for signal in self.surrogate.inputs]
        rules = {i: rules_of(self.surrogate, i, self._spacing / h)
                 for i, angle in enumerate(angles) if angle != "sine"}  # fmt: skip
        if not anew:
            for i, rule in rules.items():
                expected = rule.changes(channel(self.surrogate, self._points, i))
                change = change_to(self.surrogate.inputs[i], self._points[0], self.rows[-1], i)
                self._errors[i].insert(0, [change - one for one in expected])
            self._points.insert(0, self.rows[-1])
        if abs(self._spacing - length) > 1e-9 * length:
            reach = (self.surrogate.memory_length + 2) * h
            n = max(rule.n_points for rule in rules.values())
            self._points = [self.at(begin - min(age * length, reach)) for age in range(n)]
            self._spacing = length
        if anew:
            self._errors = {
                i: rules_of(self.surrogate, i, length / h).errors(
                    channel(self.surrogate, self._points, i)
                )
                for i in rules
            }

    def _tell(self, length: float, ends: bool) -> list[int]:
        """Which inputs move in this step, and did in the one before; where they get to."""
        steps = length / self.surrogate.window.step
        goal, moves = plain_ahead(self.surrogate, self._points, steps, self._errors)
        if not self.first_order:  # angles are held
            moves = [m and not self.known and s.angle is None
                     for m, s in zip(moves, self.surrogate.inputs, strict=True)]  # fmt: skip
        now, before = self.ways[-1], self.ways[-2]
        for i, (signal, moved) in enumerate(zip(self.surrogate.inputs, moves, strict=True)):
            now[i] = MOVED if moved else HELD
            if moved and before[i] == HELD and not self.first_order:
                self._tell_later(i)
            rested = not self.first_order and self.rows[-2][i] == self.rows[-1][i]
            if before[i] != TOLD and not (before[i] == HELD and rested):
                before[i] = now[i]
            if moved and not ends:
                pair = slice(i, i + 1 + (signal.angle == "cosine"))
                self.goal[pair] = goal[pair]
        return now

    def _tell_later(self, index: int) -> None:
        """An input that turns out to move did so in the steps that begin with its changes."""
        for step in range(len(self.rows) - 3, max(len(self.rows) - 7, -1), -1):
            if step == 0 or self.rows[step][index] == self.rows[step - 1][index]:
                if step > 0 and self._begins(step, index):
                    self.ways[step][index] = MOVED
                break
            if self.ways[step][index] == HELD:
                self.ways[step][index] = MOVED

    def _begins(self, step: int, index: int) -> bool:
        """Does the change of a step, after a rest, go on in the next one?"""
        first, second = np.diff([row[index] for row in self.rows[step : step + 3]])
        lengths = np.diff([*self.begins, self.now])
        equal = abs(lengths[step] - lengths[-1]) <= 1e-6 * lengths[-1]
        return bool(equal and first * second > 0 and abs(first) <= 1.5 * abs(second))

    def _move_told(
        self, length: float, inputs: FloatArray, rates: FloatArray, ways: list[int]
    ) -> None:
        """Derivatives go before the forecast: of forecast inputs also zeros."""
        moved = plain_moved(self.surrogate, inputs, rates, length)
        told = (rates != 0) | (self.first_order and not self.known)
        for i, signal in enumerate(self.surrogate.inputs):
            other = {"cosine": i + 1, "sine": i - 1, None: i}[signal.angle]
            if told[i] or told[other]:
                self.goal[i], ways[i] = moved[i], TOLD

    def _step_at(self, time: float) -> int:
        latest = time + SLACK * self.surrogate.window.step
        newest_first = range(len(self.begins) - 1, 0, -1)
        return next((k for k in newest_first if self.begins[k] <= latest), 0)

    def _end(self, step: int) -> tuple[float, FloatArray]:
        last = step + 1 == len(self.rows)
        return (self.now, self.goal) if last else (self.begins[step + 1], self.rows[step + 1])

    def at(self, time: float) -> FloatArray:
        """The inputs at a time."""
        step, slack = self._step_at(time), SLACK * self.surrogate.window.step
        begin, row, (end, after) = self.begins[step], self.rows[step], self._end(step)
        if time - begin <= slack:
            return row
        if end - time <= slack:
            return after
        inputs = np.array(row)
        for i, signal in enumerate(self.surrogate.inputs):
            if signal.angle == "sine":
                continue
            if self.ways[step][i] != HELD:
                pair = slice(i, i + 1 + (signal.angle == "cosine"))
                inputs[pair] = self._on_curve(step, i, time)
                if signal.angle is None:
                    inputs[i] = no_further(self.surrogate, i, inputs[i], row[i], after[i])
            elif self.first_order and signal.angle == "cosine":
                z = np.stack([row, after])[:, i : i + 2]
                inputs[i : i + 2] = plain_arc(time, np.array([begin, end]), z)
            elif self.first_order:
                inputs[i] = row[i] + (time - begin) / (end - begin) * (after[i] - row[i])
        return inputs

    def _on_curve(self, step: int, index: int, time: float) -> tuple[float, ...]:
        """On the polynomial through both ends of a step, and points before where it moved."""
        signal, (end, after) = self.surrogate.inputs[index], self._end(step)
        times, rows = [end, self.begins[step]], [after, self.rows[step]]
        while len(times) < 4 and step > 0 and self.ways[step - 1][index] != HELD:
            step -= 1
            times.append(self.begins[step])
            rows.append(self.rows[step])
        x = [0.0]
        for later, before in itertools.pairwise(rows):
            x.append(x[-1] - change_to(signal, before, later, index))
        change = through(times, x, time)
        if signal.angle == "cosine":
            return turned(after[index : index + 2], change)
        return (after[index] + change,)

    def _held(self, begin: float, end: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What must be held to have the effect of the inputs between two times; and of those that
        do not move smoothly, their moments, (3, n_inputs), as for ``spread``; of the others a
        twelfth of their slopes at both times, (2, n_inputs)."""
        slack, first = SLACK * self.surrogate.window.step, self._step_at(begin)
        means = np.array(self.rows[first])
        moments, edges = np.zeros((3, len(means))), np.zeros((2, len(means)))
        for i, signal in enumerate(self.surrogate.inputs):
            if signal.angle == "cosine" and self.ways[first][i] != HELD:
                z = np.stack([self.rows[first], self._end(first)[1]])[:, i : i + 2]
                times = np.array([self.begins[first], self._end(first)[0]])
                means[i : i + 2] = plain_arc(0.5 * (begin + end), times, z)
            if signal.angle is not None:
                continue
            mean, moment, square, cube, all_move, step, at = 0.0, 0.0, 0.0, 0.0, True, first, begin
            while at < end - slack:
                last = step + 1 == len(self.rows)
                to = end if last else min(self._end(step)[0], end)
                value, rise = self.rows[step][i], 0.0
                if self.ways[step][i] != HELD:
                    stop, after = self._end(step)
                    part = (0.5 * (at + to) - self.begins[step]) / (stop - self.begins[step])
                    rise = (after[i] - value) * (to - at) / (stop - self.begins[step])
                    value += min(max(part, 0.0), 1.0) * (after[i] - value)
                else:
                    all_move = False
                share = (to - at) / (end - begin)
                mean += share * value
                late = (at + to - begin - end) / (end - begin) / 2
                moment += share * value * late + share**2 * rise / 12
                square += share * value * (late**2 + share**2 / 12) + share**2 * late * rise / 6
                cube += share * value * late * (late**2 + share**2 / 4)
                cube += share**2 * rise * (late**2 / 4 + share**2 / 80)
                at, step = to, step + (not last)
            means[i], moments[:, i] = mean, (moment, square - mean / 12, cube)
            smooth = all_move and not self.known
            held = self._held_for(first, i, begin, end) if smooth else None
            if held is not None:
                means[i], edges[:, i] = held
                moments[:, i] = 0.0
        return means, moments, edges

    def _held_for(
        self, first: int, index: int, begin: float, end: float
    ) -> tuple[float, tuple[float, float]] | None:
        """Of an input that moves in all of a sample: by the Taylor series of x / sin(x); None
        where it may have a kink, or is not so smooth."""
        slack, last, h = SLACK * self.surrogate.window.step, self.now, end - begin

        def at(times: FloatArray) -> FloatArray:
            kept = np.minimum(times, last - slack)
            return np.array([self._on_curve(self._step_at(t), index, t)[0] for t in kept])

        values, second = at(np.linspace(begin, end, 5)), np.array([1, -2, 1])
        bend = np.dot(second, values[::2])
        smooth, correction = True, -bend / 6
        before = at(begin - h / 2 * np.arange(7))
        slopes = np.array([[-3, 0, 4, 0, -1], [1, 0, -4, 0, 3]]) @ values
        if self._end(first)[0] - self.begins[first] <= h / 4 + slack:
            of_second = np.dot([-1, 16, -30, 16, -1], values) / 18
            of_fourth = 14 / 45 * np.dot([1, -4, 6, -4, 1], values)
            rise = abs(values[-1] - values[0])
            most = max(abs(np.dot(second, before[k : k + 3])) for k in (0, 2, 4))
            smooth = abs(of_fourth) <= max(0.25 * abs(of_second), 5e-3 * most, 1e-5 * rise)
            correction = of_fourth - of_second
            slopes = np.array([[-25, 48, -36, 16, -3], [3, -16, 36, -48, 25]]) @ values / 3
        else:
            bends = [abs(np.dot(second, before[k : k + 3])) for k in (0, 2, 4)]
            smooth = abs(bend) <= 2 * max(*bends, 1e-5 * abs(values[-1] - values[0]))
        begins, ends = slopes / 12
        return (float(values[2] + correction), (begins, ends)) if smooth else None

    def samples_until(self, time: float, count: int) -> FloatArray:
        """The samples of the inputs, (count, n_inputs), oldest first, until one ends at a time."""
        h = self.surrogate.window.step
        ends = time - h * np.arange(count, -1, -1)
        if self.first_order:
            return np.array([self.at(end) for end in ends[1:]])
        samples = [self._held(end - h, end) for end in ends]
        rows, moments, edges = (np.array(one) for one in zip(*samples, strict=True))
        less = edges[:-1, 1] - edges[1:, 0]  # given to the older of two samples
        rows[:-1] += less
        moments[:-1] += less[:, None] * np.array([1 / 2, 1 / 4, 1 / 8])[:, None]
        return spread(rows[1:], moments)

    def samples(self, count: int) -> FloatArray:
        """The newest samples of the inputs, (count, n_inputs), oldest first."""
        return self.samples_until(self.now, count)


def moving_inputs(surrogate: Surrogate, count: int, seed: int = 0) -> FloatArray:
    """Inputs in their ranges, (count, n_inputs): smooth, then noisy, then at rest, then smooth."""
    rng, n = np.random.default_rng(seed), len(surrogate.inputs)
    time = np.arange(count)[:, None]
    smooth = 0.5 * np.sin(time * rng.uniform(0.1, 0.5, n) + rng.uniform(0, 6, n))
    smooth += 0.2 * np.sin(time * rng.uniform(0.5, 0.9, n))
    part = np.arange(count) * 4 // count
    smooth[part == 1] += rng.normal(0, 0.3, (np.sum(part == 1), n))
    smooth[part == 2] = smooth[part == 2][:1]
    rows = surrogate.input_scaling.invert(np.clip(smooth, -1, 1))
    for i, signal in enumerate(surrogate.inputs):
        if signal.angle == "cosine":
            angle, scale = 5 * smooth[:, i], surrogate.input_scaling.scale[i]
            rows[:, i], rows[:, i + 1] = scale * np.cos(angle), scale * np.sin(angle)
    return rows
