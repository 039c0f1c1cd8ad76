"""A network of the package as torch module, and its FMU called by fmpy."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import fmpy
import torch
from fmpy.fmi2 import FMU2Slave
from torch import nn
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.core.signals import Hold
from slide_fmu.fmu.description.variables import BY_KEY
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import Shape, random_surrogate

CLOSE = 1e-5
"""Relative to the outputs' range: torch and the native library round differently."""


class Twin(nn.Module):
    """The network of a random surrogate as torch module."""

    def __init__(self, surrogate: Surrogate) -> None:
        super().__init__()
        layers: list[nn.Module] = [nn.Flatten()]
        for layer in surrogate.network.layers:  # type: ignore[attr-defined]
            linear = nn.Linear(layer.weights.shape[1], layer.weights.shape[0])
            linear.weight.data = torch.from_numpy(layer.weights)
            linear.bias.data = torch.from_numpy(layer.bias)
            layers += [linear] + ([nn.Tanh()] if layer.activation == "tanh" else [])
        self.layers = nn.Sequential(*layers)

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """(B, n_in, n_inputs) to (B, n_out * n_outputs)."""
        values: torch.Tensor = self.layers(window)
        return values


def surrogate_with(hold: Hold) -> Surrogate:
    return random_surrogate(
        Shape(n_inputs=2, n_outputs=2, activation="tanh", hold=hold, name="twin")
    )


def description_of(surrogate: Surrogate) -> str:
    """The file that describes the twin."""
    window = surrogate.window
    lines = [f'name = "{surrogate.name}"', f'hold = "{surrogate.hold}"']
    lines += ["[window]", f"step = {window.step}", f"n_in = {window.n_in}"]
    for kind, signals, scaling in (
        ("inputs", surrogate.inputs, surrogate.input_scaling),
        ("outputs", surrogate.outputs, surrogate.output_scaling),
    ):
        for index, signal in enumerate(signals):
            lines += [f"[[{kind}]]", f'name = "{signal.name}"', f'unit = "{signal.unit}"']
            lines += [f"low = {float(signal.low)}", f"high = {float(signal.high)}"]
            lines += [f"offset = {scaling.offset[index]!s}", f"scale = {scaling.scale[index]!s}"]
            if signal.start is not None:
                lines.append(f"start = {signal.start}")
    return "\n".join(lines)


def saved(surrogate: Surrogate, folder: Path, suffix: str) -> tuple[Path, Path]:
    """Files of the twin and of its description."""
    module, description = folder / f"twin{suffix}", folder / "signals.toml"
    example = torch.zeros(1, surrogate.window.n_in, len(surrogate.inputs))
    if suffix == ".pt2":
        torch.export.save(torch.export.export(Twin(surrogate), (example,)), module)
    else:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            torch.jit.save(torch.jit.trace(Twin(surrogate), example), module)
    description.write_text(description_of(surrogate), encoding="utf-8")
    return module, description


RESULTS = [*(BY_KEY["OUTPUT"].reference(i) for i in range(2)), BY_KEY["WINDOW_FILLED"].reference()]
IN_RANGE = BY_KEY["IN_RANGE"].reference()
PARAMETERS = [
    BY_KEY["PREHISTORY_KNOWN"].reference(),
    *(BY_KEY["INITIAL_INPUT"].reference(i) for i in range(2)),
]
EVERYTHING = [0, 1, *RESULTS, *PARAMETERS]
"""Value references, alike in a native FMU and in one with a torch module."""


def invoke(*arguments: object) -> Result:
    """Call the console script in this process."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def start(path: Path, folder: Path, *parameters: float) -> FMU2Slave:
    """An initialized instance, with values of the parameters."""
    description = fmpy.read_model_description(str(path))
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path), str(folder)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="test",
    )
    slave.instantiate(loggingOn=True)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal(PARAMETERS[: len(parameters)], parameters)
    slave.exitInitializationMode()
    return slave


def script(module: nn.Module, path: Path) -> None:
    """Write a module as TorchScript."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.jit.save(torch.jit.script(module), path)


def save_exported(module: nn.Module, path: Path) -> None:
    """Write a module that takes four samples of one input as ``torch.export`` does."""
    torch.export.save(torch.export.export(module, (torch.zeros(1, 4, 1),)), path)


def small_description(name: str, largest: float, outputs: Sequence[str]) -> str:
    """The file that describes a module of one input, which has a range, and of four samples."""
    signals = [("inputs", "u", "N", largest), *(("outputs", y, "m", 1.0) for y in outputs)]
    lines = [f'name = "{name}"', "[window]", "step = 0.01", "n_in = 4"]
    for kind, signal, unit, high in signals:
        lines += [f"[[{kind}]]", f'name = "{signal}"', f'unit = "{unit}"']
        lines += [f"low = {-high}", f"high = {high}"]
    return "\n".join(lines)
