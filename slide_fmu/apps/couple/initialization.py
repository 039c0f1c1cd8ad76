"""Components are opened, and exchange their first values until these agree."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException

from slide_fmu.apps.couple.component import Component, feeds_through, is_ours, range_of
from slide_fmu.apps.couple.exchange import mixed, require_no_loop
from slide_fmu.apps.couple.loop import Loop
from slide_fmu.apps.couple.options import CouplingOptions
from slide_fmu.apps.couple.structure import CoupledSystem, Pin
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.importer import ImportedSlave, open_slave
from slide_fmu.cosim.run import CoSimulationError, unpacked
from slide_fmu.fmu.export import read_fmu

ROUNDING = 2e-6
"""Rounding of single precision, as a part of the range of an output."""

SWEEPS = 10
"""Largest number of exchanges in which the first values of a circle of links are found."""


@contextmanager
def instance_of(system: CoupledSystem, name: str) -> Iterator[ImportedSlave]:
    """Instantiate the FMU of a component for the time of a ``with`` block.

    Raises:
        CoSimulationError: its library cannot be loaded, or it refuses a call.
    """
    with ExitStack() as stack:
        fmu = stack.enter_context(unpacked(system.paths[name]))
        messages: list[str] = []
        try:
            slave = stack.enter_context(open_slave(fmu.folder, fmu.description, name, messages))
        except Exception as error:  # fmpy raises bare Exception when a library cannot be loaded
            reason = "; ".join([str(error), *messages])
            raise CoSimulationError(f"component {name!r}: {reason}") from error
        for key, call in inspect.getmembers(slave.calls, inspect.ismethod):
            setattr(slave.calls, key, _named(name, call, messages))
        yield ImportedSlave(slave.calls)


def _named(name: str, call: Callable[..., Any], messages: list[str]) -> Callable[..., Any]:
    """Return a call of a component that names it, and its messages, where it is refused."""

    def named(*arguments: Any, **by_name: Any) -> Any:
        try:
            return call(*arguments, **by_name)
        except FMICallException as error:
            reason = "; ".join(messages) or f"{error}, without a reason: run this FMU alone"
            raise CoSimulationError(f"component {name!r} refuses a call: {reason}") from error

    return named


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
    links = zip(system.links, inputs, strict=True)
    sizes = np.array([range_of(system.variable(link.target), value) for link, value in links])
    for one, place in zip(components, places, strict=True):
        one.feeds_through = feeds_through(one, 0.0, inputs[place], sizes[place])
    require_no_loop(system, components, options)
    for one, place in zip(components, places, strict=True):
        one.begin(inputs[place], 0.0)
    outputs = np.concatenate([one.read() for one in components])
    owners = [one for one in components for _ in one.linked]
    held = np.array([one.inputs in ("held", "forecast") for one in owners], dtype=np.bool_)
    mix, remarks = mixed(system, components, options, held)
    known = left <= options.tolerance * np.maximum(sizes, np.abs(inputs))
    remarks += [
        f"{link.source} and {link.target} differ by {difference:.3g} at the start, after several "
        "exchanges, since outputs follow inputs in a circle: the first values are not exact"
        for link, difference, agree in zip(system.links, left, known, strict=True)
        if not agree
    ]
    rounding = np.array([_rounding(system, link.source) for link in system.links])
    loop = Loop(components, places, sources, parts, held, mix, sizes, rounding, outputs, inputs)
    loop.inputs = loop.values(outputs)
    return loop, remarks


def _rounding(system: CoupledSystem, source: Pin) -> float:
    """Return what an output is exact to, in its unit: FMUs of slide-fmu have single precision."""
    if not is_ours(system.descriptions[source.component]):
        return 0.0
    surrogate, _ = read_fmu(system.paths[source.component])
    ranges = {signal.name: signal.high - signal.low for signal in surrogate.outputs}
    return ROUNDING * ranges.get(source.variable, 0.0)


def _first_values(
    components: Sequence[Component],
    places: Sequence[slice],
    parts: Sequence[slice],
    sources: list[int],
) -> tuple[FloatArray, FloatArray]:
    """Return linked inputs at the start, exchanged until they agree, and what is left.

    Where the exchange grows, these are the inputs with the smallest differences.
    """
    outputs = np.zeros(parts[-1].stop)

    def exchanged(inputs: FloatArray) -> FloatArray:
        for one, place, part in zip(components, places, parts, strict=True):
            one.set_linked(inputs[place], 0.0)
            outputs[part] = one.read()
        return outputs[sources]

    tried = [exchanged(np.concatenate([one.starts() for one in components]))]
    lefts: list[FloatArray] = []
    for _ in range(max(SWEEPS, len(components))):  # a chain takes one for each component
        new = exchanged(tried[-1])
        lefts.append(np.abs(new - tried[-1]))
        if np.allclose(new, tried[-1], rtol=1e-9, atol=0.0):
            return tried[-1], lefts[-1]
        tried.append(new)
    largest = np.max(lefts, axis=0)
    best = int(np.argmin(np.max(lefts / np.where(largest > 0, largest, 1.0), axis=1)))
    exchanged(tried[best])
    return tried[best], lefts[best]


def _parts(counts: Sequence[int]) -> list[slice]:
    ends = np.cumsum(counts)
    return [slice(int(end) - count, int(end)) for count, end in zip(counts, ends, strict=True)]
