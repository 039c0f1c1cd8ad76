"""Feed-forward networks in torch and in onnxruntime."""

from __future__ import annotations

from collections.abc import Callable

from baselines import BaselineError
from slide_fmu.network.base import Float32Array
from slide_fmu.network.feed_forward.network import FeedForward

Evaluation = Callable[[Float32Array], object]
"""Evaluates features of windows, shape (B, n_first)."""


def torch_layers(network: FeedForward) -> Evaluation:
    """A feed-forward network in torch, eager.

    Raises:
        ImportError: torch is not installed.
        BaselineError: it has no such units.
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
            raise BaselineError(f"torch: no module for layers with {layer.activation} units")
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
        BaselineError: it has no such units.
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
                raise BaselineError(f"onnxruntime: no graph for {layer.activation} units")
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
