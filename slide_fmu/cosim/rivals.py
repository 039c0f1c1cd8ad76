"""The same networks without the native runtime: PythonFMU with numpy; torch and onnxruntime in
process, on one thread.

Packages are imported where they are needed: a rival that is not installed is an ImportError.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.base import Float32Array
from slide_fmu.network.feed_forward import FeedForward
from slide_fmu.network.state_space import StateSpace
from slide_fmu.network.state_space.roles import Roles
from slide_fmu.python_fmu.writer import write_python_fmu
from slide_fmu.surrogate.surrogate import Surrogate

Evaluation = Callable[[Float32Array], object]
"""Evaluates features of windows, shape (B, n_first)."""


class RivalError(ValueError):
    """A rival does not know such a network."""


SCRIPT = '''
from pathlib import Path
import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from slide_fmu.features.base import BEFORE
from slide_fmu.features.differences import Differences
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.feed_forward import FeedForward
from slide_fmu.surrogate.surrogate import Surrogate


class Seen:
    """What a network sees of the newest inputs, in plain numpy."""

    def __init__(self, features):
        self.set, self.chosen = features.features, np.array(features.chosen)
        self.offset, self.scale, self.recent = features.offset, features.scale, None
        inputs = isinstance(self.set, Differences) and self.set.order == 0
        as_they_are = inputs and np.array_equal(self.chosen, np.arange(self.set.n_signals))
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
            self.act, self.units = ACTIVATIONS[cell.activation], len(cell.w)
        self.fade, self.age = network.fade(), 0
        self.x = np.zeros((2, n), np.float32)

    def plain_units(self, x, f):
        total = x @ self.of_x + (self.of_f @ f[self.drive] + self.bias)
        return total[:, self.units :] + self.act(total[:, : self.units]) @ self.e

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
        self.surrogate = Surrogate.load(Path({path!r}))
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
'''


def python_fmu(surrogate: Surrogate, folder: Path) -> Path:
    """The surrogate as FMU by PythonFMU and numpy; it works as long as the folder is there."""
    surrogate.save(folder / "surrogate.slide")
    script = SCRIPT.format(path=str(folder / "surrogate.slide"))
    return write_python_fmu("NumpySurrogate", script, folder / "NumpySurrogate.fmu")


def torch_layers(network: FeedForward) -> Evaluation:
    """A feed-forward network in torch, eager.

    Raises:
        ImportError: torch is not installed.
        RivalError: it has no such units.
    """
    import torch

    torch.set_num_threads(1)
    names: dict[str, Callable[[], torch.nn.Module]] = {
        "identity": torch.nn.Identity,
        "relu": torch.nn.ReLU,
        "elu": torch.nn.ELU,
        "tanh": torch.nn.Tanh,
        "gelu": lambda: torch.nn.GELU(approximate="tanh"),
    }
    modules: list[torch.nn.Module] = []
    for layer in network.layers:
        if layer.activation not in names:
            raise RivalError(f"torch: no module for layers with {layer.activation} units")
        linear = torch.nn.Linear(*layer.weights.shape[::-1])
        linear.weight.data = torch.from_numpy(layer.weights)
        linear.bias.data = torch.from_numpy(layer.bias)
        modules += [linear, names[layer.activation]()]
    module = torch.nn.Sequential(*modules)
    skip = None if network.skip is None else torch.from_numpy(network.skip.T.copy())

    def evaluate(features: Float32Array) -> object:
        with torch.inference_mode():
            x = torch.from_numpy(features)
            return (module(x) if skip is None else module(x) + x @ skip).numpy()

    return evaluate


def onnx_layers(network: FeedForward) -> Evaluation:
    """A feed-forward network in onnxruntime.

    Raises:
        ImportError: onnx or onnxruntime is not installed.
        RivalError: it has no such units.
    """
    import onnx
    import onnxruntime

    helper, kinds = onnx.helper, {"relu": "Relu", "elu": "Elu", "tanh": "Tanh"}
    nodes, weights, last = [], [], "x"
    for index, layer in enumerate(network.layers):
        for part, array in (("w", layer.weights), ("b", layer.bias)):
            weights.append(onnx.numpy_helper.from_array(array, f"{part}{index}"))
        names = [last, f"w{index}", f"b{index}"]
        nodes.append(helper.make_node("Gemm", names, [f"s{index}"], transB=1))
        last = f"s{index}"
        if layer.activation != "identity":
            if layer.activation not in kinds:
                raise RivalError(f"onnxruntime: no graph for {layer.activation} units")
            nodes.append(helper.make_node(kinds[layer.activation], [last], [f"a{index}"]))
            last = f"a{index}"
    if network.skip is not None:
        weights.append(onnx.numpy_helper.from_array(network.skip, "skip"))
        nodes.append(helper.make_node("Gemm", ["x", "skip", last], ["y"], transB=1))
        last = "y"
    ends = [
        helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, ["batch", width])
        for name, width in (("x", network.layers[0].weights.shape[1]), (last, network.n_values))
    ]
    graph = helper.make_graph(nodes, "layers", ends[:1], ends[1:], weights)
    opset = [helper.make_opsetid("", 17)]
    model = helper.make_model(graph, opset_imports=opset, ir_version=8)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        model.SerializeToString(), options, providers=["CPUExecutionProvider"]
    )
    return lambda features: session.run(None, {"x": features})[0]


def _order(features: FeatureMap) -> int:
    """Order of the differences that are all the features, in their order and not centred.

    Raises:
        RivalError: they are something else.
    """
    found, every = features.features, tuple(range(features.features.n_signals))
    if not isinstance(found, Differences) or features.chosen != every or features.offset.any():
        raise RivalError("torch: other features than differences of the inputs")
    return found.order


class TorchCells:
    """A plain cell by ping-pong, as StateSpace.stepper, in torch. Final.

    Raises:
        ImportError: torch is not installed.
        RivalError: gated cells, or features of other kinds or in several roles.
    """

    def __init__(self, network: StateSpace) -> None:
        import torch

        torch.set_num_threads(1)
        self.torch = torch
        cell, every = network.cell, tuple(range(network.features.n_signals))
        if cell.gated or network.roles != Roles(every, every):
            raise RivalError("torch: gated cells, or features in several roles")
        self.network, self.n = network, len(cell.a)
        self.w, self.c, self.d0 = (torch.from_numpy(m.T.copy()) for m in (cell.w, cell.c, cell.d0))
        joined = [torch.from_numpy(m) for m in (cell.a, cell.b, torch.zeros(self.n, 1).numpy())]
        self.ab = torch.cat(joined, 1).T.contiguous()
        self.e, self.d = torch.from_numpy(cell.e.T.copy()), torch.from_numpy(cell.d.T.copy())
        self.act = torch.tanh if cell.activation == "tanh" else lambda v: v * v * v
        self.z = torch.zeros(2, self.n + cell.b.shape[1] + 1)
        self.z[:, -1] = 1
        self.order, self.scale = _order(network.features), torch.from_numpy(network.features.scale)
        self.recent = torch.zeros(3, network.n_channels, dtype=torch.float64)
        self.fade, self.age = network.fade().tolist(), 0

    def step(self, row: Any) -> object:
        """One sample of scaled inputs, shape (n_channels,); the values."""
        torch = self.torch
        self.recent = torch.roll(self.recent, -1, 0)
        self.recent[-1] = torch.from_numpy(row)
        blocks = [torch.diff(self.recent, k, 0)[-1] for k in range(self.order + 1)]
        features = (torch.cat(blocks) / self.scale).float()
        z, n = self.z, self.n
        z[:, n:-1] = features
        z[:, :n] = z @ self.ab + self.act(z @ self.w) @ self.e
        older, younger = z[:, :n] @ self.c + features @ self.d + self.d0
        values = older + self.fade[self.age] * (younger - older)
        self.age += 1
        if self.age == self.network.n_samples:
            z[0, :n], z[1, :n], self.age = z[1, :n].clone(), 0, 0
        return values.numpy()
