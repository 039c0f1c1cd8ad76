"""The layers of a ``torch.nn.Sequential`` are read, as they are in evaluation mode."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np
import torch
from torch import nn

from slide_fmu.apps.from_torch.chain import SIGMOID, Linear, Read, Scaling, Step
from slide_fmu.core.signals import FloatArray

TAKEN = (
    "torch.nn.Sequential of Linear, BatchNorm1d, Flatten, Identity, Dropout, ReLU, "
    "ELU(alpha=1), Tanh, Sigmoid, GELU(approximate='tanh'): train one of these, or learn the "
    "system with slide-fmu"
)
"""The layers that can be taken, for messages."""

Taken = tuple[Step, ...] | str
"""Steps of a layer, or the reason why it cannot be taken."""


def evaluated(module: nn.Module) -> nn.Module:
    """Return a copy of a module on the CPU, in double precision and in evaluation mode.

    Raises:
        TypeError: it is not a torch module.
    """
    if not isinstance(module, nn.Module):
        raise TypeError(
            f"from_torch of {type(module).__name__}; expected a torch.nn.Sequential, or the path "
            "of an ONNX file"
        )
    return copy.deepcopy(module).to("cpu", torch.float64).eval()


def read_layers(module: nn.Module, place: str = "") -> tuple[Read, ...]:
    """Read the layers of a module from ``evaluated``, in their order.

    Nested Sequentials are read too. So is a module with a single child: its ``forward`` is assumed
    to call only that child.
    """
    children = list(module.children())
    if isinstance(module, nn.Sequential):
        places = (f"{place}.{index}".lstrip(".") for index in range(len(module)))
        layers = (read_layers(child, at) for child, at in zip(module, places, strict=True))
        return tuple(read for reads in layers for read in reads)
    if len(children) == 1 and not list(module.parameters(recurse=False)):
        return read_layers(children[0], place)
    kind = type(module).__name__
    name = f"layer {place} ({kind})" if place else f"module ({kind})"
    taken = _taken(module)
    return (Read(name, fault=taken) if isinstance(taken, str) else Read(name, taken),)


def values_of(module: nn.Module, windows: FloatArray) -> FloatArray:
    """Evaluate a module from ``evaluated`` on windows of physical inputs.

    Windows (B, n_in, n_inputs) give values (B, n_values). They are passed unchanged if the first
    layer is a Flatten, and otherwise flattened row by row, (B, n_in * n_inputs).

    Raises:
        ValueError: it returns no values for them.
    """
    first = next((layer for layer in module.modules() if not list(layer.children())), None)
    given = torch.from_numpy(windows)
    given = given if isinstance(first, nn.Flatten) else given.flatten(1)
    try:
        with torch.no_grad():
            return np.asarray(module(given).reshape(len(windows), -1).numpy())
    except Exception as error:  # any error: its forward is the user's code
        raise ValueError(
            f"the module gives no values for a tensor of the shape {tuple(given.shape)} "
            f"({type(error).__name__}: {error}); expected values of the shape (B, n_out * outputs)"
        ) from error


def _taken(layer: nn.Module) -> Taken:
    """Return the steps of a layer, or the reason why it cannot be taken."""
    for kind, read in _READERS.items():
        if isinstance(layer, kind):
            return read(layer)
    if list(layer.children()):
        return (
            "has a forward of its own, of which nothing is known; expected its layers in a "
            "Sequential, or an ONNX file of it"
        )
    return "the runtime has no such layer"


def _linear(layer: nn.Linear) -> Taken:
    if nn.parameter.is_lazy(layer.weight):
        return "has no weights yet; expected a module that was called once"
    weights = _array(layer.weight)
    bias = np.zeros(len(weights)) if layer.bias is None else _array(layer.bias)
    return (Linear(weights, bias),)


def _batch_norm(layer: nn.BatchNorm1d) -> Taken:
    if layer.running_mean is None or layer.running_var is None:
        return "has no running statistics; expected track_running_stats=True"
    mean, variance = _array(layer.running_mean), _array(layer.running_var)
    gain = np.ones(len(mean)) if layer.weight is None else _array(layer.weight)
    shift = np.zeros(len(mean)) if layer.bias is None else _array(layer.bias)
    factor = gain / np.sqrt(variance + layer.eps)
    return (Scaling(factor, shift - factor * mean),)


def _flatten(layer: nn.Flatten) -> Taken:
    if (layer.start_dim, layer.end_dim) != (1, -1):
        return (
            f"flattens the axes {layer.start_dim} to {layer.end_dim}; expected 1 to -1, which "
            "are all but that of the batch"
        )
    return ()


def _elu(layer: nn.ELU) -> Taken:
    return ("elu",) if layer.alpha == 1 else f"has alpha = {layer.alpha:g}; expected alpha = 1"


def _gelu(layer: nn.GELU) -> Taken:
    if layer.approximate != "tanh":
        return f"has approximate = {layer.approximate!r}; expected the form with 'tanh'"
    return ("gelu",)


def _array(tensor: torch.Tensor) -> FloatArray:
    return np.asarray(tensor.detach().numpy(), dtype=np.float64)


_READERS: dict[type[nn.Module], Callable[..., Taken]] = {
    nn.Linear: _linear,
    nn.BatchNorm1d: _batch_norm,
    nn.Flatten: _flatten,
    nn.Identity: lambda _layer: (),
    nn.Dropout: lambda _layer: (),
    nn.ReLU: lambda _layer: ("relu",),
    nn.ELU: _elu,
    nn.Tanh: lambda _layer: ("tanh",),
    nn.Sigmoid: lambda _layer: SIGMOID,
    nn.GELU: _gelu,
}
