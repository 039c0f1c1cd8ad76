"""The surrogate as an FMU of PythonFMU with numpy: this file is the FMU's script.

``write_numpy_fmu`` puts its own source into the FMU, beside the surrogate file.
"""

from pathlib import Path

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

from slide_fmu.features.base import BEFORE
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.surrogate.surrogate import Surrogate

FILE = "surrogate.slide"


def write_numpy_fmu(surrogate, folder):
    """Write the FMU of a surrogate to a folder; returns its path."""
    from tests.python_fmus import write_python_fmu

    path = folder / "NumpySurrogate.fmu"
    return write_python_fmu("NumpySurrogate", Path(__file__), path, {FILE: surrogate.to_bytes()})


class Seen:
    """What a network sees of the newest inputs, in plain numpy."""

    def __init__(self, features):
        self.set, self.chosen = features.features, np.array(features.chosen)
        self.offset, self.scale = features.scaling.offset, features.scaling.scale
        self.recent = None
        as_they_are = self.set.n_before == 0 and np.array_equal(
            self.chosen, np.arange(self.set.n_signals)
        )
        self.as_they_are = as_they_are and not self.offset.any() and np.all(self.scale == 1)

    def of(self, row):
        if self.as_they_are:
            return row.astype(np.float32)
        if self.recent is None:
            self.recent = np.repeat(row[None], BEFORE + 1, axis=0)
        else:
            self.recent[:-1] = self.recent[1:]
            self.recent[-1] = row
        signals = self.set.of(self.recent[None])[0, 0, self.chosen]
        return ((signals - self.offset) / self.scale).astype(np.float32)


class Window:
    """A feed-forward network in plain numpy, window shifted in place."""

    def __init__(self, network):
        self.network, self.seen = network, Seen(network.features)
        self.samples = np.zeros((1, network.n_samples, network.features.n_signals), np.float32)

    def step(self, row):
        self.samples[0, :-1] = self.samples[0, 1:]
        self.samples[0, -1] = self.seen.of(row)
        return self.network.evaluate_features(self.samples)[0]


class PingPong:
    """A state-space network in plain numpy: both states in the rows of one small matrix."""

    def __init__(self, network):
        cell, roles, n = network.cell, network.roles, len(network.cell.a)
        self.network, self.seen = network, Seen(network.features)
        self.drive, self.static, self.readout, self.schedule, self.gated, self.turn = (
            np.array(indices, int)
            for indices in (
                *(roles.drive, roles.static, roles.readout),
                *(roles.schedule, roles.gated, roles.turn),
            )
        )
        self.a, self.b, self.c, self.e = cell.a.T.copy(), cell.b, cell.c.T.copy(), cell.e.T.copy()
        self.d, self.d0, self.pairs = cell.d, cell.d0, 2 * network.turned
        self.move = self.gated_units if cell.gated else self.plain_units
        if cell.gated:
            self.w, self.open = cell.w[:, :-1], cell.w[:, -1]
            self.of_x, self.offered = cell.v[:, :n].T.copy(), cell.v[:, n:]
        else:
            self.of_x = np.concatenate([cell.w[:, :n], cell.a]).T.copy()
            self.of_f = np.concatenate([cell.w[:, n:-1], cell.b])
            self.bias = np.concatenate([cell.w[:, -1], np.zeros(n, np.float32)])
            self.act, self.units = ACTIVATIONS[cell.activation].value, len(cell.w)
        self.fade, self.age = network.fade(), 0
        self.x = np.zeros((2, n), np.float32)

    def plain_units(self, x, f):
        total = x @ self.of_x + (self.of_f @ f[self.drive] + self.bias)
        return total[:, self.units :] + self.act(total[:, : self.units], np) @ self.e

    def gated_units(self, x, f):
        gates = np.tanh(self.w @ f[self.schedule] + self.open)
        offered, inside = self.offered @ f[self.gated], x
        if self.pairs:
            c, s = f[self.turn]
            back = np.array([[c, -s], [s, c]])
            inside = self.turned(x.copy(), back)
        added = (gates * (inside @ self.of_x + offered)) @ self.e
        if self.pairs:
            added = self.turned(added, back.T)
        return x @ self.a + self.b @ f[self.drive] + added

    def turned(self, vectors, turn):
        part = vectors[:, : self.pairs]
        part[:] = (part.reshape(2, -1, 2) @ turn).reshape(2, -1)
        return vectors

    def step(self, row):
        f = self.seen.of(row)
        x = self.move(self.x, f)
        values = x @ self.c + (self.d @ f[self.static] + self.d0)
        if len(self.readout):
            shares = values.reshape(2, -1, 1 + len(self.readout))
            values = shares[:, :, 0] + shares[:, :, 1:] @ f[self.readout]
        older, younger = values
        values = older + self.fade[self.age] * (younger - older)
        self.age += 1
        if self.age == self.network.n_samples:
            x[0], x[1], self.age = x[1], 0, 0
        self.x = x
        return values


def stepper(network):
    return Window(network) if isinstance(network, FeedForward) else PingPong(network)


class NumpySurrogate(Fmi2Slave):
    """The networks of a surrogate in plain numpy."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.surrogate = Surrogate.from_bytes((Path(self.resources) / FILE).read_bytes())
        surrogate = self.surrogate
        self.u = surrogate.starts
        self.y = np.zeros(len(surrogate.outputs))
        self.e = np.zeros(len(surrogate.outputs))
        self.predictor = stepper(surrogate.network)
        estimator = surrogate.estimator
        if estimator is not None:
            self.estimator = stepper(estimator.network)
            self.squares = np.zeros((estimator.positions, len(surrogate.outputs)))
        names = [signal.name for signal in surrogate.outputs]
        estimates = [] if estimator is None else [name + "_error_estimate" for name in names]
        for signals, values, causality in (
            ([signal.name for signal in surrogate.inputs], self.u, Fmi2Causality.input),
            (names, self.y, Fmi2Causality.output),
            (estimates, self.e, Fmi2Causality.output),
        ):
            for i, name in enumerate(signals):
                self.register_variable(
                    Real(
                        name,
                        causality=causality,
                        getter=lambda values=values, i=i: float(values[i]),
                        setter=lambda v, values=values, i=i: values.__setitem__(i, v),
                    )
                )

    def do_step(self, current_time, step_size):
        surrogate = self.surrogate
        row = surrogate.input_scaling.apply(self.u)
        values = self.predictor.step(row)[-len(self.y) :]
        self.y[:] = surrogate.output_scaling.invert(values)
        estimator = surrogate.estimator
        if estimator is not None:
            values = self.estimator.step(row)[None]
            self.squares[:-1] = self.squares[1:]
            newest = self.estimator.samples[:, -1]
            self.squares[-1] = estimator.squares(values, newest, len(self.y))[0]
            self.e[:] = np.sqrt(self.squares.mean(axis=0)) * surrogate.output_scaling.scale
        return True
