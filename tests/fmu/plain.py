"""State-space networks and resampling in plain loops, straight from the definitions."""

from __future__ import annotations

import numpy as np

from slide_fmu.network import FeedForward
from slide_fmu.signals import FloatArray
from slide_fmu.state_space import StateSpace
from slide_fmu.surrogate import Surrogate

SLACK = 1e-6
"""Times that differ by less, in sample steps, are the same."""


def plain_features(network: StateSpace, records: FloatArray) -> FloatArray:
    """Features by their definition, sample by sample: (N, c) to (N, q)."""
    rows = []
    for k in range(len(records)):
        u, before, earlier = (records[max(k - age, 0)] for age in range(3))
        parts = [u, u - before, u - 2 * before + earlier][: network.differences + 1]
        rows.append(np.concatenate(parts) / network.feature_scale)
    return np.array(rows)


def plain_step(network: StateSpace, x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """One cell: the next state and its values."""
    cell = network.cell
    inner = cell.w @ np.concatenate([x, f, [1.0]])
    act = np.tanh(inner) if cell.activation == "tanh" else inner**3
    x = cell.a @ x + cell.b @ f + cell.e @ act
    return x, cell.c @ x + cell.d @ f + cell.d0


def plain_pair(network: StateSpace, features: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two states from zero, restarted in turn: values and truncation errors, (N, n_values)."""
    n = network.n_samples
    older = younger = np.zeros(len(network.cell.a))
    age, error, values, errors = 0, np.zeros(network.n_values), [], []
    largest = np.zeros(network.n_values)  # of what the younger changes, since the last hand-over
    for f in features:
        older, y_old = plain_step(network, older, f)
        younger, y_young = plain_step(network, younger, f)
        age += 1
        weight = max(0.0, (age - (n - network.n_out)) / network.n_out)
        values.append((1 - weight) * y_old + weight * y_young)
        largest = np.maximum(largest, weight * np.abs(y_young - y_old))
        if age == n:
            error, older, younger, age = largest, younger, 0 * younger, 0
            largest = 0 * largest
        errors.append(error)
    return np.array(values), np.array(errors)


class Resampling:
    """The exact window at the end of communication steps of any length. Final.

    Attributes:
        surrogate: what is evaluated.
        lengths: length of every step so far, in s.
        inputs: inputs of every step so far, (n_inputs,) each.
    """

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate
        self.lengths: list[float] = []
        self.inputs: list[FloatArray] = []

    def input_from(self, begin: float) -> FloatArray:
        """The sample that acts for one h from a time on; the first step begins at 0."""
        step, ends = self.surrogate.window.step, np.cumsum(self.lengths)
        if self.surrogate.hold == "held":
            started = np.nonzero(ends - self.lengths <= begin + SLACK * step)[0]
            return self.inputs[started[-1] if len(started) else 0]
        rows = np.array([self.inputs[0], *self.inputs])
        times = [0.0, *ends]
        return np.array([np.interp(begin + step, times, column) for column in rows.T])

    def step(self, length: float, inputs: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Outputs and error estimates at the end of one more step."""
        self.lengths.append(length)
        self.inputs.append(inputs)
        surrogate, end = self.surrogate, sum(self.lengths)
        count = surrogate.window.n_in + 2
        begins = end - surrogate.window.step * np.arange(count, 0, -1)
        samples = np.array([self.input_from(begin) for begin in begins])
        scaled = (samples - surrogate.input_scaling.offset) / surrogate.input_scaling.scale
        values = self._values(surrogate.network, scaled, 1)[:, -len(surrogate.outputs) :]
        outputs = values[0] * surrogate.output_scaling.scale + surrogate.output_scaling.offset
        estimator = surrogate.estimator
        if estimator is None:
            return outputs, None
        values = self._values(estimator.network, scaled, estimator.positions)
        squares = estimator.squares(values, len(outputs))
        return outputs, np.sqrt(squares.mean(axis=0)) * surrogate.output_scaling.scale

    @staticmethod
    def _values(network: object, scaled: FloatArray, positions: int) -> FloatArray:
        """Values at the last positions of the samples, (positions, n_values)."""
        if isinstance(network, StateSpace):
            features = plain_features(network, scaled)[-(network.n_samples + positions - 1) :]
            return plain_pair(network, features)[0][-positions:]
        assert isinstance(network, FeedForward)
        ends = range(len(scaled) - positions + 1, len(scaled) + 1)
        windows = np.stack([scaled[end - network.n_samples : end] for end in ends])
        return network.evaluate(windows).astype(np.float64)
