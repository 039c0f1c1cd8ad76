"""Time of a communication step: native FMU, PythonFMU with numpy, and torch, interleaved.

All three carry the same networks (surrogate and error estimator) and the same window or states.
Usage:

    python tests/benchmarks/do_step.py fmus/duffing/duffing.fmu --json -

Prints medians in microseconds of set, doStep and get together, with error estimates and, for the
native FMU, also without: it estimates when it is asked to. Ratios are of all with the estimates.
Beside them doStep alone, the same step inside C without FMI (``runtime_step``), and the
surrogate's network alone (``kernel_us``: one evaluation of layers, or both cells of a ping-pong
step). torch runs in process, without FMI: its step is window or states, networks, result; null
where it does not know such a network.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import write_figures
from fmpy.fmi2 import FMU2Slave
from kernel_time import KernelTime
from rivals import TorchStep, python_fmu

from slide_fmu.cosim import unpacked
from slide_fmu.fmu.export import SURROGATE, read_fmu
from slide_fmu.surrogate import Surrogate

LOOP, LOOPS = 200, 20
"""Steps in one loop inside C, short enough to run undisturbed; loops in each round."""


def measure(path: Path, steps: int, rounds: int) -> dict[str, Any]:
    """Medians over interleaved rounds; None for a rival that there is not."""
    surrogate, _ = read_fmu(path)
    torch.set_num_threads(1)
    values = np.random.default_rng(0).uniform(-1, 1, steps).tolist()
    times: dict[str, list[float]] = {}
    torch_knows = knows(surrogate)
    with tempfile.TemporaryDirectory() as folder, unpacked(path) as native:
        other = python_fmu(surrogate, Path(folder))
        inside = KernelTime(Path(native.folder) / SURROGATE, Path(folder))
        with unpacked(other) as wrapped:
            for _ in range(rounds):
                for name, fmu in (("fmu", native), ("pythonfmu", wrapped)):
                    whole, alone = fmu_times(fmu, surrogate, values, estimates=True)
                    times.setdefault(f"{name}_set_step_get", []).extend(whole)
                    times.setdefault(f"{name}_step", []).extend(alone)
                whole, _ = fmu_times(native, surrogate, values)
                times.setdefault("fmu_set_step_get_without_estimates", []).extend(whole)
                if torch_knows:
                    times.setdefault("torch", []).extend(torch_times(surrogate, values))
                for _ in range(LOOPS):
                    times.setdefault("runtime_step", []).append(inside.step(LOOP))
                    times.setdefault("kernel", []).append(inside.kernel(LOOP))
    medians = {name: 1e6 * float(np.median(found)) for name, found in times.items()}
    whole = medians["fmu_set_step_get"]
    ratios = {
        "torch_over_fmu_set_step_get": medians["torch"] / whole if torch_knows else None,
        "pythonfmu_over_fmu_set_step_get": medians["pythonfmu_set_step_get"] / whole,
    }
    kernel = medians.pop("kernel")
    found = {"torch": None, **medians}
    return {"fmu": path.name, "kernel_us": kernel, "median_us": found, "ratio": ratios}


def fmu_times(
    fmu: Any, surrogate: Surrogate, values: list[float], estimates: bool = False
) -> tuple[list[float], list[float]]:
    """Seconds of every set, doStep and get, and of doStep alone.

    Args:
        estimates: get the error estimates too, if there are any.
    """
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
    names = [signal.name for signal in surrogate.outputs]
    if estimates and surrogate.estimator is not None:
        names += [f"{name}_error_estimate" for name in names]
    outputs = [fmu.references[name] for name in names]
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


def knows(surrogate: Surrogate) -> bool:
    """Whether there is a rival in torch."""
    try:
        TorchStep(surrogate)
    except NotImplementedError:
        return False
    return True


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
    figures = measure(arguments.fmu, arguments.steps, arguments.rounds)
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
