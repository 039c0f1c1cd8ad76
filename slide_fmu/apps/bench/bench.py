"""The speed of an FMU is measured in one run with alternating turns; the results are medians.

Other ways to run the same network are compared in ``tests/benchmarks/comparison.py``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from slide_fmu.apps.bench.effort import Effort
from slide_fmu.core.figures import spread
from slide_fmu.cosim.check import random_inputs
from slide_fmu.cosim.whole_run import Run, run_fmu
from slide_fmu.fmu.description.variables import ERROR_BOUND, ERROR_ESTIMATE, NOVELTY
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.native import NativeSurrogate, kernels
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True, kw_only=True)
class BenchFigures:
    """BenchFigures are the medians of the measurements.

    Attributes:
        kernel_name: name of the kernel in the compiled runtime.
        n_weights: number of the network's weights.
        medians: times in microseconds: ``fmu_step`` (doStep through fmpy), ``fmu_set_step_get``
            (set, doStep and get, with error estimates if there are any),
            ``fmu_set_step_get_without_estimates``, with an error bound
            ``fmu_set_step_get_with_bounds`` (with bounds and novelty too), and times that were
            added.
        batch: windows per second of processor time, of ``native`` and ``numpy``.
        spread: the 10th and 90th percentile of the times in microseconds.
    """

    kernel_name: str
    n_weights: int
    medians: Mapping[str, float] = spread()
    batch: Mapping[str, float]
    spread: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class FmuTimes:
    """FmuTimes are the figures of an FMU, with its path.

    Attributes:
        step_s: its step in s.
        estimates_errors: whether it has outputs for its error.
    """

    fmu: str
    step_s: float
    estimates_errors: bool
    figures: BenchFigures = spread()


def bench_fmu(path: Path, effort: Effort) -> FmuTimes:
    """Time an FMU.

    Raises:
        CoSimulationError: the FMU reports an error.
        FmuError: the file is not an FMU of slide-fmu.
        NativeError: there is no compiled runtime for this platform.
    """
    surrogate, _ = read_fmu(path)
    with unpacked(path) as fmu:
        bench = Bench(surrogate, fmu, effort)
        for _ in range(effort.rounds):
            bench.round()
    step, estimates = surrogate.window.step, surrogate.estimates_errors
    return FmuTimes(str(path), step, estimates, bench.figures())


def _call_times(function: Callable[[], object], calls: int) -> list[float]:
    times = []
    for _ in range(calls):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return times


@final
class Bench:
    """A Bench has one surrogate, its FMU, and the times measured so far.

    Args:
        surrogate: the surrogate in the FMU.
        fmu: the unpacked FMU.
        effort: number of measurements.

    Attributes:
        native: the surrogate in the C runtime.
        sequence: random inputs within their ranges, shape (N, n_inputs).
        windows: all windows of the sequence, shape (effort.windows, n_in, n_inputs).
        singles: single evaluations by name, timed one by one; only those that are added.
        batches: evaluations of all windows by name; more may be added.
    """

    def __init__(self, surrogate: Surrogate, fmu: UnpackedFmu, effort: Effort) -> None:
        self.surrogate, self.effort = surrogate, effort
        self.native, self._fmu = NativeSurrogate(surrogate), fmu
        self.sequence = random_inputs(surrogate, effort.windows + surrogate.window.n_in - 1)
        views = np.lib.stride_tricks.sliding_window_view(self.sequence, surrogate.window.n_in, 0)
        self.windows = np.moveaxis(views, -1, 1)
        self.singles: dict[str, Callable[[], object]] = {}
        self.batches: dict[str, Callable[[], object]] = {
            "native": lambda: self.native.predict_windows(self.windows, threads=1),
            "numpy": lambda: surrogate.predict_windows(self.windows),
        }
        self._times: dict[str, list[float]] = {}

    def add(self, name: str, seconds: Iterable[float]) -> None:
        """Add times in s that were measured elsewhere."""
        self._times.setdefault(name, []).extend(seconds)

    def run_fmu(self, fmu: UnpackedFmu, outputs: Sequence[str]) -> Run:
        """Run an FMU with the surrogate's inputs on the first samples of the sequence."""
        columns = self.sequence[: self.effort.steps].T
        inputs = {s.name: column for s, column in zip(self.surrogate.inputs, columns, strict=True)}
        return run_fmu(fmu, inputs, outputs, step=self.surrogate.window.step, timed=True)

    def round(self) -> None:
        """Time everything once more."""
        steps = self.effort.steps
        for name, single in self.singles.items():
            self.add(name, _call_times(single, steps))
        surrogate = self.surrogate
        names = [signal.name for signal in surrogate.outputs]
        estimates = [ERROR_ESTIMATE.format(signal=name) for name in names]
        bounds = [*(ERROR_BOUND.format(signal=name) for name in names), NOVELTY]
        wanted = [*names, *estimates] if surrogate.estimates_errors else names
        run = self.run_fmu(self._fmu, wanted)
        self.add("fmu_set_step_get", run.seconds)
        self.add("fmu_step", run.step_seconds)
        without = self.run_fmu(self._fmu, names).seconds
        self.add("fmu_set_step_get_without_estimates", without)
        if surrogate.bound is not None:
            with_bounds = self.run_fmu(self._fmu, [*wanted, *bounds]).seconds
            self.add("fmu_set_step_get_with_bounds", with_bounds)
        for name, batch in self.batches.items():
            begin = time.process_time()
            batch()
            self.add(f"batch_{name}", [time.process_time() - begin])

    def figures(self) -> BenchFigures:
        """Return the results; at least one round must have been done."""
        medians = {name: float(np.median(found)) for name, found in self._times.items()}
        batch = {name: self.effort.windows / medians.pop(f"batch_{name}") for name in self.batches}
        return BenchFigures(
            kernel_name=kernels()[0],
            n_weights=self.surrogate.network.count_parameters(),
            medians={name: 1e6 * median for name, median in medians.items()},
            batch=batch,
            spread={name: _spread(times) for name, times in self._times.items()},
        )


def _spread(times: Sequence[float]) -> tuple[float, float]:
    """Return the 10th and the 90th percentile of times in s, in microseconds."""
    low, high = np.percentile(times, [10, 90])
    return 1e6 * float(low), 1e6 * float(high)
