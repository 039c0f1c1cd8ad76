"""FMUs are coupled: opened, initialized together, and run from step to step."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.apps.couple.component import (
    Inputs,
    inputs_of,
    instance_of,
    is_ours,
    is_trained,
    open_component,
)
from slide_fmu.apps.couple.control import MOST_HALVINGS, AcceptedSteps, Control, run_steps
from slide_fmu.apps.couple.initialization import initialize
from slide_fmu.apps.couple.loop import Loop
from slide_fmu.apps.couple.methods import Explicit, Implicit, Method
from slide_fmu.apps.couple.options import IMPLICIT, CouplingOptions
from slide_fmu.apps.couple.remarks import remarks_on
from slide_fmu.apps.couple.result import CoupledFigures, CoupledRun
from slide_fmu.apps.couple.structure import (
    CoupledSystem,
    Pin,
    coupled_system,
    recorded_pin,
    unit_of,
)
from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.variables import BOUND_FILLED, TRUSTED
from slide_fmu.importer.description import is_multiple, only_step


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
) -> CoupledRun:
    """Run several FMUs together, and return their values over time.

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

    Raises:
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
    )
    return run_coupled(system, options, progress)


def run_coupled(
    system: CoupledSystem, options: CouplingOptions, progress: Progress = quiet
) -> CoupledRun:
    """Run a system that was read; errors are as for ``couple``."""
    _require_steps(system, options)
    recorded = _recorded(system, options)
    with ExitStack() as stack:
        components = []
        for name in system.paths:
            plain = options.method == "jacobi" and options.extrapolation == "zero"
            moving = name in options.moving
            inputs: Inputs = "reached" if moving else inputs_of(system, name, plain)
            instance = stack.enter_context(instance_of(system, name))
            read = _sources(system, name), _watched(system, name, recorded)
            components.append(open_component(system, name, instance, inputs, read))
        loop, remarks = initialize(system, components, options)
        began = clock.perf_counter()
        method = _method(options)
        most, limit = min(_halvings(system, options))
        control = Control(options.control, options.error, options.step, options.stop, most, limit)
        run = run_steps(loop, method, control, progress)
        seconds = clock.perf_counter() - began
        for one in components:
            one.instance.terminate()
    remarks += remarks_on(system, options, components, run)
    values = _values(system, loop, recorded, run)
    units = {str(pin): unit_of(system.variable(pin)) for pin in recorded}
    figures = CoupledFigures(
        options.method,
        options.extrapolation,
        options.step,
        len(run.time) - 1,
        run.rejected,
        float(np.min(np.diff(run.time))),
        float(np.mean(run.iterations)),
        int(np.max(run.iterations)),
        {one.name: one.steps for one in components},
        {one.name: one.inputs for one in components},
        seconds,
        remarks,
    )
    return CoupledRun(run.time, values, units, figures)


def _method(options: CouplingOptions) -> Method:
    if options.method in IMPLICIT:
        return Implicit(options.method == "newton", options.tolerance, options.iterations)
    return Explicit(options.method == "gauss_seidel", options.extrapolation == "linear")


def _require_steps(system: CoupledSystem, options: CouplingOptions) -> None:
    """Refuse a step that is no multiple of the own step of an FMU with steps of one length."""
    unknown = sorted(set(options.moving) - set(system.paths))
    if unknown:
        raise ValueError(f"moving = {unknown}; expected some of {list(system.paths)}")
    for name in system.paths:
        own = only_step(system.descriptions[name])
        if own is None:
            continue
        count = options.step / own
        if options.control is not None and round(count) % 2 == 1:
            raise ValueError(
                f"control = {options.control!r} halves steps of {options.step:g} s; "
                f"component {name!r} takes only multiples of {own:g} s: choose 2, 4, 8 ... times "
                "as much, or leave control out"
            )
        if not is_multiple(options.step, own):
            raise ValueError(
                f"step = {options.step:g} s; expected a multiple of {own:g} s, the step of "
                f"component {name!r}, which takes no other one"
            )


def _halvings(system: CoupledSystem, options: CouplingOptions) -> list[tuple[int, str]]:
    """Return how often a step can be halved for each FMU with steps of one length, by its name.

    The shortest step is tried by two halves too. Without such FMUs a limit without a name counts.
    """
    steps = {name: only_step(one) for name, one in system.descriptions.items()}
    counts = {name: round(options.step / own) for name, own in steps.items() if own is not None}
    halvings = [((count & -count).bit_length() - 2, name) for name, count in counts.items()]
    return [(MOST_HALVINGS, ""), *halvings]


def _recorded(system: CoupledSystem, options: CouplingOptions) -> list[Pin]:
    """Return the variables whose values are in the result."""
    if options.record is not None:
        return [recorded_pin(system, name) for name in dict.fromkeys(options.record)]
    used = [link.target for link in system.links] + list(system.courses)
    outputs = [
        Pin(name, variable) for name in system.paths for variable in _plain_outputs(system, name)
    ]
    return [*used, *outputs]


def _plain_outputs(system: CoupledSystem, name: str) -> list[str]:
    """Return the outputs of a component; of an FMU of ours, only what it was trained to give."""
    description = system.descriptions[name]
    names = system.names(name, "output")
    if not is_ours(description):
        return names
    references = {v.name: v.valueReference for v in description.modelVariables}
    return [one for one in names if is_trained(references[one])]


def _sources(system: CoupledSystem, name: str) -> list[str]:
    """Return the outputs of a component that links start from."""
    pins = [link.source for link in system.links]
    return list(dict.fromkeys(pin.variable for pin in pins if pin.component == name))


def _watched(system: CoupledSystem, name: str, recorded: Sequence[Pin]) -> list[str]:
    """Return what else of a component is read: for the result, and whether it is trusted."""
    known = {link.target for link in system.links} | set(system.courses)
    known |= {link.source for link in system.links}
    recorded_here = [
        pin.variable for pin in recorded if pin.component == name and pin not in known
    ]
    judged = is_ours(system.descriptions[name]) and TRUSTED in system.names(
        name, "output", flags=True
    )
    return list(dict.fromkeys([*recorded_here, *((TRUSTED, BOUND_FILLED) if judged else ())]))


def _values(
    system: CoupledSystem, loop: Loop, recorded: Sequence[Pin], run: AcceptedSteps
) -> dict[str, FloatArray]:
    """Return what is recorded, by name, (N,) each."""
    every = loop.components
    outputs = {Pin(one.name, name): None for one in every for name in one.outputs}
    watched = {Pin(one.name, name): None for one in every for name in one.watched}
    inputs = {link.target: None for link in system.links}
    columns = {
        **dict(zip(outputs, run.outputs.T, strict=True)),
        **dict(zip(watched, run.watched.T, strict=True)),
        **dict(zip(inputs, run.inputs.T, strict=True)),
        **{pin: np.array([course(t) for t in run.time]) for pin, course in system.courses.items()},
    }
    return {str(pin): columns[pin] for pin in recorded}
