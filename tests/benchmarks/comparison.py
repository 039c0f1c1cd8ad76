"""An FMU beside the memory's limit and the same network elsewhere: one run, all in turns, medians.

    python tests/benchmarks/comparison.py fmus/robot_6r/robot_6r.fmu --json -
    python tests/benchmarks/comparison.py --synthetic robot --json -

Baselines that are not installed, or do not know such a network, are None, with a remark.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from baselines import BaselineError
from baselines.cells import TorchCells
from baselines.layers import onnx_layers, torch_layers
from baselines.numpy_fmu import write_numpy_fmu
from figures_out import write_figures
from synthetic import synthetic_robot
from timing import Part, TimedSurrogate, part_times, repeats

from slide_fmu.apps.bench.bench import Bench
from slide_fmu.apps.bench.effort import Effort
from slide_fmu.core.figures import plain
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = {"kernel": Part.NETWORK, "read": Part.READ_MEMORY, "runtime_step": Part.STEP}
"""What is timed inside C."""


def compare_fmu(path: Path, effort: Effort) -> dict[str, Any]:
    """Compare an FMU of slide-fmu; see ``compare``."""
    surrogate, _ = read_fmu(path)
    return {"fmu": str(path), **compare(surrogate, path, effort)}


def compare_synthetic(effort: Effort) -> dict[str, Any]:
    """Compare the robot-sized network with random weights; see ``compare``."""
    surrogate = synthetic_robot()
    with TemporaryDirectory() as folder:
        path = export_fmu(surrogate, Path(folder) / "robot.fmu")
        return {"synthetic": "robot", **compare(surrogate, path, effort)}


def compare(surrogate: Surrogate, path: Path, effort: Effort) -> dict[str, Any]:
    """Time a surrogate's FMU and its baselines in turns.

    Returns:
        The figures of ``slide_fmu.apps.bench.bench.Bench``, and in microseconds: ``runtime_step``
        (inside C, without FMI), ``kernel`` (one evaluation of all that layers give, or both cells
        of a ping-pong step), ``memory_bound`` (the bytes of the weights over the bandwidth
        ``read_gb_per_s`` at which the network's memory is read in the same run, wherever it
        lies), ``torch``, ``onnxruntime`` (one evaluation), ``pythonfmu_step``,
        ``pythonfmu_set_step_get`` (with the estimates of an error estimator); in ``batch`` those
        of ``torch`` and ``onnxruntime`` too; ``remarks``, why a baseline is None.
    """
    with TemporaryDirectory() as folder, ExitStack() as unpacking:
        bench = Bench(surrogate, unpacking.enter_context(unpacked(path)), effort)
        remarks = _add_baselines(bench)
        other = unpacking.enter_context(unpacked(write_numpy_fmu(surrogate, Path(folder))))
        timed = TimedSurrogate(surrogate)
        times = {part: repeats(timed, part) for part in PARTS.values()}
        for _ in range(effort.rounds):
            for name, part in PARTS.items():
                loops = -(-effort.steps // times[part])
                bench.add(name, part_times(timed, part, loops, times[part]))
            bench.round()
            names = [signal.name for signal in surrogate.outputs]
            if surrogate.estimator is not None:
                names += [f"{name}_error_estimate" for name in names]
            run = bench.run_fmu(other, names)
            bench.add("pythonfmu_set_step_get", run.seconds)
            bench.add("pythonfmu_step", run.step_seconds)
    return _with_bound({**plain(bench.figures()), "remarks": remarks}, timed.memory)


def _with_bound(figures: dict[str, Any], memory: int) -> dict[str, Any]:
    """The figures with the memory's limit, and None for baselines that are missing."""
    seconds_per_byte = 1e-6 * figures.pop("read") / memory
    size = figures["n_weights"] * np.dtype(np.float32).itemsize
    return {
        "torch": None,
        "onnxruntime": None,
        **figures,
        "memory_bound": 1e6 * size * seconds_per_byte,
        "read_gb_per_s": 1e-9 / seconds_per_byte,
        "batch": {"torch": None, "onnxruntime": None, **figures["batch"]},
    }


def _add_baselines(bench: Bench) -> dict[str, str]:
    """Those in process; what is missing, and why."""
    network = bench.surrogate.network
    if isinstance(network, FeedForward):
        return _add_layers(bench, network)
    assert isinstance(network, StateSpace)
    return _add_cells(bench, network)


def _add_layers(bench: Bench, network: FeedForward) -> dict[str, str]:
    """They evaluate the features of windows, which are laid out for them beforehand."""
    seen, remarks = bench.windows[:, -network.n_samples :], {}
    windows = network.features.along(bench.surrogate.input_scaling.apply(seen))
    ages = network.ages or tuple(range(network.n_samples - 1, -1, -1))
    places = [network.n_samples - 1 - age for age in ages]
    flat = np.ascontiguousarray(windows[:, places].reshape(len(windows), -1))
    bench.singles["numpy"] = lambda: network.evaluate_features(windows[:1])
    bench.batches["numpy"] = lambda: network.evaluate_features(windows)
    for name, make in (("torch", torch_layers), ("onnxruntime", onnx_layers)):
        try:
            evaluate = make(network)
        except (ImportError, BaselineError) as error:
            remarks[name] = str(error)
            continue
        bench.singles[name] = partial(evaluate, flat[:1])
        bench.batches[name] = partial(evaluate, flat)
    return remarks


def _add_cells(bench: Bench, network: StateSpace) -> dict[str, str]:
    """They advance both states of a ping-pong step."""
    remarks = {"onnxruntime": "a state-space network goes from step to step: no such graph"}
    row = bench.surrogate.input_scaling.apply(bench.sequence)[0]
    try:
        bench.singles["torch"] = partial(TorchCells(network).step, row)
    except (ImportError, BaselineError) as error:
        remarks["torch"] = str(error)
    return remarks


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("fmu", type=Path, nargs="?")
    what.add_argument("--synthetic", choices=["robot"])
    parser.add_argument("--rounds", type=int, default=Effort.rounds)
    parser.add_argument("--steps", type=int, default=Effort.steps)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    effort = Effort(arguments.rounds, arguments.steps)
    if arguments.fmu is None:
        figures = compare_synthetic(effort)
    else:
        figures = compare_fmu(arguments.fmu, effort)
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
