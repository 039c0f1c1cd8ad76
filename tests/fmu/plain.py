"""State-space networks and resampling in plain loops, straight from the definitions.

Deliberately apart from the C runtime: what is tested against this oracle must not share its code.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import Features
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import ANGLE, COSINE, OTHER, Director
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.plain_cell import PlainCell

SLACK = 1e-6
"""Times that differ by less, in sample steps, are the same."""


def plain_signals(features: Features, newest_first: FloatArray) -> FloatArray:
    """Signals of an input and the three before it, (4, c), each by its definition."""
    u, before, earlier = newest_first[:3]
    if isinstance(features, Differences):
        parts = [u, u - before, u - 2 * before + earlier]
        return np.concatenate(parts[: features.order + 1])
    if isinstance(features, Director):
        now, once, first = (plain_directors(features, inputs) for inputs in (u, before, earlier))
        turns, turns_before = np.angle(now * once.conj()), np.angle(once * first.conj())
        others = [i for i, kind in enumerate(features.kinds) if kind == OTHER]
        direction = np.stack([now.real, now.imag], axis=1).ravel()
        parts = [direction, turns, turns - turns_before, u[others], u[others] - before[others]]
        return np.concatenate(parts)
    raise TypeError(f"{type(features).__name__} has no definition here")


def plain_directors(features: Director, inputs: FloatArray) -> Any:
    """The angles as complex numbers of length 1."""
    directions = []
    for i, kind in enumerate(features.kinds):
        if kind == COSINE:
            directions.append(complex(*inputs[i : i + 2]) / math.hypot(*inputs[i : i + 2]))
        elif kind == ANGLE:
            angle = features.scaling.offset[i] + features.scaling.scale[i] * inputs[i]
            directions.append(complex(math.cos(angle), math.sin(angle)))
    return np.array(directions)


def plain_features(features: FeatureMap, records: FloatArray) -> FloatArray:
    """Features sample by sample: (N, c) to (N, q)."""
    ages = np.maximum(np.arange(len(records))[:, None] - np.arange(4), 0)
    seen, scaling = records[ages], features.scaling  # newest first: (N, 4, c)
    if isinstance(features.features, Differences | Director):
        signals = np.array([plain_signals(features.features, inputs) for inputs in seen])
    else:  # the motion of a chain, which other tests have checked: all samples at once
        signals = features.features.of(seen[:, ::-1])[:, 0]
    return (signals[:, list(features.chosen)] - scaling.offset) / scaling.scale


def plain_pair(
    network: StateSpace, features: FloatArray, changed: tuple[int, StateSpace] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Two states from zero, restarted in turn: values and truncation errors, (N, n_values).

    The weights may change to those of another network from a sample on.
    """
    n, cell = network.n_samples, PlainCell.of(network)
    older = younger = np.zeros(len(network.cell.a))
    age, error, values, errors = 0, np.zeros(network.n_values), [], []
    largest = np.zeros(network.n_values)  # of what the younger changes, since the last hand-over
    for k, f in enumerate(features):
        if changed is not None and k == changed[0]:
            cell = PlainCell.of(changed[1])
        older, y_old = cell.step(older, f)
        younger, y_young = cell.step(younger, f)
        age += 1
        weight = max(0.0, (age - (n - network.n_out)) / network.n_out)
        values.append((1 - weight) * y_old + weight * y_young)
        largest = np.maximum(largest, weight * np.abs(y_young - y_old))
        if age == n:
            error, older, younger, age = largest, younger, 0 * younger, 0
            largest = 0 * largest
        errors.append(error)
    return np.array(values), np.array(errors)


ACTIVATIONS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "identity": lambda z: z,
    "relu": lambda z: np.where(z > 0, z, 0.0),
    "elu": lambda z: np.where(z > 0, z, np.expm1(np.minimum(z, 0.0))),
    "tanh": np.tanh,
    "gelu": lambda z: 0.5 * z * (1 + np.tanh(math.sqrt(2 / math.pi) * (z + 0.044715 * z**3))),
    "cubic": lambda z: z**3,
}


def plain_layers(network: FeedForward, window: FloatArray) -> FloatArray:
    """Values of one window of features, (n_samples, q), in double precision."""
    ages = network.ages or tuple(reversed(range(network.n_samples)))
    flat = np.concatenate([window[network.n_samples - 1 - age] for age in ages])
    hidden = flat
    for layer in network.layers:
        hidden = ACTIVATIONS[layer.activation](layer.weights.astype(float) @ hidden + layer.bias)
    return hidden if network.skip is None else hidden + network.skip.astype(float) @ flat


def plain_outputs(surrogate: Surrogate, window: FloatArray) -> FloatArray:
    """Outputs (n_out, n_outputs) of a window of physical inputs (n_in, n_inputs)."""
    network, n_out = surrogate.network, surrogate.window.n_out
    assert isinstance(network, StateSpace | FeedForward)
    features = plain_features(network.features, surrogate.input_scaling.apply(window))
    values = []
    if isinstance(network, StateSpace):
        values.extend(PlainCell.of(network).run(features)[0])
    else:
        for first in range(len(features) - network.n_samples + 1):
            values.append(plain_layers(network, features[first : first + network.n_samples]))
    rows = np.concatenate(values).reshape(-1, len(surrogate.outputs))[-n_out:]
    return np.asarray(surrogate.output_scaling.invert(rows))


def five_point_slope(
    function: Callable[[float], FloatArray], distance: float = 1e-4
) -> FloatArray:
    """Derivative of a function at 0."""
    near = function(distance) - function(-distance)
    far = function(2 * distance) - function(-2 * distance)
    return np.asarray((8 * near - far) / (12 * distance))


def plain_arc(time: float, times: FloatArray, rows: FloatArray) -> FloatArray:
    """A director that turns from row to row on the shorter arc, its length linear."""
    z = rows[:, 0] + 1j * rows[:, 1]
    turns = np.angle(z[1:] / z[:-1])
    angles = np.angle(z[0]) + np.concatenate([[0.0], np.cumsum(turns)])
    angle, length = np.interp(time, times, angles), np.interp(time, times, np.abs(z))
    return np.array([length * np.cos(angle), length * np.sin(angle)])


def plain_moved(
    surrogate: Surrogate, inputs: FloatArray, rates: FloatArray, time: float
) -> FloatArray:
    """Inputs a time after these, by their derivatives; a director stays on its circle."""
    moved = inputs + rates * time
    for i, signal in enumerate(surrogate.inputs):
        if signal.angle == "cosine":
            z = complex(*inputs[i : i + 2])
            z *= np.exp(complex(*rates[i : i + 2]) / z * time)
            moved[i : i + 2] = z.real, z.imag
    return np.asarray(moved)


UNSETTLED = 5
"""Newest samples of held inputs that following ones may change."""


@cache
def shares_of(later: int, earlier: int) -> FloatArray:
    """What an input that changes within a sample adds to it and those beside it, by its moments.

    The effect f(s) of an input at a time s, in samples from the middle of its own, is the
    polynomial with the means that f has in so many samples after this one, in it, and in so many
    before it. Weights of the moments of the orders 1 to 3, (later + 1 + earlier, 3), that of the
    latest sample first.
    """
    middles = np.arange(later, -earlier - 1, -1, dtype=np.float64)
    powers = np.arange(1, len(middles) + 1)
    means = ((middles[:, None] + 0.5) ** powers - (middles[:, None] - 0.5) ** powers) / powers
    weights = np.zeros((len(middles), 4))
    weights[:, : len(middles)] = np.linalg.inv(means).T[:, :4]
    return weights[:, 1:]


def spread(means: FloatArray, moments: FloatArray) -> FloatArray:
    """Samples of held inputs: a change within one of them is felt in those beside it.

    Args:
        means: of the samples, (count, n_inputs), oldest first.
        moments: means of (u - mean) s^n, s = (t - middle) / h, for n = 1, 2 and 3, of these and
            of one before, (count + 1, 3, n_inputs).
    """
    samples, count = np.array(means, dtype=np.float64), len(means)
    for k, of_sample in enumerate(moments):
        age = count - k
        later = min(age, 1)
        for place, share in enumerate(shares_of(later, UNSETTLED - 1 - later) @ of_sample):
            target = age - later + place
            if target < count:
                samples[count - 1 - target] += share
    return samples


def doubted(means: FloatArray, moments: FloatArray) -> FloatArray:
    """What one sample less before each would change in ``spread``: fourth differences back."""
    samples, count = np.zeros(np.shape(means)), len(means)
    for k, of_sample in enumerate(moments):
        age = count - k
        size = (shares_of(1, UNSETTLED - 3)[0] - shares_of(1, UNSETTLED - 2)[0]) @ of_sample
        for place, part in enumerate((1, -4, 6, -4, 1)):
            if age + place < count:
                samples[count - 1 - age - place] += part * size
    return samples


class ResamplingOracle:
    """The exact window at the end of communication steps of any length.

    Attributes:
        surrogate: what is evaluated.
        lengths: length of every step so far, in s.
        inputs: inputs of every step so far, (n_inputs,) each.
    """

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate
        self.lengths: list[float] = []
        self.inputs: list[FloatArray] = []

    def _moments_from(self, begin: float) -> FloatArray:
        """Moments of held inputs in a sample from a time on, (3, n_inputs), as for ``spread``."""
        step, ends = self.surrogate.window.step, np.cumsum(self.lengths)
        starts = ends - self.lengths
        low, high = np.maximum(starts, begin), np.minimum(ends, begin + step)
        shares = np.where(high - low > SLACK * step, (high - low) / step, 0.0)
        late = ((low + high) / 2 - begin - step / 2) / step
        squares = late**2 + (shares**2 - 1) / 12
        cubes = late * (late**2 + shares**2 / 4)
        weights = shares * np.stack([late, squares, cubes])
        moments = weights @ (np.array(self.inputs) - self.inputs[0])
        moments[:, [k for k, signal in enumerate(self.surrogate.inputs) if signal.angle]] = 0
        return np.asarray(moments)

    def input_from(self, begin: float) -> FloatArray:
        """The sample that acts for one h from a time on; the first step begins at 0.

        Held inputs that change within it have their mean, but directors what they were.
        """
        step, ends = self.surrogate.window.step, np.cumsum(self.lengths)
        if self.surrogate.hold == "zero_order":
            starts = ends - self.lengths
            started = np.nonzero(starts <= begin + SLACK * step)[0]
            first = np.array(self.inputs[started[-1] if len(started) else 0], dtype=np.float64)
            shares = np.minimum(ends, begin + step) - np.maximum(starts, begin)
            shares = np.where(shares > SLACK * step, shares / step, 0.0)
            mean = shares @ np.array(self.inputs) + (1 - shares.sum()) * self.inputs[0]
            angles = [k for k, signal in enumerate(self.surrogate.inputs) if signal.angle]
            mean[angles] = first[angles]
            return np.asarray(mean)
        rows = np.array([self.inputs[0], *self.inputs])
        times = [0.0, *ends]
        reached = np.array([np.interp(begin + step, times, column) for column in rows.T])
        for i, signal in enumerate(self.surrogate.inputs):
            if signal.angle == "cosine":
                pair = slice(i, i + 2)
                reached[pair] = plain_arc(begin + step, np.array(times), rows[:, pair])
        return reached

    def _move(self, length: float, inputs: FloatArray, rates: FloatArray) -> None:
        """A step whose inputs move: held ones in parts of at most h, by the middle of each."""
        if not self.lengths:  # before, they are held for ever
            self.lengths.append(self.surrogate.window.step)
            self.inputs.append(inputs)
        parts, times = [length], [length]
        if self.surrogate.hold == "zero_order":
            count = math.ceil(length / self.surrogate.window.step - SLACK)
            further = [self.surrogate.window.step] * (count - 1)
            parts = [length - sum(further), *further]
            times = [sum(parts[:k]) + part / 2 for k, part in enumerate(parts)]
        self.lengths += parts
        self.inputs += [plain_moved(self.surrogate, inputs, rates, time) for time in times]

    def append(self, length: float, inputs: FloatArray, rates: FloatArray | None = None) -> None:
        """One more step, whose inputs move by their derivatives (1/s), where there are any."""
        if rates is None:
            self.lengths.append(length)
            self.inputs.append(inputs)
        else:
            self._move(length, inputs, rates)

    def samples(self, count: int) -> FloatArray:
        """The newest samples of the inputs, (count, n_inputs), oldest first."""
        h = self.surrogate.window.step
        begins = sum(self.lengths) - h * np.arange(count + 1, 0, -1)
        rows = np.array([self.input_from(begin) for begin in begins[1:]])
        if self.surrogate.hold == "first_order":
            return rows
        moments = np.array([self._moments_from(begin) for begin in begins])
        return spread(rows, moments)

    def _scaled(self, count: int) -> FloatArray:
        scaling = self.surrogate.input_scaling
        return np.asarray((self.samples(count) - scaling.offset) / scaling.scale)

    def block(self) -> FloatArray:
        """All outputs that the network knows now, (n, n_outputs): of cells that began from zero
        with the window, those of the last n_out samples."""
        surrogate, network = self.surrogate, self.surrogate.network
        scaled = self._scaled(surrogate.window.n_in + 3)
        if isinstance(network, StateSpace):
            features = plain_features(network.features, scaled)[-network.n_samples :]
            values = plain_pair(network, features)[0][-surrogate.window.n_out :]
        else:
            values = self._values(network, scaled, 1).reshape(-1, len(surrogate.outputs))
        return values * surrogate.output_scaling.scale + surrogate.output_scaling.offset

    def results(self) -> tuple[FloatArray, FloatArray | None]:
        """Outputs and error estimates at the end of the last step."""
        surrogate, estimator = self.surrogate, self.surrogate.estimator
        count = surrogate.window.n_in + 3
        if estimator is not None:
            count = max(count, estimator.network.n_samples + estimator.positions + 2)
        scaled = self._scaled(count)
        values = self._values(surrogate.network, scaled, 1)[:, -len(surrogate.outputs) :]
        outputs = values[0] * surrogate.output_scaling.scale + surrogate.output_scaling.offset
        if estimator is None:
            return outputs, None
        values = self._values(estimator.network, scaled, estimator.positions)
        newest = plain_features(estimator.network.features, scaled)[-estimator.positions :]
        squares = estimator.squares(values, newest, len(outputs))
        return outputs, np.sqrt(squares.mean(axis=0)) * surrogate.output_scaling.scale

    def of_hand_overs(self) -> FloatArray:
        """Outputs at the end of the last step of a cell that goes on from step to step, for all
        the samples at which its states may last have changed places, (n_samples, n_outputs)."""
        surrogate, network = self.surrogate, self.surrogate.network
        assert isinstance(network, StateSpace)
        scaled = self._scaled(2 * network.n_samples + 2)
        features = plain_features(network.features, scaled)[3:]
        values = [
            plain_pair(network, features[-network.n_samples - more :])[0][-1]
            for more in range(network.n_samples)
        ]
        newest = np.array(values)[:, -len(surrogate.outputs) :]
        return newest * surrogate.output_scaling.scale + surrogate.output_scaling.offset

    def step(
        self, length: float, inputs: FloatArray, rates: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Outputs and error estimates at the end of one more step."""
        self.append(length, inputs, rates)
        return self.results()

    @staticmethod
    def _values(network: object, scaled: FloatArray, positions: int) -> FloatArray:
        """Values at the last positions of the samples, (positions, n_values)."""
        assert isinstance(network, StateSpace | FeedForward)
        features = plain_features(network.features, scaled)
        if isinstance(network, StateSpace):
            seen = features[-(network.n_samples + positions - 1) :]
            return plain_pair(network, seen)[0][-positions:]
        ends = range(len(features) - positions + 1, len(features) + 1)
        windows = np.stack([features[end - network.n_samples : end] for end in ends])
        return network.evaluate_features(windows.astype(np.float32)).astype(np.float64)
