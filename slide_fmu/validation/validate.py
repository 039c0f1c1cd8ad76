"""This module runs a surrogate FMU and its reference system on unseen inputs and compares them.

An FMU that was learnt from files of data names them, so that it is measured on the same files.
"""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.draws import TEST, Draw, Stream, draw, drawn_outputs, first_that_runs
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.data.pool import in_parallel, process_pool
from slide_fmu.fmu.export import Provenance
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Batching, Motion, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate_motions
from slide_fmu.validation.comparison import Comparison, compare_with_truth, with_step_times
from slide_fmu.validation.error_figures import SpeedFigures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.speed import relative_error, speed_at_equal_accuracy
from slide_fmu.validation.task import Task

WORTH_PROCESSES = 20.0
"""Work in CPU seconds above which worker processes are used; they take seconds to start."""


@dataclass(frozen=True, eq=False)
class _Bench:
    """A bench holds all that a trajectory is measured with; it is sent to worker processes."""

    fmu: UnpackedFmu
    surrogate: Surrogate
    case: Case
    stream: Stream


def validate(
    fmu: Path,
    surrogate: Surrogate,
    case: Case,
    task: Task,
    progress: Progress,
    workers: int | None = 1,
) -> Validation:
    """Run an FMU and the reference system of its recipe on the same unseen trajectories.

    A task of held-out kinds draws trajectories of these kinds. Trajectories beyond the range on
    which the reference fails are left out.

    Where the recipe has physical parameters, every trajectory has unseen values of them, from a
    Sobol sequence of the task's seed; one more is at each corner of their box.

    Samples are scored from the end of the burn-in on, and not before the input window is filled
    with inputs of the trajectory. Where the estimate is scored, its span is filled too. Where the
    recipe has a reference of its own, the model that made the data is simulated on the same
    inputs, so that its error and the error of the surrogate are known separately. Worker processes
    (one per core if None, 0 for no processes) measure when there is much to do.

    Raises:
        CoSimulationError: an FMU reports an error.
        LoadError: the reference system is not installed here.
        SimulationError: the reference, or the model that made the data, could not be simulated,
            nor on other draws; beyond the range on no trajectory at all.
        ValueError: the trajectories are too short to score anything.
    """
    return validate_against(case.source, fmu, surrogate, case, task, progress, workers)


@asked_of_sources
def validate_against(
    system: System,
    fmu: Path,
    surrogate: Surrogate,
    case: Case,
    task: Task,
    progress: Progress,
    workers: int | None,
) -> Validation:
    """Run an FMU and the reference of the system that made its data, as ``validate`` does."""
    if task.held_out:
        case = case.with_recipe(case.recipe.with_held_out_kinds())
    recipe = case.recipe
    ends = case.corners() if recipe.parameters else []
    duration = task.duration_of(recipe)
    stream = Stream(TEST, task.seed, task.amplitude, duration)
    needed = recipe.shortest_validation()
    if duration < needed - 0.5 * recipe.window.step:
        raise ValueError(
            f"duration = {duration} s; expected at least {needed:g} s, so that the FMU's windows "
            "are filled and outputs are left to score"
        )
    progress(0, recipe.unseen(task.trajectories) + len(ends))
    with unpacked(fmu) as files:
        bench = _Bench(files, surrogate, case, stream)
        begin = time.process_time()
        first = _measure_or_leave(bench, 0)
        seconds = 0.0 if _cost_as_few(bench) else time.process_time() - begin
        count = recipe.unseen(task.trajectories, seconds)
        total = count + len(ends)
        processes = os.cpu_count() or 1 if workers is None else workers
        others = _measure_others(
            bench, count, seconds, processes, lambda done: progress(done, total)
        )
        comparisons = [first, *others]
        at_corners = []
        for index, corner in enumerate(ends):
            at_corners.append(_measure(bench, count + index, corner))
            progress(count + index + 1, total)
        compared, lost = _divided(comparisons)
        compared = _timed(bench, compared)
        in_range = not (stream.beyond or task.held_out)
        speed = _speed(bench, compared) if in_range else None
    corners = tuple(at_corners)
    return Validation(task, surrogate, recipe, compared, corners, left_out=lost, speed=speed)


def _divided(measured: list[Comparison | str]) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Return the comparisons, and the errors of trajectories that are left out."""
    lost = tuple(one for one in measured if isinstance(one, str))
    if len(lost) == len(measured):
        raise SimulationError(lost[0])
    return tuple(one for one in measured if isinstance(one, Comparison)), lost


def _timed(bench: _Bench, compared: tuple[Comparison, ...]) -> tuple[Comparison, ...]:
    """Return the comparisons; at least one has the times of steps of FMU and reference.

    Where the inputs of all of them bend, the reference runs once more, straight between samples.
    """
    compared = (with_step_times(bench.fmu, bench.surrogate, compared[0]), *compared[1:])
    if any(len(one.step_seconds[1]) for one in compared):
        return compared
    stream = replace(bench.stream, factors=(1.0, 1.0))  # there the reference must not fail
    system = bench.case.reference

    def run(drawn: Draw) -> FloatArray:
        return _true_outputs(system, replace(drawn, between=None))[1]

    seconds = first_that_runs(bench.case.recipe, system, stream, 0, run)
    first = replace(compared[0], step_seconds=(compared[0].step_seconds[0], seconds))
    return (first, *compared[1:])


def _speed(bench: _Bench, compared: Sequence[Comparison]) -> SpeedFigures:
    """Compare times at equal accuracy, that of the FMU on all trajectories."""
    truth = np.concatenate([one.reference for one in compared])
    error = relative_error(np.concatenate([one.error for one in compared]), truth)
    return speed_at_equal_accuracy(bench.fmu, bench.surrogate, bench.case, bench.stream, error)


def _measure_others(
    bench: _Bench, count: int, seconds: float, workers: int, progress: Callable[[int], None]
) -> list[Comparison | str]:
    """Measure all trajectories but the first, in order.

    Worker processes do it where that takes long. One trajectory takes some CPU seconds, or 0 where
    the reference takes about as long for many at once as for few.
    """
    workers = min(workers, count - 1)
    progress(1)
    if workers > 1 and seconds * (count - 1) > WORTH_PROCESSES:
        pickled = pickle.dumps(bench)
        jobs = [(pickled, index) for index in range(1, count)]
        with process_pool(workers) as pool:
            return in_parallel(pool, _measure_here, jobs, lambda n: progress(n + 1))
    measured = []
    truths = _truths_at_once(bench, range(1, count))
    for index in range(1, count):
        measured.append(_measure_or_leave(bench, index, truths.get(index)))
        progress(index + 1)
    return measured


def _batching(bench: _Bench) -> Batching | None:
    """Return the reference if it simulates many trajectories at once, and is in no loop."""
    recipe, reference = bench.case.recipe, bench.case.reference
    if recipe.loop or not isinstance(reference, Batching):
        return None
    return reference if reference.most_at_once(tuple(recipe.parameters)) > 1 else None


def _cost_as_few(bench: _Bench) -> bool:
    """Tell whether many trajectories of the reference cost as few do."""
    reference = _batching(bench)
    return reference is not None and reference.costs_as_few(tuple(bench.case.recipe.parameters))


def _truths_at_once(bench: _Bench, indices: Iterable[int]) -> dict[int, FloatArray]:
    """Simulate the reference on trajectories at once, where it offers that.

    Returns:
        The outputs, (N + 1, n_outputs), by index; trajectories on which it fails are not there.
    """
    if _batching(bench) is None:
        return {}
    recipe, case, stream = bench.case.recipe, bench.case, bench.stream
    motions, systems = {}, []
    for index in indices:
        own = case.at(drawn_parameters(recipe, stream, index)).reference
        drawn = draw(recipe, own, stream, index)
        motions[index] = Motion(drawn.inputs, drawn.initial, drawn.between, drawn.jumps)
        systems.append(own)
    varied = tuple(recipe.parameters)
    answers = simulate_motions(case.reference, list(motions.values()), systems, varied)
    return {
        index: answer
        for index, answer in zip(motions, answers, strict=True)
        if not isinstance(answer, SimulationError)
    }


def _measure_here(pickled: bytes, index: int) -> Comparison | str:
    return _measure_or_leave(_unpickled(pickled), index)


@lru_cache(maxsize=1)
def _unpickled(bench: bytes) -> _Bench:
    """Unpickle a bench once in a worker process, which makes its systems once."""
    unpickled: _Bench = pickle.loads(bench)
    return unpickled


def _measure_or_leave(
    bench: _Bench, index: int, truth: FloatArray | None = None
) -> Comparison | str:
    """Measure a trajectory; if the system fails beyond the range, return its message."""
    try:
        return _measure(bench, index, truth=truth)
    except SimulationError as error:
        if not bench.stream.beyond:
            raise
        return str(error)


def _measure(
    bench: _Bench,
    index: int,
    corner: Mapping[str, float] | None = None,
    truth: FloatArray | None = None,
) -> Comparison:
    """Draw a trajectory and run everything on it; where the system fails on it, another one.

    Physical parameters have the values of a corner of their box, or unseen values. The outputs of
    the reference on the first draw, (N + 1, n_outputs), may be known.
    """
    recipe, stream = bench.case.recipe, bench.stream
    values = corner or drawn_parameters(recipe, stream, index)
    case = bench.case.at(values)

    def run(drawn: Draw) -> Comparison:
        known = None if drawn.attempt else truth
        compared = compare(
            bench.fmu, bench.surrogate, case.reference, drawn, values or None, known
        )
        compared = replace(compared, failed=drawn.attempt)
        if not recipe.system.reference:
            return compared
        own = draw(recipe, case.system, stream, index, drawn.attempt)
        own = replace(own, inputs=drawn.inputs, between=drawn.between, jumps=drawn.jumps)
        outputs = drawn_outputs(case.system, own)
        return replace(compared, model=outputs[len(outputs) - len(compared.reference) :])

    return first_that_runs(recipe, case.reference, stream, index, run)


def _true_outputs(system: System, drawn: Draw) -> tuple[FloatArray, FloatArray]:
    """Return true outputs, (N + 1, n_outputs), and the wall time in s of every step, (N,).

    No times are returned where inputs bend or jump: the system then goes by finer steps than it
    needs for other inputs.
    """
    begin = time.perf_counter()
    outputs = drawn_outputs(system, drawn)
    seconds = (time.perf_counter() - begin) / len(drawn.inputs)
    return outputs, np.full(len(drawn.inputs) if drawn.straight else 0, seconds)


def compare(
    fmu: UnpackedFmu,
    surrogate: Surrogate,
    system: System,
    drawn: Draw,
    parameters: Mapping[str, float] | None = None,
    known: FloatArray | None = None,
) -> Comparison:
    """Run an FMU and its reference system on one drawn trajectory.

    The system has been made with the values of the physical parameters, which the FMU gets too.
    Its outputs, (N + 1, n_outputs), may be known already.

    Raises:
        CoSimulationError: an FMU reports an error.
        SimulationError: the system could not be simulated.
    """
    truth, seconds = _true_outputs(system, drawn) if known is None else (known, np.empty(0))
    return compare_with_truth(fmu, surrogate, drawn, truth, seconds, parameters)


@asked_of_sources
def require_own_memory(system: System, in_range: Validation) -> None:
    """Refuse an FMU whose own measure of its memory contradicts its error, if it has data.

    Of a system nothing more is asked: motions from any state were simulated.
    """


@asked_of_sources
def origin_of_data(system: System) -> Provenance:
    """Return the part of a provenance that names files of data; empty for a system."""
    return {}


@asked_of_sources
def require_same_origin(system: System, provenance: Provenance, fmu: str) -> None:
    """Refuse files of data that have changed since an FMU was learnt from them.

    Raises:
        StageError: a file has changed, or the FMU does not name its files.
    """
