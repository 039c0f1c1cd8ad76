"""Remarks on a coupled run: what was run may not be what was meant, and results may be wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from slide_fmu.apps.couple.component import Component, is_ours
from slide_fmu.apps.couple.control import AcceptedSteps
from slide_fmu.apps.couple.options import IMPLICIT, CouplingOptions
from slide_fmu.apps.couple.structure import CoupledSystem, Pin, ValueTable, declared
from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.variables import AT_STEP_END, BOUND_FILLED, TRUSTED
from slide_fmu.importer.description import WHOLE

BEYOND = 1e-3
"""Part of the range of an input by which it may be exceeded without a remark."""

MISSED = 0.002
"""Part of its motion so far by which steps may miss an input without a remark. Results without one
were wrong by up to 2 % in a car that was cut in two, and by up to 7 % after six periods of an
oscillator without damping. Later periods add errors up."""

FEW = 10
"""A run with fewer steps gets no such remark: it shows no usual step."""

OFTEN = 0.05
"""Share of the communication points from which on a flag gets a remark: usually, 4 % are false
alarms."""


def remarks_on(
    system: CoupledSystem,
    options: CouplingOptions,
    components: Sequence[Component],
    run: AcceptedSteps,
) -> list[str]:
    """Return remarks on a run that has ended, a sentence each."""
    return [
        *_on_start_times(components),
        *_on_open_inputs(system),
        *_on_replaced_values(system),
        *_on_tables(system, options),
        *_on_steps(system, options, run),
        *_on_misses(system, options, run),
        *([run.zigzag] if run.zigzag else []),
        *_on_ranges(system, run),
        *_on_flags(components, run),
    ]


def _on_start_times(components: Sequence[Component]) -> Iterator[str]:
    """Say which FMUs do not begin at 0 s."""
    for one in components:
        if one.instance.begin != 0.0:
            yield (
                f"{one.name} begins at {one.instance.begin:g} s of its own time, the startTime of "
                "its default experiment, when the run is at 0 s"
            )


def _on_open_inputs(system: CoupledSystem) -> Iterator[str]:
    """Say which inputs nothing leads to."""
    known = {link.target for link in system.links} | set(system.courses)
    for name in system.paths:
        given = system.parameters.get(name, {})
        left = [
            variable
            for variable in system.names(name, "input")
            if Pin(name, variable) not in known and variable not in given
        ]
        if left:
            yield (
                f"{name}: {', '.join(left)} without a connection or a value: start values are "
                "held; connect them, or give values"
            )


def _on_replaced_values(system: CoupledSystem) -> Iterator[str]:
    """Say which start values have no effect, since a connection or a table sets the input."""
    sources = {link.target: str(link.source) for link in system.links}
    sources |= dict.fromkeys(system.courses, "values over time")
    for name, given in system.parameters.items():
        for variable, value in given.items():
            if (source := sources.get(Pin(name, variable))) is not None:
                yield (
                    f"{name}.{variable} = {value} has no effect, since {source} sets this input: "
                    "leave one of them out"
                )


def _on_tables(system: CoupledSystem, options: CouplingOptions) -> Iterator[str]:
    """Say which tables begin after the run does, or end before."""
    for pin, course in system.courses.items():
        if isinstance(course, ValueTable) and len(course.times) > 1:
            first = float(course.times[0])
            if first > 0.5 * options.step:
                yield (
                    f"values of {pin} begin at {first:g} s, and the run at 0 s: the first one is "
                    "held before"
                )
            last = float(course.times[-1])
            if last < options.stop - 0.5 * options.step:
                yield (
                    f"values of {pin} end at {last:g} s, and the run at {options.stop:g} s: the "
                    "last one is held in between"
                )


def _on_steps(
    system: CoupledSystem, options: CouplingOptions, run: AcceptedSteps
) -> Iterator[str]:
    """Say which surrogates have longer or shorter steps of their own."""
    usual = float(np.median(np.diff(run.rows.time)))  # s
    by = "" if options.method in IMPLICIT else ", by an implicit method"  # explicit may need it
    for name, one in system.descriptions.items():
        if not is_ours(one) or one.defaultExperiment is None or not one.defaultExperiment.stepSize:
            continue
        own = float(one.defaultExperiment.stepSize)
        if usual < (1 - WHOLE) * own:
            most, remedy = "", f"take its own step{by}"
            if options.control is not None:
                most, remedy = "most of ", "allow a larger error, or leave control out"
            yield (
                f"step = {usual:g} s, as {most}the steps were, is shorter than {own:g} s, the "
                f"step of {name!r}: a surrogate has no more to give between its samples, so "
                "shorter steps take time and hardly make it more accurate, and motions may grow: "
                f"{remedy}"
            )
        if usual > (1 + WHOLE) * own and AT_STEP_END in system.names(name, "parameter"):
            yield (
                f"step = {usual:g} s is longer than {own:g} s, the step of {name!r}: its error "
                "bound and its flags do not know what inputs do between communication points; "
                "take its own step where that counts"
            )


def _on_misses(
    system: CoupledSystem, options: CouplingOptions, run: AcceptedSteps
) -> Iterator[str]:
    """Say which linked inputs turned out to be others than explicit steps had taken."""
    parts = run.missed
    if len(run.iterations) < FEW or not np.max(parts, initial=0.0) > MISSED:
        return
    worst = int(np.argmax(parts))
    other = "an implicit method"
    if options.method in IMPLICIT:
        other = "an FMU that can go back to a former state"
    yield (
        f"{system.links[worst].target}: values that steps assumed differ from those that came "
        f"out, by up to {percent(parts[worst])} of its motion in most steps: results may be wrong "
        f"by many times as much, since errors add up; take shorter steps or {other}"
    )


def _on_ranges(system: CoupledSystem, run: AcceptedSteps) -> Iterator[str]:
    """Say which inputs left the ranges that their FMUs declare."""
    linked = zip((link.target for link in system.links), run.rows.inputs.T, strict=True)
    constant = [
        (pin, np.full(len(run.rows.time), value))
        for name, values in system.parameters.items()
        for variable, value in values.items()
        if system.variable(pin := Pin(name, variable)).causality == "input"
        and pin not in system.courses
        and pin not in {link.target for link in system.links}
    ]
    given = [
        *(
            (pin, np.array([course(t) for t in run.rows.time]))
            for pin, course in system.courses.items()
        ),
        *constant,
    ]
    for pins, remedy in (
        (linked, "; if it grows on and on, take shorter steps or an implicit method"),
        (given, ""),
    ):
        for pin, values in pins:
            yield from _on_range(system, run.rows.time, pin, values, remedy)


def _on_range(
    system: CoupledSystem, time: FloatArray, pin: Pin, values: FloatArray, remedy: str
) -> Iterator[str]:
    """Say whether the values of an input, (N,), left its range."""
    variable = system.variable(pin)
    ends = declared(variable, "min"), declared(variable, "max")
    if None in ends:
        return
    low, high = map(float, ends)
    outside = np.maximum(low - values, values - high) > BEYOND * (high - low)
    if outside.any():
        farthest = values[np.argmax(np.abs(values - 0.5 * (low + high)))]
        yield (
            f"{pin} leaves its range {low:g} .. {high:g} at {time[np.argmax(outside)]:.6g} s, and "
            f"reaches {farthest:.3g}: results from then on may be wrong{remedy}"
        )


def _on_flags(components: Sequence[Component], run: AcceptedSteps) -> Iterator[str]:
    """Say how often surrogates are not trusted, once they know their past."""
    names = [(one.name, variable) for one in components for variable in one.watched]
    values = dict(zip(names, run.rows.watched.T, strict=True))
    for name in dict.fromkeys(name for name, variable in names if variable == TRUSTED):
        trusted = values[name, TRUSTED][values[name, BOUND_FILLED] >= 1]
        share = float(np.mean(trusted == 0)) if len(trusted) else 0.0
        if not len(trusted):
            yield (
                f"{name}.{BOUND_FILLED} is {values[name, BOUND_FILLED][-1]:.2g} at the end: the "
                f"surrogate does not know enough of its past, so {name}.{TRUSTED} is false "
                f"throughout; take a longer stop, or parameters {name}.prehistory_known = 1 and "
                f"{name}.initial_INPUT where the machine rests before"
            )
        elif share > OFTEN:
            yield (
                f"{name}.{TRUSTED} is false at {percent(share)} of the communication points at "
                f"which {name}.{BOUND_FILLED} is 1: results may be wrong there; record "
                f"{name}.{TRUSTED} to see where"
            )
