"""This module makes signals and parameters of an FMU's variables, with units, ranges, starts."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from fmpy.model_description import ModelVariable
from fmpy.simulation import settable_in_initialization_mode, settable_in_instantiated

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import Hold, Signal
from slide_fmu.systems.declared import (
    DeclaredParameter,
    Parameter,
    SignalTable,
    SignalTables,
)
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.fmu.file import FmuFile, declared_in
from slide_fmu.systems.specification import chosen_signals

REALS = ("Real", "Float64", "Float32")
"""Types of variables that can be signals."""

WHOLE = (
    "Integer",
    "Enumeration",
    *(f"{sign}Int{n}" for sign in ("", "U") for n in (8, 16, 32, 64)),
)
"""Types of variables that take whole numbers."""


def signals_of(
    file: FmuFile, causality: str, chosen: SignalTables, hold: Hold | None
) -> tuple[Signal, ...]:
    """Give the inputs or outputs that a recipe chooses, in its order; all real ones if none.

    Args:
        file: the FMU.
        causality: ``"input"`` or ``"output"``. An output may also be a local variable.
        chosen: the tables of the recipe.
        hold: of inputs for which it does not say one.

    Raises:
        LoadError: a name is no such variable, is not real or an array, or has no range.
    """
    variables = {v.name: v for v in file.description.modelVariables}
    for name in chosen:
        _require_real(file, variables.get(name), causality, name)
    names = list(chosen) or [v.name for v in variables.values() if _is_signal(v, causality)]
    _require_some(file, causality, names)
    offered = {}
    for name in names:
        table = table_of(file, variables[name])
        ends = table.range if name not in chosen else chosen[name].range or table.range
        start = _within(table.start, *(ends or (None, None)))
        offered[name] = table.model_copy(update={"hold": hold, "start": start})
    return chosen_signals(causality, offered, chosen)


def tables_of(file: FmuFile, causality: str) -> dict[str, SignalTable]:
    """Give all real inputs or outputs of an FMU with their descriptions.

    Raises:
        LoadError: there are none.
    """
    variables = file.description.modelVariables
    tables = {v.name: table_of(file, v) for v in variables if _is_signal(v, causality)}
    _require_some(file, causality, tables)
    return tables


def remarks_on_variables(file: FmuFile) -> list[str]:
    """Say which units have other names here, and which inputs are no signals."""
    variables = file.description.modelVariables
    remarks = []
    for name, known in file.units.items():
        if known == name:
            continue
        where = [v.name for v in variables if declared_in(v, "unit") == name and _acts(v)]
        if where and known is not None:
            remarks.append(f"unit {name!r} of {', '.join(where)} is {known}, by its definition")
        elif where:
            remarks.append(
                f"unit {name!r} of {', '.join(where)} is not known here, neither by its name nor "
                "by its definition: values stay as they are; write a known unit of this size into "
                "the recipe, or leave them without"
            )
    others = [v for v in variables if v.causality == "input" and not _is_signal(v, "input")]
    if others:
        named = ", ".join(f"{v.name} ({_type_of(v)})" for v in others)
        remarks.append(
            f"inputs of other types than real scalars keep their start values: {named}; "
            "system.parameters may give others"
        )
    return remarks


def limits_of(file: FmuFile) -> dict[str, tuple[float, float]]:
    """Give least and greatest value of outputs that declare one of them alone, by name."""
    limits = {}
    for variable in file.description.modelVariables:
        if _is_signal(variable, "output"):
            low, high = (_number(declared_in(variable, key)) for key in ("min", "max"))
            if (low is None) is not (high is None):
                ends = -math.inf if low is None else low, math.inf if high is None else high
                limits[variable.name] = ends
    return limits


def table_of(file: FmuFile, variable: ModelVariable) -> SignalTable:
    """Return the table of a variable from an FMU's description, without its display unit.

    A range needs both ends; a start value outside of an end that there is counts as none.
    """
    unit, description = (declared_in(variable, key) for key in ("unit", "description"))
    unit = None if unit is None else file.units[unit]
    low, high = (_number(declared_in(variable, key)) for key in ("min", "max"))
    start = _number(variable.start) if variable.causality == "input" else None
    ends = (low, high) if low is not None and high is not None and low < high else None
    return SignalTable(
        unit=unit, description=description, range=ends, start=_within(start, low, high)
    )


def parameters_of(file: FmuFile) -> tuple[DeclaredParameter, ...]:
    """Give the parameters of an FMU with their start values, as a recipe would write them."""
    return tuple(
        DeclaredParameter(
            variable.name,
            _value(variable),
            table_of(file, variable).unit or "",
            variable.description or "",
        )
        for variable in file.description.modelVariables
        if variable.causality in ("parameter", "structuralParameter")
        and _is_scalar(variable)
        and variable.type != "Binary"
        and variable.start is not None
    )


def require_parameters(file: FmuFile, parameters: Mapping[str, Parameter]) -> None:
    """Refuse parameters that the FMU has not, that cannot be set, or that have another type.

    Raises:
        LoadError: with the parameter, and what was expected.
    """
    variables = {v.name: v for v in file.description.modelVariables}
    settable = [v.name for v in variables.values() if _is_settable(v)]
    unknown = sorted(set(parameters) - set(settable))
    if unknown:
        raise LoadError(
            f"FMU {file.path.name!r}: parameters {unknown} are not there or cannot be set; "
            f"expected some of {sorted(settable)}: correct or remove them",
            unknown[0],
        )
    for name, value in parameters.items():
        variable = variables[name]
        if not _fits(variable, value):
            raise LoadError(
                f"FMU {file.path.name!r}: parameter {name!r} = {shown(value)}; expected a "
                f"value of the type {variable.type}",
                name,
            )


def _require_some(file: FmuFile, causality: str, names: Collection[str]) -> None:
    """Refuse an FMU without any signal of a causality."""
    if names:
        return
    others = [v for v in file.description.modelVariables if v.causality == causality]
    found = f" ({', '.join(f'{v.name} is {_type_of(v)}' for v in others)})" if others else ""
    raise LoadError(
        f"FMU {file.path.name!r} has no real {causality}{found}; expected at least one: choose a "
        f"variable in system.{causality}s of the recipe"
    )


def _require_real(
    file: FmuFile, variable: ModelVariable | None, causality: str, name: str
) -> None:
    """Refuse a name that cannot be a signal."""
    variables = file.description.modelVariables
    accepted = ("input",) if causality == "input" else ("output", "local")
    if variable is None or variable.causality not in accepted:
        known = [v.name for v in variables if v.causality == causality]
        raise LoadError(
            f"FMU {file.path.name!r} has no {causality} {name!r}; expected some of {known}: "
            f"correct system.{causality}s in the recipe"
        )
    if variable.type not in REALS or not _is_scalar(variable):
        raise LoadError(
            f"FMU {file.path.name!r}: {causality} {name!r} is of the type {_type_of(variable)}; "
            "expected a real scalar: leave it out, inputs can have a value in system.parameters"
        )


def _is_signal(variable: ModelVariable, causality: str) -> bool:
    return variable.causality == causality and variable.type in REALS and _is_scalar(variable)


def _acts(variable: ModelVariable) -> bool:
    return any(_is_signal(variable, causality) for causality in ("input", "output"))


def _type_of(variable: ModelVariable) -> str:
    return variable.type if _is_scalar(variable) else f"{variable.type} array"


def _is_scalar(variable: ModelVariable) -> bool:
    return not variable.shape and not variable.dimensions


def _is_settable(variable: ModelVariable) -> bool:
    if variable.causality in ("independent", "calculatedParameter"):
        return False
    return bool(settable_in_instantiated(variable) or settable_in_initialization_mode(variable))


def _fits(variable: ModelVariable, value: Parameter) -> bool:
    """Tell whether a value from a recipe is one of the variable's type."""
    if not _is_scalar(variable):
        return isinstance(value, str)  # fmpy reads the elements of an array from a text
    if variable.type in REALS:
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    if variable.type in WHOLE:
        return isinstance(value, int) and not isinstance(value, bool)
    return isinstance(value, {"Boolean": bool, "String": str}.get(variable.type, ()))


def _value(variable: ModelVariable) -> Parameter:
    """Give the start value of a variable in its type."""
    start = str(variable.start)
    if variable.type in REALS:
        return float(start)
    if variable.type in WHOLE:
        return int(start)
    return start.lower() in ("true", "1") if variable.type == "Boolean" else start


def _number(text: str | None) -> float | None:
    """Read a bound; the result is None if it is not finite, or invalid for a range."""
    value = math.nan if text is None else float(text)
    return value if math.isfinite(value) and abs(value) < 1e300 else None


def _within(value: float | None, low: float | None, high: float | None) -> float | None:
    """Give a value that lies between bounds, where there are some; else None."""
    below = value is not None and low is not None and value < low
    above = value is not None and high is not None and value > high
    return None if below or above else value
