"""Components exchange first values until these agree, and it is settled what links carry.

A linked input comes from its output at the start of a step, from its mean, or from its end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.couple.algebraic_loop import agreeing_values
from slide_fmu.apps.couple.component import Component, Nodes, is_ours, own_nodes, range_of
from slide_fmu.apps.couple.feedthrough import (
    ask_whether_it_follows,
    require_true_states,
    try_whether_it_follows,
)
from slide_fmu.apps.couple.loop import Loop, Mix
from slide_fmu.apps.couple.options import IMPLICIT, CouplingOptions
from slide_fmu.apps.couple.structure import CoupledSystem, Pin
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.errors import CoSimulationError

ROUNDING, DOUBLE = 2e-6, 1e-15
"""Rounding of single and double precision, as parts of the range of an output."""

SMALL_PART = 1e-6
"""Linked inputs that differ by less than this part of their declared range, times the tolerance,
agree, however little they have moved so far. Other tools may declare anything; the ranges of a
surrogate are those of its training, and count in full."""

SWEEPS = 10
"""Largest number of exchanges in which the first values of a circle of links are found."""


GAUSS: Nodes = ((0.5 - 12**-0.5, 0.5), (0.5 + 12**-0.5, 0.5), (1.0, 0.0))
"""Nodes and weights of Gauss's quadrature with two points, which finds means of cubics."""

MIDDLE: Nodes = ((0.5, 1.0), (1.0, 0.0))
"""The same with one point, for straight lines: a sample of an FMU of slide-fmu shows no more."""


def initialize(
    system: CoupledSystem, components: Sequence[Component], options: CouplingOptions
) -> tuple[Loop, list[str]]:
    """Initialize all components together, and return them as a loop, with remarks."""
    places = _parts([len(one.linked) for one in components])
    parts = _parts([len(one.outputs) for one in components])
    index = {
        Pin(one.name, name): part.start + i
        for one, part in zip(components, parts, strict=True)
        for i, name in enumerate(one.outputs)
    }
    sources = [index[link.source] for link in system.links]
    inputs, left = _first_values(components, places, parts, sources)
    ranges = [range_of(system.variable(link.target)) for link in system.links]
    for one, place in zip(components, places, strict=True):
        ask_whether_it_follows(system, one, inputs[place])
    for one in components:
        one.begin()
    for one, place in zip(components, places, strict=True):
        if options.method in IMPLICIT or options.control is not None:
            require_true_states(system, one, inputs[place], options.step)
        try_whether_it_follows(system, one, inputs[place], options.step)
    _require_no_loop(system, components, options)
    outputs = np.concatenate([one.read() for one in components])
    owners = [one for one in components for _ in one.linked]
    held = np.array([one.inputs in ("held", "forecast") for one in owners], dtype=np.bool_)
    mix, remarks = _input_mix(system, components, options, held)
    ours = [is_ours(system.descriptions[link.target.component]) for link in system.links]
    floors = np.array(
        [
            (1.0 if our else SMALL_PART) * (known or 0.0)
            for known, our in zip(ranges, ours, strict=True)
        ]
    )
    known = left <= options.tolerance * np.maximum(floors, np.abs(inputs))
    remarks += [
        f"{link.source} and {link.target} differ by {difference:.3g} at the start, after several "
        "exchanges, since outputs follow inputs in a circle: the first values are not exact"
        for link, difference, agree in zip(system.links, left, known, strict=True)
        if not agree
    ]
    rounding = np.array([_rounding(system, link.source) for link in system.links])
    loop = Loop(components, places, sources, parts, held, mix, floors, rounding, outputs, inputs)
    loop.inputs = loop.values(outputs)
    return loop, remarks


def _rounding(system: CoupledSystem, source: Pin) -> float:
    """Return what an output is exact to, in its unit: FMUs of slide-fmu have single precision.

    At rest, differences of large numbers leave their rounding. FMI's default nominal value is 1.
    """
    if not is_ours(system.descriptions[source.component]):
        return DOUBLE * (range_of(system.variable(source)) or 1.0)
    surrogate, _ = read_fmu(system.paths[source.component])
    ranges = {signal.name: signal.high - signal.low for signal in surrogate.outputs}
    return ROUNDING * ranges.get(source.variable, 0.0)


def _first_values(
    components: Sequence[Component],
    places: Sequence[slice],
    parts: Sequence[slice],
    sources: list[int],
) -> tuple[FloatArray, FloatArray]:
    """Return linked inputs at the start, exchanged until they agree, and what is left."""
    outputs = np.zeros(parts[-1].stop)

    def exchanged(inputs: FloatArray) -> FloatArray:
        for one, place, part in zip(components, places, parts, strict=True):
            one.set_linked(inputs[place], 0.0)
            outputs[part] = one.read()
        return outputs[sources]

    starts = exchanged(np.concatenate([one.starts() for one in components]))
    return agreeing_values(exchanged, starts, max(SWEEPS, len(components) + 1))


def _parts(counts: Sequence[int]) -> list[slice]:
    ends = np.cumsum(counts)
    return [slice(int(end) - count, int(end)) for count, end in zip(counts, ends, strict=True)]


def _require_no_loop(
    system: CoupledSystem, components: Sequence[Component], options: CouplingOptions
) -> None:
    """Refuse a circle of components with direct feedthrough that no method can solve.

    Explicit methods solve none, and implicit ones need components that can go back.
    """
    through = {one.name for one in components if one.feeds_through and one.inputs == "held"}
    after: dict[str, set[str]] = {name: set() for name in through}
    for link in system.links:
        if {link.source.component, link.target.component} <= through:
            after[link.source.component].add(link.target.component)
    circle = [name for name in after if name in _reached(after, name)]
    if options.method not in IMPLICIT and circle:
        raise CoSimulationError(
            f"method {options.method!r}: outputs of {sorted(circle)} depend on their inputs at "
            "the same time, in a circle; expected no such algebraic loop: choose method 'newton', "
            "or cut the system where an output is a state, such as a displacement"
        )
    once = [one.name for one in components if one.name in circle and not one.rolls_back]
    if once:
        raise CoSimulationError(
            f"outputs of {sorted(circle)} depend on their inputs at the same time, in a circle; "
            f"expected FMUs that can go back to a former state, which {once} cannot "
            "(canGetAndSetFMUstate): export them so that they can, or cut the system where an "
            "output is a state, such as a displacement"
        )


def _reached(after: Mapping[str, set[str]], name: str) -> set[str]:
    """Return all that is reached from a name, which counts itself in a circle alone."""
    reached: set[str] = set()
    new = set(after[name])
    while new:
        reached |= new
        new = set().union(*(after[one] for one in new)) - reached
    return reached


def _input_mix(
    system: CoupledSystem,
    components: Sequence[Component],
    options: CouplingOptions,
    held: NDArray[np.bool_],
) -> tuple[Mix, list[str]]:
    """Return how linked inputs come from outputs, with remarks; in explicit steps only whether
    they are those of the start of a step.

    An input that moves reaches the output at the end of the step. One that is held is its mean
    over the step: of a smooth output the mean of both ends. An output that follows the slope of
    inputs jumps when a step begins, so that it is read within the step. Whether an output is
    sampled, and so constant over a step, its own description says: an input that an FMU holds may
    be the force of a spring as well as the output of a controller.
    """
    names = [one.name for one in components]
    count = len(system.links)
    mix = Mix(np.zeros(count), np.zeros(count), np.zeros(count))
    remarks: list[str] = []
    for i, link in enumerate(system.links):
        source = components[names.index(link.source.component)]
        if system.variable(link.source).variability == "discrete":
            mix.start[i] = 1.0  # as a controller's output, it is held until the step ends
        elif options.method not in IMPLICIT:
            continue
        elif not held[i]:
            mix.end[i] = 1.0
        elif not source.follows:
            mix.start[i] = mix.end[i] = 0.5
        elif nodes := _nodes(source, options):
            source.nodes, mix.mean[i] = nodes, 1.0
        else:
            mix.end[i] = 1.0
            remarks.append(
                f"{link.target} is held at the value of {link.source} at the end of each step, "
                f"since {source.name} takes no shorter steps: motions are damped more, and errors "
                "may be many times larger; make this FMU with a shorter step"
            )
    remarks += [
        f"{one.name} takes part explicitly, since its FMU cannot go back to a former state "
        "(canGetAndSetFMUstate): compare with a run at half the step"
        for one in components
        if options.method in IMPLICIT and not one.rolls_back and one.linked
    ]
    return mix, remarks


def _nodes(component: Component, options: CouplingOptions) -> Nodes | None:
    """Return the parts of a step at which a component is read for its mean; None without any.

    An FMU that takes steps of one length alone is read after each of its own.
    """
    if component.any_step:  # samples of a surrogate alone would give ten times the error
        return MIDDLE if component.has_slopes(options.step) else GAUSS
    own = component.own_step
    return None if own is None or round(options.step / own) < 2 else own_nodes(options.step, own)
