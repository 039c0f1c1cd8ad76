"""Variables of an FMU as signals and parameters: units, ranges and start values as it says."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from fmpy.model_description import ModelVariable
from fmpy.simulation import settable_in_initialization_mode, settable_in_instantiated

from slide_fmu.core.signals import Hold, Signal
from slide_fmu.systems.base import Parameter
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.fmu.file import FmuFile
from slide_fmu.systems.found import FoundParameter
from slide_fmu.systems.specification import SignalChoice, chosen_signals

REALS = ("Real", "Float64", "Float32")
"""Types of variables that can be signals."""

WHOLE = (
    "Integer",
    "Enumeration",
    *(f"{sign}Int{n}" for sign in ("", "U") for n in (8, 16, 32, 64)),
)
"""Types of variables that take whole numbers."""


def signals_of(
    file: FmuFile, causality: str, chosen: tuple[SignalChoice, ...], hold: Hold | None
) -> tuple[Signal, ...]:
    """Give the inputs or outputs that a recipe chooses, in its order; all real ones if none.

    Args:
        file: the FMU.
        causality: ``"input"`` or ``"output"``. An output may also be a local variable.
        chosen: what the recipe says.
        hold: of inputs for which it does not say one.

    Raises:
        LoadError: a name is no such variable, is not real or an array, or has no range.
    """
    variables = {v.name: v for v in file.description.modelVariables}
    for choice in chosen:
        _require_real(file, variables.get(choice.name), causality, choice.name)
    names = [choice.name for choice in chosen]
    if not names:
        names = [v.name for v in variables.values() if _is_signal(v, causality)]
    if not names:
        raise LoadError(
            f"FMU {file.path.name!r} has no real {causality}; expected at least one: choose a "
            f"variable in system.{causality}s of the recipe"
        )
    offered = tuple(replace(choice_of(file, variables[name]), hold=hold) for name in names)
    ranges = {choice.name: choice for choice in chosen}
    fitting = tuple(_starting_inside(o, ranges.get(o.name)) for o in offered)
    return chosen_signals(causality, fitting, chosen)


def choices_of(file: FmuFile, causality: str) -> tuple[SignalChoice, ...]:
    """Give all real inputs or outputs of an FMU with what its description says about them."""
    variables = file.description.modelVariables
    return tuple(choice_of(file, v) for v in variables if _is_signal(v, causality))


def choice_of(file: FmuFile, variable: ModelVariable) -> SignalChoice:
    """Give what the description of an FMU says about a variable; its display unit is left out."""
    declared = variable.declaredType
    said = {
        key: getattr(variable, key) or (declared and getattr(declared, key))
        for key in ("unit", "min", "max", "description")
    }
    low, high, start = _number(said["min"]), _number(said["max"]), None
    if variable.causality == "input":
        start = _number(variable.start)
        if start is not None and not _between(start, low, high):
            start = None
    return SignalChoice(variable.name, said["unit"], low, high, said["description"], start)


def parameters_of(file: FmuFile) -> tuple[FoundParameter, ...]:
    """Give the parameters of an FMU with their start values, as a recipe would write them."""
    return tuple(
        FoundParameter(
            variable.name,
            _value(variable),
            choice_of(file, variable).unit or "",
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
            f"expected some of {sorted(settable)}: correct or remove them"
        )
    for name, value in parameters.items():
        variable = variables[name]
        if not _fits(variable, value):
            raise LoadError(
                f"FMU {file.path.name!r}: parameter {name!r} = {value!r}; expected a value of the "
                f"type {variable.type}"
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
        kind = variable.type if _is_scalar(variable) else f"{variable.type} array"
        raise LoadError(
            f"FMU {file.path.name!r}: {causality} {name!r} is of the type {kind}; expected a "
            "real scalar: leave it out, inputs can have a value in system.parameters"
        )


def _is_signal(variable: ModelVariable, causality: str) -> bool:
    return variable.causality == causality and variable.type in REALS and _is_scalar(variable)


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
    """Read a bound; one that is not finite, or no number that a range can have, is none."""
    value = math.nan if text is None else float(text)
    return value if math.isfinite(value) and abs(value) < 1e300 else None


def _between(value: float, low: float | None, high: float | None) -> bool:
    return (low is None or low <= value) and (high is None or value <= high)


def _starting_inside(offered: SignalChoice, chosen: SignalChoice | None) -> SignalChoice:
    """Forget the start value of an FMU where a recipe's range excludes it."""
    merged = offered if chosen is None else chosen.over(offered)
    if offered.start is None or _between(offered.start, merged.low, merged.high):
        return offered
    return replace(offered, start=None)
