"""Whole records by the C runtime, many at once, beside numpy, torch and onnxruntime in one run.

    python tests/benchmarks/whole_records.py fmus/*/*.fmu --json -

Inputs are drawn by the excitation of the recipe that an FMU names, with a seed that no training
saw; records are cut out of one long drawn record, so that each begins elsewhere. Times are those
of the processor, medians over the rounds, but for the candidates, which several threads share:
there it is also the time that passes. torch and onnxruntime have one thread and run the cells
alone: the features are given to them. The graph of onnxruntime is what torch exports, one step
after the other. numpy does all, by ``Surrogate.predict_newest_batch``.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from compare_fmus import unseen_inputs
from figures_out import write_figures
from seeds import WHOLE_RECORDS

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.native import NativeSurrogate, kernels
from slide_fmu.network.state_space.cell import Cell
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

RECORDS, LENGTH = 256, 600
"""Records whose time is measured, and samples of each."""
LONG_RECORDS, LONG = 64, 6000
"""The same of long records, in which the n_in samples count less that the first input is held for
before each."""
SLOPES, IN_A_ROW = 160, 20
"""Samples of the record whose gradient is timed, and gradients in a row, as an optimiser asks for
them: the first of them finds nothing in the cache."""
CANDIDATES, SHORT = 10_000, 120
"""Records of so many samples that are predicted at once by all threads."""
FEW = 64
"""Records that numpy is given, and whose gradients are timed."""
MANY = 2048
"""Records, as short as candidates, that torch and onnxruntime are given: they are the faster the
more there are."""


def cut(record: FloatArray, count: int, length: int) -> FloatArray:
    """Cut records (count, length, n_inputs) out of a long one, at places all over it."""
    firsts = np.linspace(0, len(record) - length, count).astype(int)
    return np.stack([record[first : first + length] for first in firsts])


def other_cells(surrogate: Surrogate, records: FloatArray) -> dict[str, Callable[[], object]]:
    """The cell equation in torch and in onnxruntime, along features that are there already.

    A cell without units has torch alone.
    """
    import onnxruntime
    import torch

    torch.set_num_threads(1)
    network = surrogate.network
    assert isinstance(network, StateSpace)
    features = network.features.along(surrogate.input_scaling.apply(records))
    steps = torch.from_numpy(np.moveaxis(features, 1, 0).astype(np.float32))
    arrays = {name: torch.from_numpy(part) for name, part in network.cell.arrays().items()}
    cell = Cell(**arrays, activation=network.cell.activation, substeps=network.cell.substeps)
    first = torch.zeros(len(records), len(cell.a))

    class Cells(torch.nn.Module):
        def forward(self, steps: torch.Tensor) -> torch.Tensor:
            inputs = ByRole.of(network.roles, steps)
            states = Equations(cell, inputs, network.turned, torch).run(first)
            values: torch.Tensor = outputs(cell, states, inputs)
            return values

    def by_torch() -> object:
        with torch.no_grad():
            return cells(steps)

    cells = Cells()
    if not cell.e.shape[1]:  # onnxruntime takes no matrix without columns
        return {"torch": by_torch}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the shapes are fixed, as torch says
        graph = Path(folder, "cells.onnx")
        torch.onnx.export(cells, (steps,), graph, dynamo=False, input_names=["steps"])
        content = graph.read_bytes()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    given = {"steps": steps.numpy()}
    with torch.no_grad():
        expected = cells(steps).numpy()
    np.testing.assert_allclose(session.run(None, given)[0], expected, atol=1e-4)
    return {"torch": by_torch, "onnxruntime": lambda: session.run(None, given)}


def times(tasks: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Median seconds of the processor for tasks that take turns."""
    found: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            begin = time.process_time()
            task()
            found[name].append(time.process_time() - begin)
    return {name: float(np.median(seconds)) for name, seconds in found.items()}


def in_a_row(task: Callable[[], object]) -> Callable[[], None]:
    """Make one task of a task that is done several times."""

    def repeated() -> None:
        for _ in range(IN_A_ROW):
            task()

    return repeated


def passed(task: Callable[[], object], rounds: int) -> dict[str, float]:
    """Median time that passes in s, and that of all threads' processors."""
    found = []
    for _ in range(rounds):
        begin = time.perf_counter(), time.process_time()
        task()
        found.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
    seconds = np.median(found, axis=0)
    return {"passed": float(seconds[0]), "processors": float(seconds[1])}


def measure(path: Path, rounds: int, threads: int) -> dict[str, Any]:
    """Measure one FMU.

    Returns:
        ``simulated_seconds_per_second`` on one core, of every kernel of this processor, of the
        best of them with long records, of numpy, torch and onnxruntime; ``gradient_ms``, of a
        record of 160 samples in a row of 20, and of each of 64 at once; ``candidates_s``, of
        10 000 records of 120 samples; ``difference``, the largest one from ``predict_newest`` over
        the scale of its output, in the first n_in - n_out samples of a record and in all.
    """
    surrogate, _ = read_fmu(path)
    step, n_outputs = surrogate.window.step, len(surrogate.outputs)
    record = unseen_inputs(path, 2 * LONG, WHOLE_RECORDS)
    records, few = cut(record, RECORDS, LENGTH), cut(record, FEW, LENGTH)
    long = cut(record, LONG_RECORDS, LONG)
    natives = [NativeSurrogate(surrogate, kernel) for kernel in range(len(kernels()))]
    native, one = natives[0], record[None, :SLOPES]
    weights = np.random.default_rng(0).normal(size=(FEW, SLOPES, n_outputs))
    several = cut(record, FEW, SLOPES)
    seconds = times(
        {
            **{
                name: partial(it.predict, records, threads=1)
                for name, it in zip(kernels(), natives, strict=True)
            },
            "numpy": lambda: surrogate.predict_newest_batch(few),
            **other_cells(surrogate, cut(record, MANY, SHORT)),
            "long": lambda: native.predict(long, threads=1),
            "one": in_a_row(lambda: native.vjp(one, weights[:1], threads=1)),
            "several": lambda: native.vjp(several, weights, threads=1),
        },
        rounds,
    )
    samples = {
        **dict.fromkeys(kernels(), RECORDS * LENGTH),
        "long": LONG_RECORDS * LONG,
        "numpy": FEW * LENGTH,
        **dict.fromkeys(("torch", "onnxruntime"), MANY * SHORT),
    }
    candidates = cut(record, CANDIDATES, SHORT)
    newest = surrogate.predict_newest(record[:LONG])
    error = np.abs(native.predict(record[:LONG]) - newest) / surrogate.output_scaling.scale
    exact = surrogate.window.n_in - surrogate.window.n_out
    return {
        "simulated_seconds_per_second": {
            name: count * step / seconds[name]
            for name, count in samples.items()
            if name in seconds
        },
        "gradient_ms": {
            "one": 1e3 * seconds["one"] / IN_A_ROW,
            "each_of_64": 1e3 * seconds["several"] / FEW,
        },
        "candidates_s": passed(lambda: native.predict(candidates, threads), rounds),
        "difference": {"first_samples": error[: exact + 1].max(), "all": error.max()},
    }


def main() -> None:
    """Measure FMUs of cells, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fmus", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2, help="that share the candidates")
    parser.add_argument("--json", default="-", help="where the figures go; - is stdout")
    given = parser.parse_args()
    found = {path.stem: measure(path, given.rounds, given.threads) for path in given.fmus}
    write_figures({"threads": given.threads, "fmus": found}, given.json)


if __name__ == "__main__":
    main()
