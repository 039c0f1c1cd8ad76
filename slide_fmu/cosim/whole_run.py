"""An FMU is run over a grid of times; every run of an FMU as a whole is this one."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.description import require_step, start_time
from slide_fmu.importer.file import UnpackedFmu

if TYPE_CHECKING:  # they need fmpy, of the extra "run"
    from slide_fmu.importer.instance import Instance
    from slide_fmu.importer.variables import InstanceVariables


@dataclass(frozen=True, eq=False)
class Run:
    """A Run is the result of running an FMU.

    Attributes:
        values: outputs at t_0 .. t_N in their units, shape (N + 1, n_outputs); Booleans are 0 or
            1.
        seconds: wall time in s of set, doStep and get of every step by fmpy, shape (N,); empty
            where it was not asked for.
        step_seconds: wall time in s of doStep only, likewise.
    """

    values: FloatArray
    seconds: FloatArray = field(default_factory=lambda: np.empty(0))
    step_seconds: FloatArray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, eq=False)
class StepGrid:
    """A StepGrid has the communication steps of a run.

    Attributes:
        begins: times in s at which steps begin, shape (N,).
        lengths: of the steps in s, likewise.
        start: time in s of the initialization.
    """

    begins: FloatArray
    lengths: FloatArray
    start: float

    @staticmethod
    def even(start: float, step: float, count: int) -> StepGrid:
        """Return equal steps, all times in s."""
        return StepGrid(
            start + step * np.arange(count, dtype=np.float64), np.full(count, step), start
        )

    @staticmethod
    def between(times: FloatArray) -> StepGrid:
        """Return steps between times in s, shape (N + 1,)."""
        return StepGrid(times[:-1], np.diff(times), float(times[0]))


def run_fmu(
    fmu: UnpackedFmu,
    inputs: Mapping[str, FloatArray],
    outputs: Sequence[str],
    parameters: Mapping[str, float | bool] | None = None,
    step: float | None = None,
    timed: bool = False,
) -> Run:
    """Run a fresh instance of an FMU from its own start time, by equal steps.

    Args:
        fmu: the unpacked FMU.
        inputs: values by variable name, shape (N,) each; ``inputs[name][k]`` is set before the
            step from t_k to t_k+1, the first also before and in initialization mode.
        outputs: names of the variables to record.
        parameters: values set before initialization.
        step: communication step in s; the FMU's own if not given.
        timed: whether the calls of every step are timed, as Python makes them; else a loop in C
            makes them, which is faster and gives the same. Where there is no compiled library for
            this platform, Python makes them.

    Raises:
        CoSimulationError: a variable does not exist, the FMU takes no such step, or it reports an
            error.
        ValueError: a parameter cannot be set before initialization.
    """
    step = step or fmu.step
    require_step(fmu.path.name, fmu.description, step)
    fmu.require(*inputs)
    rows = np.stack(list(inputs.values()), axis=1)
    grid = StepGrid.even(start_time(fmu.description), step, len(rows))
    return run_over(fmu, grid, (list(inputs), rows), outputs, parameters or {}, timed=timed)


def run_over(
    fmu: UnpackedFmu,
    grid: StepGrid,
    inputs: tuple[Sequence[str], FloatArray],
    outputs: Sequence[str],
    parameters: Mapping[str, Any],
    first: FloatArray | None = None,
    kept: FloatArray | None = None,
    timed: bool = False,
) -> Run:
    """Run a fresh instance of an FMU over a grid of N steps.

    Args:
        fmu: the unpacked FMU.
        grid: the steps.
        inputs: names of variables, and the values that are set before each step, (N, n_inputs).
        outputs: names of the variables to record.
        parameters: values set before initialization, by name.
        first: inputs before and in initialization mode, (n_inputs,); those of the first step if
            not given.
        kept: inputs under which each step is taken once more from its begin, for the next ones,
            (N, n_inputs), where they differ.
        timed: as of ``run_fmu``.

    Raises:
        CoSimulationError: a variable does not exist, or the FMU reports an error.
        ValueError: a parameter cannot be set before initialization.
    """
    from slide_fmu.cosim import step_loop  # these need fmpy, of the extra "run"
    from slide_fmu.importer.instance import instantiated

    names, rows = inputs
    fmu.require(*names, *outputs, *parameters)
    start = (rows[0] if first is None else first).tolist()
    with instantiated(fmu) as instance:
        variables, recorded = instance.variables(names), instance.variables(outputs)
        instance.initialize(parameters, variables, start, grid.start)
        begin = recorded.get()
        if timed or kept is not None or not step_loop.offered():
            run = _steps_of_python(instance, grid, (variables, rows), recorded, kept)
        else:
            steps = grid.begins, grid.lengths
            run = Run(step_loop.take_steps(instance, steps, (variables, rows), recorded))
        instance.terminate()
    values = np.concatenate([np.array([begin], dtype=np.float64), run.values])
    return replace(run, values=values)


def _steps_of_python(
    instance: Instance,
    grid: StepGrid,
    inputs: tuple[InstanceVariables, FloatArray],
    recorded: InstanceVariables,
    kept: FloatArray | None,
) -> Run:
    """Take steps one by one, with their times; some of them twice (``run_over``).

    Returns:
        The values after each step, and the times.
    """
    variables, rows = inputs
    again = np.zeros(len(rows), dtype=bool) if kept is None else (rows != kept).any(axis=1)
    seconds, step_seconds = np.empty(len(rows)), np.empty(len(rows))
    values = []
    steps = zip(grid.begins.tolist(), grid.lengths.tolist(), rows.tolist(), again, strict=True)
    for k, (at, length, row, twice) in enumerate(steps):
        state = instance.save() if twice else None
        begin = time.perf_counter()
        variables.set(row)
        before = time.perf_counter()
        instance.do_step(at, length, not twice)
        step_seconds[k] = time.perf_counter() - before
        values.append(recorded.get())
        seconds[k] = time.perf_counter() - begin
        if kept is not None and twice:
            instance.restore(state)
            instance.free_state(state)
            variables.set(kept[k].tolist())
            instance.do_step(at, length)
    shape = len(rows), len(recorded)
    return Run(np.array(values, dtype=np.float64).reshape(shape), seconds, step_seconds)
