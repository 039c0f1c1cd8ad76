"""Run a surrogate FMU beside its reference FMU on unseen inputs and measure the error."""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.cosim import UnpackedFmu, run_fmu, unpacked
from slide_fmu.data.pool import process_pool
from slide_fmu.data.sampling import (
    TEST,
    Draw,
    Stream,
    draw,
    recipe_system,
    reference_parameters,
    reference_system,
)
from slide_fmu.errors import moving_rms, relative_deviation, rms
from slide_fmu.excitation.mix import names_of
from slide_fmu.recipe import Recipe
from slide_fmu.signals import FloatArray
from slide_fmu.surrogate import Surrogate
from slide_fmu.systems.base import System, simulate
from slide_fmu.systems.reference_fmu import write_reference_fmu
from slide_fmu.systems.reference_slave import FROM_STATE

Progress = Callable[[int, int], None]
"""Called with the number of trajectories done and to do."""
WORTH_PROCESSES = 20.0
"""Work in s from which on worker processes, which take seconds to start, do the rest."""


@dataclass(frozen=True)
class Task:
    """What is to be validated.

    Attributes:
        seed: entropy of the trajectories; no training, tuning or selection uses their stream.
        trajectories: number of unseen trajectories; the recipe's if None.
        amplitude: range of the factor on the excitation's amplitude; (1, 1) is in range.
        duration: length of a trajectory in s; the recipe's if None.
    """

    seed: int
    trajectories: int | None = None
    amplitude: tuple[float, float] = (1.0, 1.0)
    duration: float | None = None

    def __post_init__(self) -> None:
        if self.trajectories is not None and self.trajectories < 1:
            raise ValueError(f"trajectories = {self.trajectories}; expected at least 1")
        if self.duration is not None and not 0 < self.duration < math.inf:
            raise ValueError(f"duration = {self.duration} s; expected a positive, finite time")
        if not 0 < self.amplitude[0] <= self.amplitude[1] < math.inf:
            raise ValueError(
                f"amplitude = {self.amplitude}; expected two positive factors, smaller one first"
            )


@dataclass(frozen=True, eq=False)
class Comparison:
    """One trajectory, both FMUs.

    Attributes:
        kind: index of the excitation in the recipe.
        time: of the samples that are scored, in s, shape (N,).
        inputs: that led to them, shape (N, n_inputs).
        reference: outputs of the reference FMU, shape (N, n_outputs).
        surrogate: outputs of the surrogate FMU, same shape.
        estimate: its error estimates, same shape, or None.
        true_error: RMSE over the samples up to each one that the estimate is about, same shape;
            NaN where they reach before the first scored sample.
        step_seconds: wall time per step of surrogate and reference, shapes (steps,).
        model: outputs of the model that made the data, shape (N, n_outputs), or None where the
            reference is the same model.
    """

    kind: int
    time: FloatArray
    inputs: FloatArray
    reference: FloatArray
    surrogate: FloatArray
    estimate: FloatArray | None
    true_error: FloatArray
    step_seconds: tuple[FloatArray, FloatArray]
    model: FloatArray | None

    @property
    def error(self) -> FloatArray:
        """Surrogate minus reference, shape (N, n_outputs)."""
        return self.surrogate - self.reference


@dataclass(frozen=True, eq=False)
class Validation:
    """All compared trajectories of one task."""

    task: Task
    surrogate: Surrogate
    recipe: Recipe
    comparisons: tuple[Comparison, ...]

    def figures(self) -> dict[str, Any]:
        """The figures as plain values, as written to JSON."""
        return {
            "fmu": self.surrogate.name,
            "trajectories": len(self.comparisons),
            "seed": self.task.seed,
            "amplitude": list(self.task.amplitude),
            "outputs": [self._output(index) for index in range(len(self.surrogate.outputs))],
            "excitations": self._excitations(),
            "error_estimate": self._estimate(),
            "timing": self._timing(),
        }

    def relative_deviations(self, euclidean: bool = False) -> FloatArray:
        """Relative deviations of the error estimates, all samples and outputs in one vector.

        Args:
            euclidean: of the norm of the errors of all outputs, in their common unit.
        """
        assert self.recipe.estimator is not None
        resolution = self.recipe.estimator.resolution * self.surrogate.output_scaling.scale
        parts = []
        for c in self.comparisons:
            if c.estimate is not None:
                scored = ~np.isnan(c.true_error).any(axis=1)
                values = [c.estimate[scored], c.true_error[scored], resolution[None]]
                if euclidean:
                    values = [np.linalg.norm(value, axis=1) for value in values]
                parts.append(relative_deviation(*values).ravel())
        return np.concatenate(parts)

    def _output(self, index: int) -> dict[str, Any]:
        signal = self.surrogate.outputs[index]
        reference = np.concatenate([c.reference for c in self.comparisons])
        error = np.concatenate([c.error for c in self.comparisons])
        single = [float(rms(c.error)[index] / _rms(c.reference, index)) for c in self.comparisons]
        figures = {
            "name": signal.name,
            "unit": signal.unit,
            "rms_reference": float(rms(reference)[index]),
            "rmse": float(rms(error)[index]),
            "relative_rmse": float(rms(error)[index] / _rms(reference, index)),
            "max_error": float(np.max(np.abs(error[:, index]))),
            "relative_rmse_of_trajectories": _quantiles(single),
        }
        differences = [c.model - c.reference for c in self.comparisons if c.model is not None]
        if differences:
            model_error = rms(np.concatenate(differences))[index]
            figures["model_relative_rmse"] = float(model_error / _rms(reference, index))
        return figures

    def _excitations(self) -> list[dict[str, Any]]:
        rows = []
        for index, name in enumerate(names_of(self.recipe.data.excitation)):
            chosen = [c for c in self.comparisons if c.kind == index]
            if chosen:
                reference = np.concatenate([c.reference for c in chosen])
                error = np.concatenate([c.error for c in chosen])
                relative = [
                    float(rms(error)[i] / _rms(reference, i)) for i in range(error.shape[1])
                ]
                rows.append(
                    {
                        "name": name,
                        "kind": self.recipe.data.excitation[index].kind,
                        "trajectories": len(chosen),
                        "relative_rmse": relative,
                    }
                )
        return rows

    def _estimate(self) -> dict[str, Any] | None:
        if self.surrogate.estimator is None:
            return None
        units = {signal.unit for signal in self.surrogate.outputs}
        several = len(self.surrogate.outputs) > 1 and len(units) == 1
        found: dict[str, Any] = {
            **_deviation(self.relative_deviations()),
            "span_samples": self.surrogate.estimated_samples,
        }
        if several:
            found["euclidean"] = _deviation(self.relative_deviations(euclidean=True))
        return found

    def _timing(self) -> dict[str, float]:
        fmu, reference = (
            float(np.median(np.concatenate([c.step_seconds[i] for c in self.comparisons])))
            for i in (0, 1)
        )
        return {
            "fmu_step_us": 1e6 * fmu,
            "reference_step_us": 1e6 * reference,
            "speedup": reference / fmu,
        }


@dataclass(frozen=True, eq=False)
class _Bench:
    """What every trajectory is measured with; it goes to worker processes."""

    fmu: UnpackedFmu
    reference: UnpackedFmu
    surrogate: Surrogate
    recipe: Recipe
    stream: Stream


class _Models:
    """The models of a recipe, made anew in every process: the reference, and the data's."""

    def __init__(self, recipe: Recipe) -> None:
        self.reference = reference_system(recipe)
        self.data = recipe_system(recipe) if recipe.system.reference else None


def validate(
    fmu: Path,
    surrogate: Surrogate,
    recipe: Recipe,
    task: Task,
    progress: Progress,
    workers: int | None = 1,
) -> Validation:
    """Run an FMU and the reference FMU of its recipe side by side on unseen trajectories.

    Samples are scored from the end of the burn-in on, and not before the input window is filled
    with inputs of the trajectory. Where the estimate is scored, its span is filled too.
    Where the recipe has a reference of its own, the model that made the data is simulated on the
    same inputs, to tell its error from that of the surrogate.

    Args:
        fmu: the surrogate FMU.
        surrogate: what is in it.
        recipe: what it was made from.
        workers: processes that measure when there is much to do, one per core if None. Both FMUs
            of a trajectory run in one process, one after the other.

    Raises:
        CoSimulationError: an FMU reports an error.
        LoadError: the reference system is not installed here.
        SimulationError: the model that made the data could not be simulated.
        ValueError: the trajectories are too short to score anything.
    """
    models = _Models(recipe)
    count = task.trajectories or recipe.validation.trajectories
    duration = task.duration or recipe.validation.duration or recipe.data.duration
    stream = Stream(TEST, task.seed, task.amplitude, duration)
    needed = recipe.shortest_validation()
    if duration < needed - 0.5 * recipe.window.step:
        raise ValueError(
            f"duration = {duration} s; expected at least {needed:g} s, so that the FMU's windows "
            "are filled and outputs are left to score"
        )
    progress(0, count)
    with tempfile.TemporaryDirectory() as folder:
        reference_path = Path(folder) / "reference.fmu"
        write_reference_fmu(recipe.system.model, reference_parameters(recipe), reference_path)
        with unpacked(fmu) as fmu_files, unpacked(reference_path) as reference_files:
            bench = _Bench(fmu_files, reference_files, surrogate, recipe, stream)
            comparisons = _measure_all(bench, models, count, workers, progress)
    return Validation(task, surrogate, recipe, tuple(comparisons))


def _measure_all(
    bench: _Bench, models: _Models, count: int, workers: int | None, progress: Progress
) -> list[Comparison]:
    """All trajectories in order; by worker processes if the first one took long."""
    begin = time.perf_counter()
    found = [_measure(bench, models, 0)]
    seconds = time.perf_counter() - begin
    progress(1, count)
    workers = min(workers or os.cpu_count() or 1, count - 1)
    if workers > 1 and seconds * (count - 1) > WORTH_PROCESSES:
        return found + _measure_by_processes(bench, count, workers, progress)
    for index in range(1, count):
        found.append(_measure(bench, models, index))
        progress(index + 1, count)
    return found


def _measure_by_processes(
    bench: _Bench, count: int, workers: int, progress: Progress
) -> list[Comparison]:
    """All trajectories but the first, in order."""
    with process_pool(workers, _set_up, (bench,)) as pool:
        futures = [pool.submit(_measure_here, index) for index in range(1, count)]
        try:
            for done, future in enumerate(as_completed(futures), start=2):
                future.result()
                progress(done, count)
        finally:
            for future in futures:
                future.cancel()
    return [future.result() for future in futures]


_here: list[tuple[_Bench, _Models]] = []
"""What a worker process measures with."""


def _set_up(bench: _Bench) -> None:
    _here[:] = [(bench, _Models(bench.recipe))]


def _measure_here(index: int) -> Comparison:
    return _measure(*_here[0], index)


def _measure(bench: _Bench, models: _Models, index: int) -> Comparison:
    """Draw a trajectory and run everything on it."""
    drawn = draw(bench.recipe, models.reference, bench.stream, index)
    found = compare(bench.fmu, bench.reference, bench.surrogate, models.reference, drawn)
    if models.data is None:
        return found
    own = draw(bench.recipe, models.data, bench.stream, index)
    outputs = simulate(models.data, own.inputs, own.initial).outputs
    return replace(found, model=outputs[len(outputs) - len(found.reference) :])


def compare(
    fmu: UnpackedFmu, reference: UnpackedFmu, surrogate: Surrogate, system: System, drawn: Draw
) -> Comparison:
    """Run both FMUs on one drawn trajectory.

    Raises:
        CoSimulationError: an FMU reports an error.
    """
    names = [signal.name for signal in surrogate.outputs]
    inputs = {s.name: drawn.inputs[:, i] for i, s in enumerate(surrogate.inputs)}
    step, span = surrogate.window.step, surrogate.estimated_samples
    true = run_fmu(reference, inputs, names, _initial_parameters(system, drawn), step)
    estimates = [] if surrogate.estimator is None else [f"{n}_error_estimate" for n in names]
    own = run_fmu(fmu, inputs, [*names, *estimates], step=step)
    first = max(drawn.burn_in + 1, surrogate.network.n_needed)
    error = own.values[first:, : len(names)] - true.values[first:]
    true_error = np.full_like(error, np.nan)
    if len(error) >= span:
        true_error[span - 1 :] = moving_rms(error, span)
    return Comparison(
        drawn.kind,
        step * np.arange(first, len(true.values), dtype=np.float64),
        drawn.inputs[first - 1 :],
        true.values[first:],
        own.values[first:, : len(names)],
        own.values[first:, len(names) :] if estimates else None,
        true_error,
        (own.seconds, true.seconds),
        None,
    )


def _initial_parameters(system: System, drawn: Draw) -> dict[str, float | bool]:
    """Parameters that start the reference FMU in the drawn state."""
    parts = {"coordinates": drawn.initial.coordinates, "velocities": drawn.initial.velocities}
    if system.hold == "ramp":
        parts["last_input"] = drawn.initial.last_input
    values: dict[str, float | bool] = {FROM_STATE: True}
    for part, vector in parts.items():
        values.update({f"initial_{part}[{i}]": float(v) for i, v in enumerate(vector)})
    return values


def _rms(values: FloatArray, index: int) -> float:
    """RMS of one channel; a channel that is zero throughout counts as tiny, not as zero."""
    return max(float(rms(values)[index]), np.finfo(np.float64).tiny)


def _deviation(values: FloatArray) -> dict[str, float]:
    return {
        "mean_relative_deviation": float(np.mean(values)),
        "p95_relative_deviation": float(np.quantile(values, 0.95)),
    }


def _quantiles(values: list[float]) -> dict[str, float]:
    median, low, high = np.quantile(values, [0.5, 0.1, 0.9])
    return {"median": float(median), "p10": float(low), "p90": float(high)}
