"""A coupled system is read and checked here: its FMUs, their variables, and what is connected."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from slide_fmu.core.given_numbers import given_numbers
from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.suggestions import or_meant
from slide_fmu.importer.description import (
    REALS,
    experiment,
    read_description,
    require_co_simulation,
)
from slide_fmu.importer.errors import CoSimulationError, FmuError

BOOLEAN = "Boolean"
"""Type of flags, which can be recorded."""

Course = Callable[[float], float]
"""The value of an input, in its unit, at a time in s."""


@dataclass(frozen=True, eq=False)
class ValueTable:
    """A ValueTable has straight lines between values, which stay constant outside of their times.

    Attributes:
        times: in s, ascending, (N,).
        values: (N,).
    """

    times: FloatArray
    values: FloatArray

    def __call__(self, time: float) -> float:
        """Return the value at a time in s."""
        return float(np.interp(time, self.times, self.values))


@dataclass(frozen=True)
class ConstantValue:
    """A ConstantValue is the same at any time."""

    value: float

    def __call__(self, time: float) -> float:
        """Return the value."""
        return self.value


@dataclass(frozen=True)
class ValueFunction:
    """A ValueFunction has values of an input, by name, that a function of the time in s gives."""

    name: str
    given: Callable[[float], Any]

    def __call__(self, time: float) -> float:
        """Return the value at a time in s.

        Raises:
            ValueError: it is not finite.
        """
        value = self.given(time)
        single = isinstance(value, np.ndarray) and value.size == 1
        if not (single or isinstance(value, numbers.Real)) or not math.isfinite(value):
            raise ValueError(
                f"input {self.name!r} = {shown(value)} at {time:.9g} s; expected a finite number"
            )
        return float(value)


class Pin(NamedTuple):
    """A Pin is a variable of a component."""

    component: str
    variable: str

    def __str__(self) -> str:
        """Write it as users do."""
        return f"{self.component}.{self.variable}"


class Link(NamedTuple):
    """A Link leads from an output of a component to an input of a component."""

    source: Pin
    target: Pin


@dataclass(frozen=True, eq=False)
class CoupledSystem:
    """A CoupledSystem has FMUs for co-simulation by name, and the links between them.

    Attributes:
        paths: the files of the FMUs.
        descriptions: fmpy's model descriptions.
        links: the connections, sorted by the components that they lead to.
        parameters: start values by the names of components and variables.
        courses: values over time of inputs that no link leads to.
    """

    paths: Mapping[str, Path]
    descriptions: Mapping[str, Any]
    links: Sequence[Link]
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    courses: Mapping[Pin, Course] = field(default_factory=dict)

    def names(self, component: str, *causalities: str, flags: bool = False) -> list[str]:
        """Return the real scalars of a component that have one of the causalities.

        With ``flags``, its Boolean variables too.
        """
        types = (*REALS, BOOLEAN) if flags else REALS
        return [
            v.name
            for v in self.descriptions[component].modelVariables
            if v.causality in causalities and v.type in types and not v.dimensions
        ]

    def variable(self, pin: Pin) -> Any:
        """Return fmpy's description of a variable."""
        return next(
            v for v in self.descriptions[pin.component].modelVariables if v.name == pin.variable
        )


def coupled_system(
    fmus: Mapping[str, str | Path],
    connections: Iterable[tuple[str, str]],
    parameters: Mapping[str, Any],
    inputs: Mapping[str, Any],
) -> CoupledSystem:
    """Read FMUs and check what is connected; arguments are those of ``couple``.

    Raises:
        CoSimulationError: an FMU is not for co-simulation.
        FmuError: a file is no FMU.
        ValueError: a name is unknown, an input has two sources, or units differ.
    """
    if not isinstance(fmus, Mapping) or not fmus:
        raise ValueError(
            f"fmus = {fmus!r}; expected at least one component, by name, such as "
            "{'car': 'car.fmu'}"
        )
    if not isinstance(inputs, Mapping) or not isinstance(parameters, Mapping):
        raise ValueError(
            f"inputs = {inputs!r}, parameters = {parameters!r}; expected values by "
            "'COMPONENT.VARIABLE' in a dict each"
        )
    if not isinstance(connections, Iterable) or isinstance(connections, str):
        raise ValueError(
            f"connections = {connections!r}; expected a list of pairs "
            "('COMPONENT.OUTPUT', 'COMPONENT.INPUT')"
        )
    if nameless := [name for name in fmus if not isinstance(name, str) or not name.strip()]:
        raise ValueError(f"component {nameless[0]!r}; expected a name for each FMU: give it one")
    paths = {name: Path(path) for name, path in fmus.items()}
    descriptions = {name: _description(name, path) for name, path in paths.items()}
    bare = CoupledSystem(paths, descriptions, ())
    links = [_link(bare, one) for one in connections]
    courses = {_pin(bare, name, "input"): _course(name, given) for name, given in inputs.items()}
    _require_one_source(links, courses)
    _require_one_instance(bare)
    for link in links:
        require_equal_units(bare, link)
    order = list(paths)
    links.sort(key=lambda link: order.index(link.target.component))
    values: dict[str, dict[str, Any]] = {name: {} for name in paths}
    for name, value in parameters.items():
        pin = _pin(bare, name)
        _require_number(name, value, bare.variable(pin).type)
        _require_in_range(name, value, bare.variable(pin))
        values[pin.component][pin.variable] = value
    return CoupledSystem(paths, descriptions, links, values, courses)


def _link(system: CoupledSystem, given: Any) -> Link:
    """Return the link that a pair of names describes."""
    pair = isinstance(given, Sequence) and not isinstance(given, str) and len(given) == 2
    if not pair or not all(isinstance(name, str) for name in given):
        raise ValueError(
            f"connection {given!r}; expected a pair ('COMPONENT.OUTPUT', 'COMPONENT.INPUT')"
        )
    source, target = given
    try:
        return Link(_pin(system, source, "output", "local"), _pin(system, target, "input"))
    except ValueError as error:
        raise ValueError(f"connection from {source!r} to {target!r}: {error}") from error


def _require_number(name: str, value: Any, kind: str) -> None:
    """Refuse a number that is not finite, and a fraction for a whole number."""
    if not isinstance(value, numbers.Real):
        if kind in (*REALS, "Float32"):
            raise ValueError(f"{name} = {shown(value)}; expected a finite number")
        return
    if not math.isfinite(value):
        raise ValueError(f"{name} = {value}; expected a finite number")
    if kind not in (*REALS, "Float32") and not float(value).is_integer():
        raise ValueError(f"{name} = {value:g}; expected a whole number, since its type is {kind}")


def _require_in_range(name: str, value: Any, variable: Any) -> None:
    """Refuse the value of a parameter outside of the range that its FMU declares.

    An input may leave its range, which gets a remark.
    """
    if variable.causality != "parameter" or not isinstance(value, numbers.Real):
        return
    ends = declared(variable, "min"), declared(variable, "max")
    low, high = (None if end is None else float(end) for end in ends)
    number = float(value)
    if (low is not None and number < low) or (high is not None and number > high):
        shown = " .. ".join("" if end is None else f"{end:g}" for end in (low, high))
        text = f"{shown}, the range that its FMU declares: choose a value in it"
        raise ValueError(f"{name} = {number:g}; expected {text}")


def _description(name: str, path: Path) -> Any:
    """Read the model description of a component."""
    if not path.is_file():
        raise FmuError(
            f"component {name!r}: there is no file {str(path)!r}; expected an FMU: "
            "correct the path"
        )
    try:
        description = read_description(path, validate=False)
    except FmuError as error:
        raise FmuError(f"component {name!r}: {error}") from None
    require_co_simulation(f"component {name!r}: {path.name}", description)
    return description


def _pin(system: CoupledSystem, text: str, *causalities: str, flags: bool = False) -> Pin:
    """Find the variable that a text ``COMPONENT.VARIABLE`` names."""
    name, dot, variable = text.partition(".")
    dotted = [one for one in system.paths if text.startswith(f"{one}.")]
    if dotted:  # names of components may have dots; the longest counts
        name = max(dotted, key=len)
        variable = text[len(name) + 1 :]
    if name in system.paths and not dot:
        raise ValueError(
            f"{text!r} is a component; expected one of its variables, such as "
            f"{f'{name}.VARIABLE'!r}"
        )
    if name not in system.paths:
        raise ValueError(
            f"{text!r} names the component {name!r}; expected COMPONENT.VARIABLE with one of "
            f"{list(system.paths)}{or_meant(name, system.paths)}"
        )
    all_ = causalities or ("parameter", "input", "structuralParameter", "local", "output")
    known = (
        system.names(name, *all_, flags=flags)
        if causalities
        else [v.name for v in system.descriptions[name].modelVariables]
    )
    if variable not in known:
        some = [one for one in known if causalities][:12]
        expected = f"one of its real scalars {some}" if some else "a real scalar, or another one"
        what = causalities[0] if len(causalities) in (1, 2) else "variable"
        found = f"component {name!r} has no {what} {variable!r}"
        for other in system.descriptions[name].modelVariables:
            if other.name == variable:
                array = "an array " if other.dimensions else ""
                found += f", which is {array}of type {other.type} and causality {other.causality}"
        raise ValueError(f"{found}; expected {expected}{or_meant(variable, known)}")
    return Pin(name, variable)


def default_step(system: CoupledSystem) -> float:
    """Return the largest communication step in s that an FMU names.

    Raises:
        ValueError: none names one.
    """
    named = [experiment(one, "stepSize") for one in system.descriptions.values()]
    steps = [step for step in named if step is not None and step > 0]
    if not steps:
        raise ValueError("no FMU names a step; expected a communication step in s: give --step")
    return max(steps)


def recorded_pin(system: CoupledSystem, name: str) -> Pin:
    """Return the real scalar or Boolean that a text ``COMPONENT.VARIABLE`` names."""
    return _pin(system, name, "output", "input", "local", "parameter", "independent", flags=True)


def _require_one_source(links: Sequence[Link], courses: Iterable[Pin]) -> None:
    """Refuse an input that two connections lead to, or one and a course of values."""
    sources: dict[Pin, str] = {pin: "values over time" for pin in courses}
    for link in links:
        if link.target in sources:
            raise ValueError(
                f"input {str(link.target)!r} is connected to {str(link.source)!r} and to "
                f"{sources[link.target]!r}; expected one source: remove one of them"
            )
        sources[link.target] = str(link.source)


def _require_one_instance(system: CoupledSystem) -> None:
    """Refuse two components of an FMU that can be there only once."""
    files = [path.resolve() for path in system.paths.values()]
    for (name, path), file in zip(system.paths.items(), files, strict=True):
        kind = system.descriptions[name].coSimulation
        if files.count(file) > 1 and kind.canBeInstantiatedOnlyOncePerProcess:
            raise CoSimulationError(
                f"component {name!r}: {path.name} can be there only once in a process; expected "
                "one component of it: remove the others, or use a copy of the file"
            )


def require_equal_units(system: CoupledSystem, link: Link) -> None:
    """Refuse a link between different units; a unit that an FMU does not name fits all.

    Units of different names are equal if both FMUs define them by the same base units.
    """
    source, target = (unit_of(system.variable(pin)) for pin in link)
    bases = [
        _base_of(system.descriptions[pin.component], name)
        for pin, name in zip(link, (source, target), strict=True)
    ]
    alike = source == target or (bases[0] is not None and bases[0] == bases[1])
    if source and target and not alike:
        raise ValueError(
            f"{str(link.source)!r} is in {source}, {str(link.target)!r} in {target}; expected one "
            "unit: convert in one of the FMUs, or correct the connection"
        )


def _base_of(description: Any, name: str) -> tuple[float, ...] | None:
    """Return exponents, factor and offset of a unit, as an FMU defines it; None if it does not."""
    base = next((u.baseUnit for u in description.unitDefinitions if u.name == name), None)
    if base is None:
        return None
    keys = ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "offset")
    factor = 1.0 if base.factor is None else float(base.factor)
    return (factor, *(float(getattr(base, key) or 0.0) for key in keys))


def require_units(system: CoupledSystem, units: Mapping[str, str]) -> None:
    """Refuse start values, by ``COMPONENT.VARIABLE``, whose units are not those of the FMUs."""
    for name, unit in units.items():
        wanted = unit_of(system.variable(_pin(system, name)))
        if wanted and wanted != unit:
            raise ValueError(
                f"start value of {name!r} is in {unit}; expected {wanted}, as in the FMU: convert "
                "the value, and give it in this unit"
            )


def unit_of(variable: Any) -> str:
    """Return the unit of a variable; empty if the FMU does not name it."""
    return str(declared(variable, "unit") or "")


def declared(variable: Any, key: str) -> Any:
    """Return an attribute of a variable, else of its declared type; None if neither has it."""
    own = getattr(variable, key, None)
    return own if own is not None else getattr(variable.declaredType, key, None)


def _course(name: str, given: Any) -> Course:
    """Return the values over time of an input: a number, a function, or times and values."""
    if callable(given):
        return ValueFunction(name, given)
    if isinstance(given, numbers.Real):
        _require_number(name, given, REALS[0])
        return ConstantValue(float(given))
    try:
        pair = tuple(given)
    except TypeError:
        pair = ()
    if len(pair) != 2:
        raise ValueError(
            f"input {name!r} = {given!r}; expected a number, a function of the time in s, or "
            "times in s and values"
        )
    times, values = (
        given_numbers(f"input {name!r}: {what}", part)
        for what, part in zip(("times in s", "values"), pair, strict=True)
    )
    if times.ndim != 1 or times.shape != values.shape or not len(times):
        raise ValueError(
            f"input {name!r}: times of shape {times.shape} and values of shape {values.shape}; "
            "expected two arrays of one length"
        )
    finite = np.isfinite(times) & np.isfinite(values)
    if not finite.all():
        k = int(np.argmin(finite))
        raise ValueError(
            f"input {name!r}: row {k + 1} is {values[k]:g} at {times[k]:g} s; expected finite "
            "numbers: correct or remove it"
        )
    rising = np.diff(times) > 0
    if not rising.all():
        k = int(np.argmin(rising))
        raise ValueError(
            f"input {name!r}: {times[k + 1]:.9g} s follows {times[k]:.9g} s in row {k + 2}; "
            "expected times that rise: sort them, and remove those that are there twice"
        )
    return ValueTable(times, values)
