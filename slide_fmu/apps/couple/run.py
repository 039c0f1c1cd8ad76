"""A coupled system runs from step to step in this program."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from contextlib import ExitStack

import numpy as np

from slide_fmu.apps.couple.component import (
    DiscardedError,
    Inputs,
    inputs_of,
    instance_of,
    is_ours,
    is_trained,
    open_component,
)
from slide_fmu.apps.couple.control import MOST_HALVINGS, Control, run_steps
from slide_fmu.apps.couple.divergence import limits_of
from slide_fmu.apps.couple.initialization import initialize
from slide_fmu.apps.couple.methods import Explicit, Implicit, Method
from slide_fmu.apps.couple.options import IMPLICIT, CouplingOptions
from slide_fmu.apps.couple.remarks import remarks_on
from slide_fmu.apps.couple.result import (
    CoupledFigures,
    CoupledRun,
    CoupledValues,
    StoppedRunError,
)
from slide_fmu.apps.couple.rows import RowKeeper, Rows
from slide_fmu.apps.couple.structure import CoupledSystem, Pin, recorded_pin, unit_of
from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.variables import BOUND_FILLED, TRUSTED
from slide_fmu.importer.calls import Witness
from slide_fmu.importer.description import is_multiple, only_step
from slide_fmu.importer.errors import CoSimulationError

Witnesses = Callable[[int], Witness]
"""Gives the witness of a component by its number."""


def run_here(
    system: CoupledSystem,
    options: CouplingOptions,
    progress: Progress = quiet,
    keeper: RowKeeper | None = None,
    witnesses: Witnesses | None = None,
) -> CoupledRun:
    """Run a system that was read in this program; errors are as for ``couple``.

    Where an FMU discards a step and can go back, the run begins anew, and saves the state before
    every step of such an FMU: a half of it then takes the place of a discarded step.

    Args:
        system: the system.
        options: how it is run.
        progress: shows how far the run is.
        keeper: keeps the rows.
        witnesses: are told of every call of an FMU.
    """
    _require_steps(system, options)
    keeper = keeper or RowKeeper()
    try:
        try:
            return _run(system, options, progress, keeper, witnesses, careful=False)
        except DiscardedError as error:
            if not error.halves:
                raise
            keeper.clear()
            return _run(system, options, progress, keeper, witnesses, careful=True)
    except CoSimulationError as error:
        if not keeper.times:
            raise
        values = stopped_values(system, options, keeper.rows())
        raise StoppedRunError(str(error), values) from error


def _run(
    system: CoupledSystem,
    options: CouplingOptions,
    progress: Progress,
    keeper: RowKeeper,
    witnesses: Witnesses | None,
    careful: bool,
) -> CoupledRun:
    recorded = _recorded(system, options)
    with ExitStack() as stack:
        components = []
        for number, name in enumerate(system.paths):
            plain = options.method == "jacobi" and options.extrapolation == "zero"
            moving = name in options.moving
            inputs: Inputs = "reached" if moving else inputs_of(system, name, plain)
            instance = stack.enter_context(
                instance_of(system, name, witnesses and witnesses(number))
            )
            read = _sources(system, name), _watched(system, name, recorded)
            one = open_component(system, name, instance, inputs, read)
            one.careful = careful and one.halves
            components.append(one)
        loop, remarks = initialize(system, components, options)
        began = clock.perf_counter()
        method = _method(options)
        most, limit = min(_halvings(system, options))
        control = Control(options.control, options.error, options.step, options.stop, most, limit)
        limits = limits_of(system, _watched_pins(system, recorded))
        run = run_steps(loop, method, control, progress, keeper, limits)
        seconds = clock.perf_counter() - began
        for one in components:
            one.instance.terminate()
    remarks += remarks_on(system, options, components, run)
    values = _values(system, recorded, run.rows)
    time = run.rows.time
    figures = CoupledFigures(
        options.method,
        options.extrapolation,
        options.step,
        len(time) - 1,
        run.rejected,
        float(np.min(np.diff(time))),
        float(np.mean(run.iterations)),
        int(np.max(run.iterations)),
        {one.name: one.steps for one in components},
        {one.name: one.inputs for one in components},
        seconds,
        remarks,
    )
    return CoupledRun(time, values, _units(recorded, system), figures)


def stopped_values(
    system: CoupledSystem, options: CouplingOptions, rows: Rows
) -> CoupledValues | None:
    """Return the values of a run that stopped; None if it stopped before its first row."""
    if not len(rows.time):
        return None
    recorded = _recorded(system, options)
    return CoupledValues(rows.time, _values(system, recorded, rows), _units(recorded, system))


def widths_of(system: CoupledSystem, options: CouplingOptions) -> tuple[int, int, int]:
    """Return the numbers of outputs, linked inputs and watched variables in a row."""
    recorded = _recorded(system, options)
    outputs = sum(len(_sources(system, name)) for name in system.paths)
    return outputs, len(system.links), len(_watched_pins(system, recorded))


def _units(recorded: Sequence[Pin], system: CoupledSystem) -> dict[str, str]:
    return {str(pin): unit_of(system.variable(pin)) for pin in recorded}


def _watched_pins(system: CoupledSystem, recorded: Sequence[Pin]) -> list[Pin]:
    """Return the watched variables of all components, in the order of a row."""
    return [
        Pin(name, variable)
        for name in system.paths
        for variable in _watched(system, name, recorded)
    ]


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


def _values(system: CoupledSystem, recorded: Sequence[Pin], rows: Rows) -> dict[str, FloatArray]:
    """Return what is recorded, by name, (N,) each."""
    outputs = [Pin(name, variable) for name in system.paths for variable in _sources(system, name)]
    targets = [link.target for link in system.links]
    columns = {
        **dict(zip(outputs, rows.outputs.T, strict=True)),
        **dict(zip(_watched_pins(system, recorded), rows.watched.T, strict=True)),
        **dict(zip(targets, rows.inputs.T, strict=True)),
        **{
            pin: np.array([course(t) for t in rows.time]) for pin, course in system.courses.items()
        },
    }
    return {str(pin): columns[pin] for pin in recorded}
