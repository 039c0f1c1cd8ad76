"""Time of a communication step: native FMU, PythonFMU with numpy, and torch, interleaved.

All three carry the same networks (surrogate and error estimator) and the same window. Usage:

    python tests/benchmarks/do_step.py fmus/duffing/duffing.fmu --json -

Prints medians in microseconds of doStep alone and of set, doStep and get together, and their
ratios to the native FMU. torch runs in process, without FMI: its step is window, networks, result.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from fmpy.fmi2 import FMU2Slave
from pythonfmu import FmuBuilder

from slide_fmu.cosim import unpacked
from slide_fmu.fmu.export import read_fmu
from slide_fmu.network import FeedForward
from slide_fmu.surrogate import Surrogate

SCRIPT = '''
from pathlib import Path
import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from slide_fmu.surrogate import Surrogate


class NumpySurrogate(Fmi2Slave):
    """The networks of a surrogate in plain numpy, window shifted in place."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.surrogate = Surrogate.load(Path({path!r}))
        surrogate = self.surrogate
        self.u = np.zeros(len(surrogate.inputs))
        self.y = np.zeros(len(surrogate.outputs))
        self.e = np.zeros(len(surrogate.outputs))
        self.window = np.zeros((surrogate.window.n_in, len(surrogate.inputs)), np.float32)
        estimator = surrogate.estimator
        positions = 1 if estimator is None else estimator.positions
        self.squares = np.zeros((positions, len(surrogate.outputs)))
        for signals, values, causality in (
            (surrogate.inputs, self.u, Fmi2Causality.input),
            (surrogate.outputs, self.y, Fmi2Causality.output),
        ):
            for i, signal in enumerate(signals):
                self.register_variable(
                    Real(
                        signal.name,
                        causality=causality,
                        getter=lambda values=values, i=i: float(values[i]),
                        setter=lambda v, values=values, i=i: values.__setitem__(i, v),
                    )
                )

    def do_step(self, current_time, step_size):
        surrogate, window = self.surrogate, self.window
        window[:-1] = window[1:]
        window[-1] = surrogate.input_scaling.apply(self.u)
        newest = window[None, -surrogate.network.n_samples :]
        values = surrogate.network.evaluate(newest)[0, -len(self.y) :]
        self.y[:] = surrogate.output_scaling.invert(values)
        estimator = surrogate.estimator
        if estimator is not None:
            values = estimator.network.evaluate(window[None, -estimator.network.n_samples :])
            self.squares[:-1] = self.squares[1:]
            self.squares[-1] = estimator.squares(values, len(self.y))[0]
            self.e[:] = np.sqrt(self.squares.mean(axis=0)) * surrogate.output_scaling.scale
        return True
'''


class TorchStep:
    """The networks of a surrogate in torch, eager, one thread. Final."""

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate
        self.window = torch.zeros(surrogate.window.n_in, len(surrogate.inputs))
        estimator = surrogate.estimator
        self.networks = [self._module(surrogate.network)]
        if estimator is not None:
            self.networks.append(self._module(estimator.network))
            self.log_error = estimator.log_error
        self.squares = torch.zeros(1 if estimator is None else estimator.positions)

    @staticmethod
    def _module(network: Any) -> tuple[int, torch.nn.Module, torch.Tensor | None]:
        assert isinstance(network, FeedForward)
        modules: list[torch.nn.Module] = []
        names = {
            "identity": torch.nn.Identity,
            "relu": torch.nn.ReLU,
            "elu": torch.nn.ELU,
            "tanh": torch.nn.Tanh,
            "gelu": lambda: torch.nn.GELU(approximate="tanh"),
        }
        for layer in network.layers:
            linear = torch.nn.Linear(*layer.weights.shape[::-1])
            linear.weight.data = torch.from_numpy(layer.weights)
            linear.bias.data = torch.from_numpy(layer.bias)
            modules += [linear, names[layer.activation]()]
        skip = None if network.skip is None else torch.from_numpy(network.skip.T.copy())
        return network.n_samples, torch.nn.Sequential(*modules), skip

    def step(self, value: float) -> float:
        """One step with every input at ``value`` (scaled); the first scaled output."""
        self.window = torch.roll(self.window, -1, 0)
        self.window[-1] = value
        results = []
        for n_samples, module, skip in self.networks:
            flat = self.window[-n_samples:].reshape(1, -1)
            results.append(module(flat) if skip is None else module(flat) + flat @ skip)
        if len(results) > 1:
            n_outputs, log_error = len(self.surrogate.outputs), self.log_error
            values = results[1][0]
            spread = 10 ** (2 * (log_error.middle + log_error.half_range * values[-n_outputs:]))
            self.squares = torch.roll(self.squares, -1, 0)
            self.squares[-1] = (values[:-n_outputs] ** 2).sum() + spread.sum()
            self.squares.mean().sqrt()
        return float(results[0][0, -1])


def measure(path: Path, steps: int, rounds: int) -> dict[str, Any]:
    """Medians over interleaved rounds."""
    surrogate, _ = read_fmu(path)
    torch.set_num_threads(1)
    values = np.random.default_rng(0).uniform(-1, 1, steps).tolist()
    times: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder, unpacked(path) as native:
        other = python_fmu(surrogate, Path(folder))
        with unpacked(other) as wrapped:
            for _ in range(rounds):
                for name, fmu in (("fmu", native), ("pythonfmu", wrapped)):
                    whole, alone = fmu_times(fmu, surrogate, values)
                    times.setdefault(f"{name}_set_step_get", []).extend(whole)
                    times.setdefault(f"{name}_step", []).extend(alone)
                times.setdefault("torch", []).extend(torch_times(surrogate, values))
    medians = {name: 1e6 * float(np.median(found)) for name, found in times.items()}
    ratios = {
        "pythonfmu_step_over_fmu_step": medians["pythonfmu_step"] / medians["fmu_step"],
        "torch_over_fmu_step": medians["torch"] / medians["fmu_step"],
        "pythonfmu_over_fmu_set_step_get": medians["pythonfmu_set_step_get"]
        / medians["fmu_set_step_get"],
    }
    return {"fmu": path.name, "median_us": medians, "ratio": ratios}


def python_fmu(surrogate: Surrogate, folder: Path) -> Path:
    """The surrogate as FMU by PythonFMU and numpy."""
    surrogate.save(folder / "surrogate.slide")
    script = folder / "numpysurrogate.py"
    script.write_text(SCRIPT.format(path=str(folder / "surrogate.slide")), encoding="utf-8")
    importlib.invalidate_caches()
    return Path(FmuBuilder.build_FMU(script, dest=folder))


def fmu_times(
    fmu: Any, surrogate: Surrogate, values: list[float]
) -> tuple[list[float], list[float]]:
    """Seconds of every set, doStep and get, and of doStep alone."""
    slave = FMU2Slave(
        guid=fmu.description.guid,
        unzipDirectory=fmu.folder,
        modelIdentifier=fmu.description.coSimulation.modelIdentifier,
        instanceName="benchmark",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    inputs = [fmu.references[signal.name] for signal in surrogate.inputs]
    outputs = [fmu.references[signal.name] for signal in surrogate.outputs]
    whole, alone, step = [], [], surrogate.window.step
    for k, value in enumerate(values):
        row = (surrogate.input_scaling.offset + value * surrogate.input_scaling.scale).tolist()
        begin = time.perf_counter()
        slave.setReal(inputs, row)
        before = time.perf_counter()
        slave.doStep(k * step, step)
        after = time.perf_counter()
        slave.getReal(outputs)
        whole.append(time.perf_counter() - begin)
        alone.append(after - before)
    slave.terminate()
    slave.freeInstance()
    return whole, alone


def torch_times(surrogate: Surrogate, values: list[float]) -> list[float]:
    """Seconds of every step in torch."""
    stepper, times = TorchStep(surrogate), []
    with torch.inference_mode():
        for value in values:
            begin = time.perf_counter()
            stepper.step(value)
            times.append(time.perf_counter() - begin)
    return times


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    text = json.dumps(measure(arguments.fmu, arguments.steps, arguments.rounds), indent=2) + "\n"
    if arguments.json == "-":
        sys.stdout.write(text)
    else:
        Path(arguments.json).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
