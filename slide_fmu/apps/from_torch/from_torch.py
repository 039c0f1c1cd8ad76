"""A network trained with torch, or stored in an ONNX file, becomes a surrogate."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slide_fmu.apps.from_torch.chain import network_of
from slide_fmu.core.extras import how_to_install
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.window import Window
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    import torch

TRIALS = 8
"""Number of windows within the ranges on which module and surrogate must agree."""

AGREE = 1e-4
"""Tolerance relative to the largest value of an output: single precision is better, and a layer
that was misread is far worse."""


def from_torch(
    module: torch.nn.Module | str | Path,
    *,
    inputs: Sequence[Signal],
    outputs: Sequence[Signal],
    window: Window,
    name: str = "surrogate",
) -> Surrogate:
    """Return a feed-forward network of torch, or of an ONNX file, as a surrogate.

    The surrogate computes the same as the module in evaluation mode, in single precision.
    ``predict`` evaluates it once for n_out samples; ``predict_newest``, and the FMU that
    ``export_fmu`` writes, once for each sample. It has neither error estimate nor measured error.

    The module takes physical values, in the units of the inputs: scalings must be among its
    layers. Its argument is the input window, float32 or float64. It has the shape (B, n_in,
    n_inputs) if the first layer is a Flatten; otherwise it is flattened row by row, (B, n_in *
    n_inputs): all inputs of the oldest sample first, those of the newest last. The result is
    the output window in physical values, (B, n_out * n_outputs), in the same order. The newest
    output is at the end of the step in which the newest input acts.

    Inputs with a first-order hold are not forecast: an FMU with ``inputs_at_step_end`` = 0 holds
    them over a step (``Surrogate.reaching_inputs_by_step_end``).

    Args:
        module: a ``torch.nn.Sequential``, also nested, or a module whose only child is one. Its
            layers may be Linear, BatchNorm1d, Flatten, Identity, Dropout, ReLU, ELU with alpha =
            1, Tanh, Sigmoid and GELU with approximate = "tanh". Or the path of an ONNX file (extra
            ``onnx``) whose nodes are a chain of such layers.
        inputs: the input signals, in the order of the columns. Values are rounded to single
            precision relative to their ranges, so these should not be wider than needed.
        outputs: the output signals, in the order of the columns.
        window: sample step, n_in and n_out.
        name: C identifier; name of the FMU.

    Returns:
        The surrogate, without error estimator, bound and forecast.

    Raises:
        ValueError: a layer cannot be taken, or sizes do not fit, with one line for each; the
            module computes something else than its layers; or a signal or the file cannot be used.
        TypeError: the module is neither a torch module nor the path of an ONNX file.
        ModuleNotFoundError: the file needs the package onnx, which is not installed.
        OSError: the file cannot be read.
    """
    signals = tuple(inputs), tuple(outputs)
    if not all(signals):
        raise ValueError(
            f"from_torch with {len(signals[0])} inputs and {len(signals[1])} outputs; expected at "
            "least one signal of each"
        )
    scalings = range_scaling(signals[0]), range_scaling(signals[1])
    if not isinstance(module, str | Path):
        from slide_fmu.apps.from_torch import torch_layers

        copied = torch_layers.evaluated(module)
        reads = torch_layers.read_layers(copied)
        network = network_of(reads, window, scalings, torch_layers.TAKEN)
        surrogate = Surrogate(name, window, *signals, *scalings, network)
        trials = _trials(signals[0], window.n_in)
        _require_agreement(surrogate, trials, torch_layers.values_of(copied, trials))
        return surrogate
    network = _onnx_network(Path(module), window, scalings)
    return Surrogate(name, window, *signals, *scalings, network)


def _onnx_network(path: Path, window: Window, scalings: tuple[Affine, Affine]) -> FeedForward:
    if path.suffix != ".onnx":
        raise TypeError(
            f"from_torch of the file {str(path)!r}; expected one that ends in .onnx, or a "
            "torch.nn.Sequential: load a file of torch yourself, and give the module"
        )
    try:
        from slide_fmu.apps.from_torch import onnx_nodes
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"the package {error.name!r} is not installed; expected the extra 'onnx': "
            f"{how_to_install('onnx')}",
            name=error.name,
        ) from error
    reads = onnx_nodes.read_nodes(path, window, len(scalings[0].scale))
    return network_of(reads, window, scalings, onnx_nodes.TAKEN)


def _trials(signals: tuple[Signal, ...], n_in: int) -> FloatArray:
    """Draw windows within the ranges, half of them constant: (TRIALS, n_in, n_inputs)."""
    part = np.random.default_rng(0).uniform(size=(TRIALS, n_in, len(signals)))
    part[: TRIALS // 2] = part[: TRIALS // 2, :1]
    low, high = (np.array([getattr(signal, end) for signal in signals]) for end in ("low", "high"))
    return np.asarray((1 - part) * low + part * high)


def _require_agreement(surrogate: Surrogate, windows: FloatArray, expected: FloatArray) -> None:
    """Refuse a module whose results differ from the layers that were read.

    Args:
        surrogate: the surrogate made of the layers.
        windows: physical inputs, shape (B, n_in, n_inputs).
        expected: results of the module, shape (B, n_out * n_outputs).
    """
    predicted = surrogate.predict_windows(windows).reshape(len(windows), -1)
    error = np.abs(predicted - expected).max(axis=0)
    largest = np.maximum(np.abs(expected).max(axis=0), np.finfo(np.float64).tiny)
    worst = int(np.argmax(error / largest))
    if not error[worst] <= AGREE * largest[worst]:
        name = surrogate.outputs[worst % len(surrogate.outputs)].name
        raise ValueError(
            f"the module does something else than its layers: output {name!r} differs by "
            f"{error[worst]:.3g}, and is {largest[worst]:.3g} at most; expected the same values: "
            "put what its forward or a hook does into layers of a Sequential, or give an ONNX file"
        )
