"""Components are opened, and exchange their first values until these agree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.apps.couple.algebraic_loop import agreed
from slide_fmu.apps.couple.component import Component, is_ours, range_of
from slide_fmu.apps.couple.exchange import mixed, require_no_loop
from slide_fmu.apps.couple.feedthrough import (
    ask_whether_it_follows,
    require_true_states,
    try_whether_it_follows,
)
from slide_fmu.apps.couple.loop import Loop
from slide_fmu.apps.couple.options import IMPLICIT, CouplingOptions
from slide_fmu.apps.couple.structure import CoupledSystem, Pin
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu

ROUNDING, DOUBLE = 2e-6, 1e-15
"""Rounding of single and double precision, as parts of the range of an output."""

SMALL_PART = 1e-6
"""Linked inputs that differ by less than this part of their declared range, times the tolerance,
agree, however little they have moved so far. Other tools may declare anything; the ranges of a
surrogate are those of its training, and count in full."""

SWEEPS = 10
"""Largest number of exchanges in which the first values of a circle of links are found."""


def initialized(
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
    require_no_loop(system, components, options)
    outputs = np.concatenate([one.read() for one in components])
    owners = [one for one in components for _ in one.linked]
    held = np.array([one.inputs in ("held", "forecast") for one in owners], dtype=np.bool_)
    mix, remarks = mixed(system, components, options, held)
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
    return agreed(exchanged, starts, max(SWEEPS, len(components) + 1))


def _parts(counts: Sequence[int]) -> list[slice]:
    ends = np.cumsum(counts)
    return [slice(int(end) - count, int(end)) for count, end in zip(counts, ends, strict=True)]
