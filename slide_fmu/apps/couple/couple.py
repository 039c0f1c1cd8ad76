"""FMUs are coupled: they run together from step to step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from slide_fmu.apps.couple.apart import can_go_apart, is_foreign, run_apart
from slide_fmu.apps.couple.options import CouplingOptions
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.apps.couple.run import run_here
from slide_fmu.apps.couple.structure import CoupledSystem, coupled_system
from slide_fmu.core.progress import Progress, quiet


def couple(  # noqa: PLR0913 - its options are the keywords that users read
    fmus: Mapping[str, str | Path],
    connections: Iterable[tuple[str, str]],
    *,
    step: float,
    stop: float,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress = quiet,
    method: str = "newton",
    extrapolation: str | None = None,
    tolerance: float | None = None,
    iterations: int | None = None,
    control: str | None = None,
    error: float | None = None,
    record: Sequence[str] | None = None,
    moving: Sequence[str] = (),
    deadline: float | None = None,
) -> CoupledRun:
    """Run several FMUs together, and return their values over time.

    FMUs of other tools run in a program of their own: one that crashes does not end yours.

    Args:
        fmus: files of FMUs for co-simulation, by the names of the components, in the order of
            sequential steps.
        connections: pairs ``("COMPONENT.OUTPUT", "COMPONENT.INPUT")``.
        step: communication step in s; the longest one where steps are controlled.
        stop: end time in s; the run begins at 0.
        inputs: other inputs by ``"COMPONENT.INPUT"``, in their units: a number, a function of the
            time in s, or times in s and values, with straight lines between them.
        parameters: start values by ``"COMPONENT.VARIABLE"``.
        progress: shows how far the run is.
        method: ``"newton"`` (the default), ``"fixed_point"``, ``"gauss_seidel"`` or ``"jacobi"``.
        extrapolation: of explicit steps: ``"linear"`` (the default) or ``"zero"``.
        tolerance: difference at which implicit steps end, as a part of the size of an input;
            1e-5 by default.
        iterations: largest number of iterations of an implicit step; 20 by default.
        control: ``"predictor"`` or ``"halving"``; None (the default) keeps all steps.
        error: largest error of controlled steps, likewise; 1e-3 by default.
        record: names of the values in the result; linked and given inputs and all outputs by
            default.
        moving: components whose FMUs move inputs to the set value by the end of a step, although
            their description does not say so.
        deadline: the longest time in s that one call of an FMU of another tool may take; 120 by
            default.

    Raises:
        StoppedRunError: the same as of a CoSimulationError, once there are values: it has those
            before it stopped. Or an FMU ended its program, did not return within the deadline, or
            diverged.
        CoSimulationError: an FMU cannot be run or reports an error, the method cannot run this
            system, or iterations do not end.
        FmuError: a file is no FMU.
        ValueError: a name, a unit, a connection or an option is wrong, or an option has no effect.
    """
    system = coupled_system(fmus, connections, parameters or {}, inputs or {})
    options = CouplingOptions.of(
        step=step,
        stop=stop,
        method=method,
        extrapolation=extrapolation,
        tolerance=tolerance,
        iterations=iterations,
        control=control,
        error=error,
        record=record,
        moving=moving,
        deadline=deadline,
    )
    return run_coupled(system, options, progress)


def run_coupled(
    system: CoupledSystem, options: CouplingOptions, progress: Progress = quiet
) -> CoupledRun:
    """Run a system that was read; errors are as for ``couple``.

    Where FMUs of other tools take part, all run in a program of their own, unless inputs are
    functions of this session, which cannot be sent there.
    """
    if not is_foreign(system):
        return run_here(system, options, progress)
    if can_go_apart(system):
        return run_apart(system, options, progress)
    run = run_here(system, options, progress)
    return run.with_remark(
        "FMUs ran in this program, since inputs are functions of a session, which cannot be sent "
        "to another one: an FMU that crashes ends this one, and no call has a deadline; define "
        "the functions in a module, or give tables"
    )
