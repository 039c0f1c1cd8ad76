"""A surrogate that was made of an ONNX file gives what onnxruntime gives."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

import slide_fmu as slide
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.file import unpacked
from tests.libraries import build_libraries
from tests.refusals import refused
from tests.surrogate.networks_of_torch import (
    GIVES,
    INPUTS,
    OUTPUTS,
    SINGLE,
    TAKES,
    WINDOW,
    dense,
    normed,
    record,
    windows_of,
)

OPSET = 20
"""The first one with Gelu."""

Nodes = list[onnx.NodeProto]


def made_of(path: Path) -> slide.Surrogate:
    return slide.from_torch(path, inputs=INPUTS, outputs=OUTPUTS, window=WINDOW)


def answered(path: Path, windows: FloatArray) -> FloatArray:
    """What onnxruntime gives, window by window, shape (B, n_values)."""
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    given = session.get_inputs()[0]
    rows = [row.reshape(1, *given.shape[1:]).astype(np.float32) for row in windows]
    found = [session.run(None, {given.name: row})[0].ravel() for row in rows]
    return np.array(found, dtype=np.float64)


class Graph:
    """Nodes in a row, each on what the one before it gives, with random constants."""

    def __init__(self, *shape: int | str) -> None:
        self.shape = shape
        self.nodes: Nodes = []
        self.constants: list[onnx.TensorProto] = []
        self.current, self.axes = "window", 2
        self.rng = np.random.default_rng(7)

    def random(self, *shape: int) -> str:
        """A constant with random numbers from 0.5 to 1, and random signs if it is a matrix."""
        values = self.rng.uniform(0.5, 1.0, shape) / (shape[0] if len(shape) == 2 else 1)
        if len(shape) == 2:
            values *= self.rng.choice([-1.0, 1.0], shape)
        return self.constant(values.astype(np.float32))

    def constant(self, values: np.ndarray) -> str:
        self.constants.append(numpy_helper.from_array(values, f"constant{len(self.constants)}"))
        return str(self.constants[-1].name)

    def add(self, kind: str, *constants: str, first: bool = True, **attributes: object) -> Graph:
        """Add a node; what the chain gives is its first input, or its last one."""
        inputs = [self.current, *constants] if first else [*constants, self.current]
        self.current = f"tensor{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [self.current], **attributes))
        return self

    def dense(self, takes: int = TAKES, gives: int = GIVES) -> Graph:
        return self.add("MatMul", self.random(takes, gives)).add("Add", self.random(gives))

    def save(self, folder: Path) -> Path:
        graph = helper.make_graph(
            self.nodes,
            "network",
            [helper.make_tensor_value_info("window", TensorProto.FLOAT, self.shape)],
            [helper.make_tensor_value_info(self.current, TensorProto.FLOAT, ["n"] * self.axes)],
            self.constants,
        )
        model = helper.make_model(
            graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=10
        )
        onnx.save(model, folder / "network.onnx")
        return folder / "network.onnx"


def window_graph() -> Graph:
    """A graph on windows (1, n_in, n_inputs)."""
    return Graph(1, WINDOW.n_in, len(INPUTS))


def flat_graph() -> Graph:
    """A graph on flattened windows."""
    return Graph(1, TAKES)


def gemm() -> Graph:
    graph = flat_graph().add("Identity").add("Dropout")
    graph.add("Gemm", graph.random(9, TAKES), graph.random(9), transB=1, alpha=0.5, beta=2.0)
    graph.add("Relu").add("Gemm", graph.random(9, 5)).add("Elu")
    return graph.add("Gemm", graph.random(5, GIVES), graph.random(1))


def matmul() -> Graph:
    graph = window_graph().add("Flatten").dense(gives=8).add("Tanh").dense(8, 8)
    return graph.add("Sigmoid").dense(8, 8).add("Gelu", approximate="tanh").dense(8)


def scaled() -> Graph:
    """Inputs are scaled channel by channel before the window is flattened, outputs at the end."""
    graph = window_graph()
    graph.add("Sub", graph.random(2)).add("Div", graph.random(1, 1, 2))
    graph.add("Reshape", graph.constant(np.array([1, -1]))).dense(gives=7).add("Tanh").dense(7)
    graph.add("Sub", graph.random(GIVES), first=False).add("Mul", graph.random(1))
    graph.axes = 3
    return graph.add("Reshape", graph.constant(np.array([1, WINDOW.n_out, len(OUTPUTS)])))


def normalised() -> Graph:
    graph = flat_graph().dense(gives=7)
    graph.add("BatchNormalization", *(graph.random(7) for _ in range(4)), epsilon=1e-3)
    return graph.add("Relu").dense(7)


def derived() -> Graph:
    """Weights that are made of other constants, and axes that come and go."""
    graph = flat_graph()
    weights = graph.random(GIVES, TAKES)
    graph.nodes.append(helper.make_node("Transpose", [weights], ["turned"], perm=[1, 0]))
    graph.add("Unsqueeze", graph.constant(np.array([1]))).add("MatMul", "turned")
    return graph.add("Squeeze", graph.constant(np.array([1])))


def asking() -> Graph:
    """A window that is flattened to the shape that it has, as for a batch that is open."""
    graph = window_graph()
    graph.nodes.append(helper.make_node("Shape", ["window"], ["shape"]))
    graph.nodes.append(helper.make_node("Gather", ["shape", graph.constant(np.array([0]))], ["b"]))
    rest = graph.constant(np.array([-1]))
    graph.nodes.append(helper.make_node("Concat", ["b", rest], ["wanted"], axis=0))
    return graph.add("Reshape", "wanted").dense()


GRAPHS: dict[str, Callable[[], Graph]] = {
    "gemm": gemm,
    "matmul": matmul,
    "scaled": scaled,
    "normalised": normalised,
    "derived": derived,
    "asking": asking,
}


@pytest.mark.parametrize("name", GRAPHS)
def test_surrogate_gives_what_onnxruntime_gives(name: str, tmp_path: Path) -> None:
    path, inputs = GRAPHS[name]().save(tmp_path), record()
    surrogate = made_of(path)
    expected = answered(path, windows_of(inputs))
    atol = SINGLE * np.abs(expected).max()
    found = surrogate.predict_windows(windows_of(inputs)).reshape(expected.shape)
    np.testing.assert_allclose(found, expected, rtol=0, atol=atol)
    newest = expected[:, -len(OUTPUTS) :]
    np.testing.assert_allclose(surrogate.predict_newest(inputs), newest, rtol=0, atol=atol)


def exported(module: nn.Module, path: Path) -> Path:
    """What torch itself writes, by its exporter that needs no further package."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        example = (torch.zeros(1, WINDOW.n_in, len(INPUTS)),)
        torch.onnx.export(module.eval(), example, str(path), dynamo=False, opset_version=OPSET)
    return path


MODULES: dict[str, Callable[[], nn.Module]] = {
    "elu": lambda: dense(nn.ELU()),
    "gelu": lambda: dense(nn.GELU(approximate="tanh")),
    "norm": lambda: nn.Sequential(nn.Flatten(), nn.Linear(TAKES, 6), nn.ReLU(), normed(6)),
}


@pytest.mark.parametrize("name", MODULES)
def test_fmu_of_what_torch_exports_gives_what_onnxruntime_gives(name: str, tmp_path: Path) -> None:
    build_libraries()
    path, inputs = exported(MODULES[name](), tmp_path / "module.onnx"), record()
    expected = answered(path, windows_of(inputs))[:, -len(OUTPUTS) :]
    with unpacked(slide.export_fmu(made_of(path), tmp_path / "module.fmu")) as fmu:
        columns = {signal.name: inputs[:, i] for i, signal in enumerate(INPUTS)}
        found = run_fmu(fmu, columns, [signal.name for signal in OUTPUTS]).values[1:]
    np.testing.assert_allclose(found, expected, rtol=0, atol=SINGLE * np.abs(expected).max())


def branched() -> Graph:
    graph = flat_graph()
    graph.nodes.append(helper.make_node("Tanh", ["window"], ["other"]))
    return graph.add("Relu").add("Add", "other").dense()


def constant_last() -> Graph:
    graph = flat_graph()
    return graph.add("MatMul", graph.random(GIVES, 1), first=False)


def with_constant(kind: str, *shape: int, first: bool = True) -> Graph:
    graph = flat_graph()
    return graph.add(kind, graph.random(*shape), first=first).dense()


def divided_by_zero() -> Graph:
    graph = flat_graph()
    return graph.add("Div", graph.constant(np.zeros(1, np.float32))).dense()


def with_bias(size: int) -> Graph:
    graph = flat_graph()
    return graph.add("Gemm", graph.random(TAKES, GIVES), graph.random(size))


def training_norm() -> Graph:
    graph = normalised()
    norm = next(node for node in graph.nodes if node.op_type == "BatchNormalization")
    norm.attribute.append(helper.make_attribute("training_mode", 1))
    return graph


REFUSED: dict[str, tuple[Callable[[], Graph], str, str]] = {
    "softmax": (lambda: flat_graph().add("Softmax").dense(), "node 0 (Softmax)", "a chain of"),
    "exact gelu": (lambda: flat_graph().add("Gelu").dense(), "node 0 (Gelu)", "'tanh'"),
    "alpha": (lambda: flat_graph().add("Elu", alpha=2.0).dense(), "alpha = 2", "alpha = 1"),
    "branches": (branched, "goes to the nodes", "without branches"),
    "no constant weights": (constant_last, "node 0 (MatMul)", "first input"),
    "division": (lambda: with_constant("Div", 1, first=False), "(Div)", "constant divisor"),
    "constant for a batch": (lambda: with_constant("Add", 3, TAKES), "(3, 24)", "(1, 24)"),
    "zero": (divided_by_zero, "node 0 (Div)", "expected finite"),
    "bias": (lambda: with_bias(2), "its constant has the shape (2,)", "(1, 6)"),
    "not flattened": (lambda: window_graph().dense(2, 3), "(1, 12, 2)", "Flatten"),
    "training": (training_norm, "(BatchNormalization)", "evaluation mode"),
    "window": (lambda: Graph(1, 13, 2).dense(), "[1, 13, 2]", "(batch, 12, 2)"),
    "batch": (lambda: Graph(5, TAKES).dense(), "[5, 24]", "open or 1"),
    "outputs": (lambda: flat_graph().dense(gives=4), "gives 4 values", "3 x 2 = 6"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_graph_that_cannot_be_taken_is_refused(name: str, tmp_path: Path) -> None:
    make, what, expected = REFUSED[name]
    path = make().save(tmp_path)
    with pytest.raises(ValueError) as refused:  # noqa: PT011 (the words are in the table)
        made_of(path)
    assert what in str(refused.value)
    assert expected in str(refused.value)


def test_every_node_that_cannot_be_taken_has_a_line(tmp_path: Path) -> None:
    path = flat_graph().add("Softmax").dense(gives=4).add("Cos").dense(4).save(tmp_path)
    with pytest.raises(ValueError, match="cannot be taken") as refused:
        made_of(path)
    lines = str(refused.value).splitlines()[1:-1]
    assert [line.split(":")[0].strip() for line in lines] == ["node 0 (Softmax)", "node 3 (Cos)"]


def test_open_sizes_are_those_of_the_window(tmp_path: Path) -> None:
    path = Graph("batch", "time", 2).add("Flatten").dense().save(tmp_path)
    assert made_of(path).network.n_samples == WINDOW.n_in


def test_file_that_is_no_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "network.onnx"
    path.write_bytes(b"no protobuf")
    with pytest.raises(ValueError, match="is no ONNX model") as refused:
        made_of(path)
    assert "expected a valid one" in str(refused.value)
    with pytest.raises(FileNotFoundError):
        made_of(tmp_path / "missing.onnx")


def test_missing_package_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = flat_graph().dense().save(tmp_path)
    monkeypatch.delitem(sys.modules, "slide_fmu.apps.from_torch.onnx_nodes", raising=False)
    monkeypatch.delattr("slide_fmu.apps.from_torch.onnx_nodes", raising=False)
    monkeypatch.setitem(sys.modules, "onnx", None)
    with refused(ModuleNotFoundError, "extra 'onnx'"):
        made_of(path)
