"""The nodes of an ONNX graph are read; they must be a chain from its input to its output."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx.reference import ReferenceEvaluator

from slide_fmu.apps.from_torch.chain import SIGMOID, Linear, Read, Scaling, Step
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window

TAKEN = (
    "a chain of Gemm, MatMul, Add, Sub, Mul, Div with constants, BatchNormalization, Flatten, "
    "Reshape, Squeeze, Unsqueeze, Identity, Dropout, Relu, Elu(alpha=1), Tanh, Sigmoid, "
    "Gelu(approximate='tanh'): train one of these, or learn the system with slide-fmu"
)
"""The nodes that can be taken, for messages."""

ALIKE = ("Flatten", "Reshape", "Squeeze", "Unsqueeze", "Identity", "Dropout")
"""Operators that keep all values and their order."""

Constants = dict[str, NDArray[Any]]


class Refused(Exception):
    """A node cannot be taken; the message says why."""


@dataclass(frozen=True, eq=False)
class _Node:
    """A _Node is a node with knowledge of its surroundings.

    Attributes:
        node: the node.
        current: name of the tensor that the chain has reached.
        shape: shape of that tensor for a batch of one; None after a node that cannot be taken.
        constants: all tensors that do not depend on the input, by name.
        opsets: versions of the operators, by domain.
    """

    node: Any
    current: str
    shape: tuple[int, ...] | None
    constants: Constants
    opsets: Mapping[str, int]

    def attribute(self, name: str, default: Any) -> Any:
        for attribute in self.node.attribute:
            if attribute.name == name:
                value = onnx.helper.get_attribute_value(attribute)
                return value.decode() if isinstance(value, bytes) else value
        return default

    def constant(self, index: int) -> FloatArray:
        """Return an argument that must be constant."""
        name = self.node.input[index]
        if name not in self.constants:
            raise Refused(f"its input {name!r} is not constant; expected a constant tensor")
        return np.asarray(self.constants[name], dtype=np.float64)

    def require_first(self) -> None:
        """Refuse a node whose first input is not the chain's tensor."""
        if self.node.input[0] != self.current:
            raise Refused("its first input is constant; expected what the node before it gives")


def _spread(values: FloatArray, shape: tuple[int, ...] | None) -> FloatArray:
    """Repeat constants for all values of a tensor of a shape, row by row."""
    if shape is None:
        return values.ravel() if values.size > 1 else values.reshape(())
    try:
        return np.asarray(np.broadcast_to(values, shape).ravel())
    except ValueError:
        raise Refused(
            f"its constant has the shape {values.shape}; expected one that fits {shape}, which is "
            "that of a batch of one"
        ) from None


def read_nodes(path: Path, window: Window, n_inputs: int) -> tuple[Read, ...]:
    """Read the nodes of an ONNX file from its input on.

    Args:
        path: the file; its input has the shape (batch, n_in, n_inputs) or (batch, n_in *
            n_inputs), with a batch that is open or 1.
        window: gives n_in.
        n_inputs: number of inputs.

    Raises:
        ValueError: the file is not an ONNX model, or its input has another shape.
    """
    try:
        model = onnx.load(str(path))
        onnx.checker.check_model(model)
    except OSError:
        raise
    except Exception as error:  # protobuf and the checker have no class in common
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise ValueError(f"{path} is no ONNX model ({reason}); expected a valid one") from error
    opsets = {entry.domain: entry.version for entry in model.opset_import}
    graph = model.graph
    initial = {tensor.name: onnx.numpy_helper.to_array(tensor) for tensor in graph.initializer}
    constants = _constants(graph, initial, opsets)
    given = [value for value in graph.input if value.name not in constants]
    if (len(given), len(graph.output)) != (1, 1):
        raise ValueError(
            f"{path} has {len(given)} inputs and {len(graph.output)} outputs; expected one tensor "
            "of each"
        )
    shape = _input_shape(given[0], window.n_in, n_inputs)
    return _chain(graph, given[0].name, shape, constants, opsets)


def _constants(graph: Any, known: Constants, opsets: Mapping[str, int]) -> Constants:
    """Return the known constant tensors, and tensors computed from constants only."""
    constants = dict(known)
    for node in graph.node:
        names = [name for name in node.input if name]
        if node.output[0] in constants or not all(name in constants for name in names):
            continue
        try:
            values = _run(node, opsets, {name: constants[name] for name in names})
        except Exception:  # any error: the node that uses its result is refused later
            continue
        constants.update(zip(node.output, values, strict=False))
    return constants


def _run(node: Any, opsets: Mapping[str, int], given: Constants) -> list[NDArray[Any]]:
    """Evaluate a node on tensors, by its definition in the ONNX standard."""
    values: list[Any] = list(ReferenceEvaluator(node, opsets=dict(opsets)).run(None, given))
    return values


def _input_shape(given: Any, n_in: int, n_inputs: int) -> tuple[int, ...]:
    """Return the shape of the input for a batch of one; open sizes take the expected value."""
    sizes = [
        dim.dim_value if dim.dim_value > 0 else None for dim in given.type.tensor_type.shape.dim
    ]
    for expected in ((1, n_in, n_inputs), (1, n_in * n_inputs)):
        pairs = zip(sizes, expected, strict=False)
        if len(sizes) == len(expected) and all(size in (None, fits) for size, fits in pairs):
            return expected
    raise ValueError(
        f"input {given.name!r} has the shape {['open' if s is None else s for s in sizes]}; "
        f"expected (batch, n_in, inputs) = (batch, {n_in}, {n_inputs}) or (batch, "
        f"{n_in * n_inputs}), with a batch that is open or 1"
    )


def _chain(
    graph: Any,
    current: str,
    shape: tuple[int, ...] | None,
    constants: Constants,
    opsets: Mapping[str, int],
) -> tuple[Read, ...]:
    """Follow the chain from its input to its output; the shapes it uses are constants."""
    reads: list[Read] = []
    output = graph.output[0].name
    while current != output:
        users = [(i, node) for i, node in enumerate(graph.node) if current in node.input]
        asked = [node for _, node in users if node.op_type == "Shape"]
        if asked and shape is not None:
            zeros = {current: np.zeros(shape)}
            shapes = {node.output[0]: _run(node, opsets, zeros)[0] for node in asked}
            constants = _constants(graph, {**constants, **shapes}, opsets)
        users = [(i, node) for i, node in users if node.op_type != "Shape"]
        if len(users) != 1 or list(users[0][1].input).count(current) != 1:
            names = [f"{i} ({node.op_type})" for i, node in users]
            fault = f"goes to the nodes {names}; expected one: a chain without branches"
            return (*reads, Read(f"tensor {current!r}", fault=fault))
        index, node = users[0]
        name = f"node {index} ({node.op_type})"
        at = _Node(node, current, shape, constants, opsets)
        try:
            with np.errstate(all="ignore"):  # numbers that are not finite are refused later
                steps, shape = _read(at)
            reads.append(Read(name, steps))
        except Refused as refused:
            reads.append(Read(name, fault=str(refused)))
            shape = None
        current = node.output[0]
    return tuple(reads)


def _read(at: _Node) -> tuple[tuple[Step, ...], tuple[int, ...] | None]:
    """Read a node: return its steps, and the shape of its result for a batch of one."""
    kind = at.node.op_type
    if kind in ALIKE:
        return (), _shape_after(at)
    if kind in ("Gemm", "MatMul"):
        if at.shape is not None and math.prod(at.shape[:-1]) != 1:
            raise Refused(
                f"works on the last axis of the shape {at.shape}; expected a flattened window, "
                f"{(1, math.prod(at.shape))}: put a Flatten before it"
            )
        linear = _gemm(at) if kind == "Gemm" else _matmul(at)
        before = (1,) if at.shape is None else at.shape[:-1]
        return (linear,), (*before, len(linear.bias))
    if kind not in _READERS:
        raise Refused("the runtime has no such layer")
    return _READERS[kind](at), at.shape


def _shape_after(at: _Node) -> tuple[int, ...] | None:
    """Return the shape after a node that keeps the values and their order."""
    at.require_first()
    if at.shape is None:
        return None
    known = {name: at.constants[name] for name in at.node.input if name in at.constants}
    given = {**known, at.current: np.zeros(at.shape, np.float32)}
    try:
        results = _run(at.node, at.opsets, given)
    except Exception as error:  # any error: the shape does not fit this tensor
        raise Refused(f"does not fit the shape {at.shape}, for a batch of one") from error
    return tuple(int(size) for size in np.shape(results[0]))


def _gemm(at: _Node) -> Linear:
    at.require_first()
    if at.attribute("transA", 0):
        raise Refused("has transA = 1; expected 0")
    weights = at.constant(1)
    weights = at.attribute("alpha", 1.0) * (weights if at.attribute("transB", 0) else weights.T)
    bias = np.zeros(len(weights))
    if len(at.node.input) > 2 and at.node.input[2]:
        bias = at.attribute("beta", 1.0) * _spread(at.constant(2), (1, len(weights)))
    return Linear(weights, bias)


def _matmul(at: _Node) -> Linear:
    at.require_first()
    weights = at.constant(1)
    if weights.ndim != 2:
        raise Refused(f"has a constant with {weights.ndim} axes; expected a matrix")
    return Linear(weights.T, np.zeros(weights.shape[1]))


def _elementwise(at: _Node) -> tuple[Step, ...]:
    """Read a node that adds, subtracts, multiplies or divides by constants."""
    kind, is_first = at.node.op_type, at.node.input[0] == at.current
    values = _spread(at.constant(1 if is_first else 0), at.shape)
    one, none = np.ones_like(values), np.zeros_like(values)
    if kind == "Add":
        return (Scaling(one, values),)
    if kind == "Mul":
        return (Scaling(values, none),)
    if kind == "Sub":
        return (Scaling(one, -values) if is_first else Scaling(-one, values),)
    if not is_first:
        raise Refused("divides a constant; expected a constant divisor")
    return (Scaling(1 / values, none),)


def _batch_norm(at: _Node) -> tuple[Step, ...]:
    at.require_first()
    if at.attribute("training_mode", 0):
        raise Refused("is in training mode; expected the evaluation mode")
    gain, shift, mean, variance = (at.constant(index) for index in range(1, 5))
    factor = gain / np.sqrt(variance + at.attribute("epsilon", 1e-5))
    axes = (1,) * (0 if at.shape is None else len(at.shape) - 2)
    rows = [values.reshape(-1, *axes) for values in (factor, shift - factor * mean)]
    return (Scaling(*(_spread(row, at.shape) for row in rows)),)


def _elu(at: _Node) -> tuple[Step, ...]:
    alpha = at.attribute("alpha", 1.0)
    if alpha != 1:
        raise Refused(f"has alpha = {alpha:g}; expected alpha = 1")
    return ("elu",)


def _gelu(at: _Node) -> tuple[Step, ...]:
    form = at.attribute("approximate", "none")
    if form != "tanh":
        raise Refused(f"has approximate = {form!r}; expected the form with 'tanh'")
    return ("gelu",)


_READERS: dict[str, Callable[[_Node], tuple[Step, ...]]] = {
    **dict.fromkeys(("Add", "Sub", "Mul", "Div"), _elementwise),
    "BatchNormalization": _batch_norm,
    "Relu": lambda _at: ("relu",),
    "Elu": _elu,
    "Tanh": lambda _at: ("tanh",),
    "Sigmoid": lambda _at: SIGMOID,
    "Gelu": _gelu,
}
