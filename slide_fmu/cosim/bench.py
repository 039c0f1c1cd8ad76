"""How fast an FMU is, beside the same networks elsewhere: one run, all in turns, medians.

Rivals carry the surrogate's network (``torch``, ``onnxruntime`` and ``numpy`` in process, on one
thread; ``pythonfmu`` as an FMU with numpy, error estimates included). Those that are not
installed, or do not know such a network, are None, with a remark.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.rivals import RivalError, TorchCells, onnx_layers, python_fmu, torch_layers
from slide_fmu.cosim.run import UnpackedFmu, instantiated, unpacked
from slide_fmu.cosim.synthetic import Effort, synthetic_surrogate
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.fmu.native import NativeSurrogate, kernels
from slide_fmu.network.feed_forward import FeedForward
from slide_fmu.network.state_space import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate


def bench_fmu(path: Path, effort: Effort) -> dict[str, Any]:
    """Time an FMU; see ``bench_surrogates``.

    Raises:
        CoSimulationError: the FMU reports an error.
        FmuError: the file is no FMU of slide-fmu.
        NativeError: there is no compiled runtime for this platform.
    """
    surrogate, _ = read_fmu(path)
    return {"fmu": str(path), **bench_surrogates({"": (surrogate, path)}, effort)[""]}


def bench_synthetic(name: str, effort: Effort) -> dict[str, Any]:
    """Time a synthetic network; see ``bench_surrogates``.

    Raises:
        ValueError: there is no synthetic network of this name.
        NativeError: there is no compiled runtime for this platform.
    """
    surrogate = synthetic_surrogate(name)
    with tempfile.TemporaryDirectory() as folder:
        path = export_fmu(surrogate, Path(folder) / f"{name}.fmu")
        figures = bench_surrogates({name: (surrogate, path)}, effort)
    return {"synthetic": name, **figures[name]}


def bench_surrogates(
    subjects: dict[str, tuple[Surrogate, Path]], effort: Effort
) -> dict[str, dict[str, Any]]:
    """Time surrogates and their FMUs in turns.

    Args:
        subjects: surrogate and FMU by name.

    Returns:
        For each: ``kernel_name``; ``n_weights``, their number; medians in microseconds:
        ``fmu_step`` (doStep through fmpy), ``fmu_set_step_get``, ``torch``,
        ``onnxruntime``, ``numpy`` (one evaluation), ``pythonfmu_set_step_get``; ``batch``,
        windows per second of processor time, of ``native``, ``torch``, ``onnxruntime`` and
        ``numpy``; ``spread``, the 10th and 90th percentile of the times in microseconds;
        ``remarks``. Set, doStep and get are with error estimates, if there are any:
        PythonFMU always computes them; ``fmu_set_step_get_without_estimates`` is without.
    """
    with tempfile.TemporaryDirectory() as folder, ExitStack() as unpacking:
        runs = {}
        for index, (name, (surrogate, path)) in enumerate(subjects.items()):
            place = Path(folder) / str(index)
            place.mkdir()
            runs[name] = _Run(surrogate, effort)
            runs[name].add_fmus(path, place, unpacking)
        for _ in range(effort.rounds):
            for run in runs.values():
                run.round()
    return {name: run.figures() for name, run in runs.items()}


def fmu_times(
    fmu: UnpackedFmu, surrogate: Surrogate, rows: FloatArray, estimates: bool = False
) -> tuple[list[float], list[float]]:
    """Time a fresh instance of an FMU, called through fmpy.

    Args:
        rows: inputs of every step, shape (N, n_inputs), in the inputs' units.
        estimates: get the error estimates too, if there are any.

    Returns:
        Seconds of every set, doStep and get together, and of doStep alone.

    Raises:
        CoSimulationError: a variable is not there, or the FMU reports an error.
    """
    names = [signal.name for signal in surrogate.outputs]
    if estimates and surrogate.estimator is not None:
        names += [f"{name}_error_estimate" for name in names]
    fmu.require(*names, *(signal.name for signal in surrogate.inputs))
    inputs = [fmu.references[signal.name] for signal in surrogate.inputs]
    outputs = [fmu.references[name] for name in names]
    whole, alone, step = [], [], surrogate.window.step
    with instantiated(fmu) as slave:
        slave.enter_initialization(0.0)
        slave.exit_initialization()
        for k, row in enumerate(rows.tolist()):
            begin = time.perf_counter()
            slave.set_real(inputs, row)
            before = time.perf_counter()
            slave.do_step(k * step, step)
            after = time.perf_counter()
            slave.get_real(outputs)
            whole.append(time.perf_counter() - begin)
            alone.append(after - before)
        slave.terminate()
    return whole, alone


def _call_times(function: Callable[[], object], calls: int) -> list[float]:
    found = []
    for _ in range(calls):
        begin = time.perf_counter()
        function()
        found.append(time.perf_counter() - begin)
    return found


class _Run:
    """One surrogate with its rivals, and the times measured so far. Final."""

    def __init__(self, surrogate: Surrogate, effort: Effort) -> None:
        self.surrogate, self.effort = surrogate, effort
        self.native = NativeSurrogate(surrogate)
        self.fmus: dict[str, UnpackedFmu] = {}
        self.times: dict[str, list[float]] = {}
        self.remarks: dict[str, str] = {}
        self.record = _random_record(surrogate, effort.windows)
        views = np.lib.stride_tricks.sliding_window_view(self.record, surrogate.window.n_in, 0)
        self.windows = np.moveaxis(views, -1, 1)
        self.singles: dict[str, Callable[[], object]] = {}
        self.batches: dict[str, Callable[[], object]] = {
            "native": lambda: self.native.predict_windows(self.windows, threads=1)
        }
        if isinstance(surrogate.network, FeedForward):
            self._add_layers(surrogate.network)
        else:
            self._add_cells()

    def add_fmus(self, path: Path, folder: Path, unpacking: ExitStack) -> None:
        """Unpack the FMU and that of PythonFMU, until the stack is closed."""
        self.fmus["fmu"] = unpacking.enter_context(unpacked(path))
        other = python_fmu(self.surrogate, folder)
        self.fmus["pythonfmu"] = unpacking.enter_context(unpacked(other))

    def _add_layers(self, network: FeedForward) -> None:
        """Rivals evaluate the features of windows, which are laid out for them beforehand."""
        seen = self.windows[:, -network.n_samples :]
        features = network.features.along(self.surrogate.input_scaling.apply(seen))
        windows = features.astype(np.float32)
        ages = network.ages or tuple(range(network.n_samples - 1, -1, -1))
        places = [network.n_samples - 1 - age for age in ages]
        flat = np.ascontiguousarray(windows[:, places].reshape(len(windows), -1))
        self.singles["numpy"] = lambda: network.evaluate_features(windows[:1])
        self.batches["numpy"] = lambda: network.evaluate_features(windows)
        for name, make in (("torch", torch_layers), ("onnxruntime", onnx_layers)):
            try:
                evaluate = make(network)
            except (ImportError, RivalError) as error:
                self.remarks[name] = str(error)
                continue
            self.singles[name] = partial(evaluate, flat[:1])
            self.batches[name] = partial(evaluate, flat)

    def _add_cells(self) -> None:
        """Rivals advance both states of a ping-pong step."""
        network = self.surrogate.network
        assert isinstance(network, StateSpace)
        scaled = self.surrogate.input_scaling.apply(self.record)
        stepper, row = network.stepper(), scaled[0]
        self.singles["numpy"] = lambda: stepper.step(row)
        self.remarks["onnxruntime"] = "a state-space network goes from step to step: no such graph"
        try:
            self.singles["torch"] = partial(TorchCells(network).step, row)
        except (ImportError, RivalError) as error:
            self.remarks["torch"] = str(error)

    def round(self) -> None:
        """Time everything once more."""
        steps = self.effort.steps
        for name, single in self.singles.items():
            self._add(name, _call_times(single, steps))
        rows = self.record[:steps]
        for name, fmu in self.fmus.items():
            whole, alone = fmu_times(fmu, self.surrogate, rows, estimates=True)
            self._add(f"{name}_set_step_get", whole)
            self._add(f"{name}_step", alone)
        whole, _ = fmu_times(self.fmus["fmu"], self.surrogate, rows)
        self._add("fmu_set_step_get_without_estimates", whole)
        for name, batch in self.batches.items():
            begin = time.process_time()
            batch()
            self._add(f"batch_{name}", [time.process_time() - begin])

    def _add(self, name: str, seconds: list[float]) -> None:
        self.times.setdefault(name, []).extend(seconds)

    def figures(self) -> dict[str, Any]:
        medians = {name: float(np.median(found)) for name, found in self.times.items()}
        network = self.surrogate.network
        batch = {name: self.effort.windows / medians.pop(f"batch_{name}") for name in self.batches}
        return {
            "kernel_name": kernels()[0],
            "n_weights": network.count_parameters(),
            "torch": None,
            "onnxruntime": None,
            **{name: 1e6 * median for name, median in medians.items()},
            "batch": {"torch": None, "onnxruntime": None, **batch},
            "spread": {
                name: [1e6 * float(value) for value in np.percentile(times, [10, 90])]
                for name, times in self.times.items()
            },
            "remarks": self.remarks,
        }


def _random_record(surrogate: Surrogate, windows: int) -> FloatArray:
    """Inputs within their ranges, as many samples as so many overlapping windows have."""
    low = np.array([signal.low for signal in surrogate.inputs])
    high = np.array([signal.high for signal in surrogate.inputs])
    samples = windows + surrogate.window.n_in - 1
    return np.random.default_rng(0).uniform(low, high, (samples, len(low)))
