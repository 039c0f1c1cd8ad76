"""A surrogate FMU runs beside its reference FMU on unseen inputs, and the error is measured."""

from __future__ import annotations

import os
import pickle
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, hold_of, outside_of_range
from slide_fmu.cosim.run import CoSimulationError, UnpackedFmu, run_fmu, unpacked
from slide_fmu.data.draws import TEST, Draw, Stream, draw, drawn_outputs, first_that_runs
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.data.pool import in_parallel, process_pool
from slide_fmu.python_fmu.reference_slave import FROM_STATE, write_reference_fmu
from slide_fmu.recipe.case import Case
from slide_fmu.records.either import either
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import RandomStates, State, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.beside import beside
from slide_fmu.validation.comparison import Comparison, Task, Validation
from slide_fmu.validation.on_records import validate_records

WORTH_PROCESSES = 20.0
"""Work in s from which on worker processes, which take seconds to start, do the rest."""


@dataclass(frozen=True, eq=False)
class _Bench:
    """A bench is what every trajectory is measured with; it goes to worker processes.

    There is no reference FMU of a system that simulates whole records by itself.
    """

    fmu: UnpackedFmu
    reference: UnpackedFmu | None
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
    """Run an FMU and the reference FMU of its recipe side by side on unseen trajectories.

    Where the task is about kinds that are held out, the trajectories are of these.

    Of records, the FMU runs on the blocks of the part "test", beside what was measured there.

    Trajectories beyond the range on which the reference fails are left out.

    A reference system whose states cannot be set is no FMU: it simulates each record by itself.

    Where the recipe has physical parameters, every trajectory has unseen values of them, from a
    Sobol sequence of the task's seed; one more is at each corner of their box. Then the reference
    simulates by itself too.

    Samples are scored from the end of the burn-in on, and not before the input window is filled
    with inputs of the trajectory. Where the estimate is scored, its span is filled too. Where the
    recipe has a reference of its own, the model that made the data is simulated on the same
    inputs, so that its error is known apart from that of the surrogate. Worker processes (one per
    core if None, none if 0) measure when there is much to do; both FMUs of a trajectory run in one
    process.

    Raises:
        CoSimulationError: an FMU reports an error.
        LoadError: the reference system is not installed here.
        SimulationError: the reference, or the model that made the data, could not be simulated,
            nor on other draws; beyond the range on no trajectory at all.
        ValueError: the trajectories are too short to score anything.
    """
    return either(
        case.source,
        lambda _: _validate_systems(fmu, surrogate, case, task, progress, workers),
        lambda records: validate_records(fmu, surrogate, case.recipe, records, task, progress),
    )


def _validate_systems(
    fmu: Path,
    surrogate: Surrogate,
    case: Case,
    task: Task,
    progress: Progress,
    workers: int | None,
) -> Validation:
    """Run an FMU beside the reference system of a case, as ``validate`` does."""
    if task.held_out:
        case = case.with_recipe(case.recipe.with_held_out_kinds())
    recipe = case.recipe
    count = task.trajectories or recipe.validation.trajectories
    corners = case.corners() if recipe.parameters else []
    total = count + len(corners)
    duration = task.duration or recipe.validation.duration or recipe.data.duration
    stream = Stream(TEST, task.seed, task.amplitude, duration)
    needed = recipe.shortest_validation()
    if duration < needed - 0.5 * recipe.window.step:
        raise ValueError(
            f"duration = {duration} s; expected at least {needed:g} s, so that the FMU's windows "
            "are filled and outputs are left to score"
        )
    progress(0, total)
    with tempfile.TemporaryDirectory() as folder:
        reference_path = Path(folder) / "reference.fmu"
        with ExitStack() as stack:
            fmu_files, reference_files = stack.enter_context(unpacked(fmu)), None
            # of other values of physical parameters every time: those simulate by themselves
            if _is_co_simulated(case) and not recipe.parameters:
                write_reference_fmu(case.systems.reference_specification, reference_path)
                reference_files = stack.enter_context(unpacked(reference_path))
            bench = _Bench(fmu_files, reference_files, surrogate, case, stream)
            comparisons = _measure_all(bench, count, workers, lambda n, _: progress(n, total))
            at_corners = []
            for index, corner in enumerate(corners):
                at_corners.append(_measure(bench, count + index, corner))
                progress(count + index + 1, total)
            found, lost = _divided(comparisons)
            found = _timed(bench, found)
    return Validation(task, surrogate, recipe, found, tuple(at_corners), left_out=lost)


def _divided(measured: list[Comparison | str]) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Return the comparisons, and what was wrong with trajectories that are left out."""
    lost = tuple(one for one in measured if isinstance(one, str))
    if len(lost) == len(measured):
        raise SimulationError(lost[0])
    return tuple(one for one in measured if isinstance(one, Comparison)), lost


def _timed(bench: _Bench, found: tuple[Comparison, ...]) -> tuple[Comparison, ...]:
    """Return the comparisons, of which at least one tells what a step of the reference takes.

    Where the inputs of all of them bend, the reference runs once more, straight between samples.
    """
    if any(len(one.step_seconds[1]) for one in found):
        return found
    stream = replace(bench.stream, factors=(1.0, 1.0))  # there the reference must not fail
    system = bench.case.reference

    def run(drawn: Draw) -> FloatArray:
        straight = replace(drawn, between=None)
        return _true_outputs(bench.reference, system, straight)[1]

    seconds = first_that_runs(bench.case.recipe, system, stream, 0, run)
    first = replace(found[0], step_seconds=(found[0].step_seconds[0], seconds))
    return (first, *found[1:])


def _measure_all(
    bench: _Bench,
    count: int,
    workers: int | None,
    progress: Callable[[int, int], None],
) -> list[Comparison | str]:
    """Measure all trajectories in order, by worker processes if the first one took long."""
    begin = time.perf_counter()
    found = [_measure_or_leave(bench, 0)]
    seconds = time.perf_counter() - begin
    progress(1, count)
    wanted = os.cpu_count() or 1 if workers is None else workers
    workers = min(wanted, count - 1)
    if workers > 1 and seconds * (count - 1) > WORTH_PROCESSES:
        pickled = pickle.dumps(bench)
        jobs = [(pickled, index) for index in range(1, count)]
        with process_pool(workers) as pool:
            return found + in_parallel(pool, _measure_here, jobs, lambda n: progress(n + 1, count))
    for index in range(1, count):
        found.append(_measure_or_leave(bench, index))
        progress(index + 1, count)
    return found


def _measure_here(pickled: bytes, index: int) -> Comparison | str:
    return _measure_or_leave(_unpickled(pickled), index)


@lru_cache(maxsize=1)
def _unpickled(bench: bytes) -> _Bench:
    """Unpickle a bench once in a worker process, which makes its systems once."""
    found: _Bench = pickle.loads(bench)
    return found


def _measure_or_leave(bench: _Bench, index: int) -> Comparison | str:
    """Measure a trajectory; beyond the range, where the system may fail, return its words."""
    try:
        return _measure(bench, index)
    except SimulationError as error:
        if not bench.stream.beyond:
            raise
        return str(error)


def _measure(bench: _Bench, index: int, corner: Mapping[str, float] | None = None) -> Comparison:
    """Draw a trajectory and run everything on it; where the system fails on it, another one.

    Physical parameters are those of a corner of their box, or unseen ones.
    """
    recipe, stream = bench.case.recipe, bench.stream
    values = corner or drawn_parameters(recipe, stream, index)
    case = bench.case.at(values)

    def run(drawn: Draw) -> Comparison:
        fmus = bench.fmu, bench.reference
        found = compare(*fmus, bench.surrogate, case.reference, drawn, values or None)
        found = replace(found, failed=drawn.attempt)
        if not recipe.system.reference:
            return found
        own = draw(recipe, case.system, stream, index, drawn.attempt)
        outputs = drawn_outputs(case.system, own)
        return replace(found, model=outputs[len(outputs) - len(found.reference) :])

    return first_that_runs(recipe, case.reference, stream, index, run)


def _is_co_simulated(case: Case) -> bool:
    """Tell whether a reference system runs as an FMU, which is started in drawn states.

    An object of a session cannot be made again there.
    """
    given = case.systems.specification.given
    return isinstance(case.reference, RandomStates) and given is None


def _true_outputs(
    reference: UnpackedFmu | None, system: System, drawn: Draw
) -> tuple[FloatArray, FloatArray]:
    """Return true outputs, (N + 1, n_outputs), and the wall time in s of every step, (N,).

    No times are returned where inputs bend: the system then goes by finer steps than it needs for
    other inputs.
    """
    if drawn.between is not None:
        return drawn_outputs(system, drawn), np.empty(0)
    if reference is None or drawn.initial is None:
        begin = time.perf_counter()
        outputs = drawn_outputs(system, drawn)
        seconds = (time.perf_counter() - begin) / len(drawn.inputs)
        return outputs, np.full(len(drawn.inputs), seconds)
    names = [signal.name for signal in system.outputs]
    inputs = {s.name: drawn.inputs[:, i] for i, s in enumerate(system.inputs)}
    start = _initial_parameters(system, drawn.initial)
    try:
        true = run_fmu(reference, inputs, names, start, system.step)
    except CoSimulationError as error:  # another draw may take its place, as of other references
        outside = outside_of_range(system.inputs, drawn.inputs)
        raise SimulationError(f"{outside}: {error}" if outside else str(error)) from error
    return true.values, true.seconds


def compare(
    fmu: UnpackedFmu,
    reference: UnpackedFmu | None,
    surrogate: Surrogate,
    system: System,
    drawn: Draw,
    parameters: Mapping[str, float] | None = None,
) -> Comparison:
    """Run an FMU and the reference, an FMU or the system itself, on one drawn trajectory.

    The system has been made with the values of the physical parameters, which the FMU gets too.

    Raises:
        CoSimulationError: an FMU reports an error.
        SimulationError: the system could not be simulated.
    """
    truth, seconds = _true_outputs(reference, system, drawn)
    return beside(fmu, surrogate, drawn, truth, seconds, parameters)


def _initial_parameters(system: System, initial: State) -> dict[str, float | bool]:
    """Return the parameters that start the reference FMU in a drawn state."""
    parts = {"coordinates": initial.coordinates, "velocities": initial.velocities}
    if hold_of(system.inputs) == "first_order":
        parts["last_input"] = initial.last_input
    values: dict[str, float | bool] = {FROM_STATE: True}
    for part, vector in parts.items():
        values.update({f"initial_{part}[{i}]": float(v) for i, v in enumerate(vector)})
    return values
