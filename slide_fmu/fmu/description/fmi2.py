"""The modelDescription.xml (FMI 2.0.4) of a surrogate's FMU.

Value references, which ``runtime/calls/variables.h`` counts in the same way: inputs, outputs,
error estimates, ``window_filled``, ``error_estimate_filled``, truncation errors,
``inputs_in_range``;
then the parameters ``prehistory_known`` and ``initial_<input>``. Estimates and their filled part
only with an estimator, truncation errors only of a state-space network.

At a communication point no output depends on the inputs set at it: the dependencies under
``Outputs`` are empty, and masters find no algebraic loops. Directional derivatives are those of
the step before (``runtime/derivative/derivative.h``).
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from slide_fmu.core.signals import Signal
from slide_fmu.core.units import BASE_UNITS
from slide_fmu.fmu.description.names import IN_RANGE, PREHISTORY_KNOWN, WINDOW_FILLED, initial_name
from slide_fmu.surrogate.surrogate import Surrogate

CAPABILITIES = {
    "needsExecutionTool": "false",
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "true",
    "maxOutputDerivativeOrder": "0",
    "canRunAsynchronuously": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}

LOG_CATEGORIES = {
    "logAll": "everything",
    "logEvents": "changes of state",
    "logStatusWarning": "what is not used (always logged)",
    "logStatusDiscard": "refused values, nothing was changed (always logged)",
    "logStatusError": "wrong calls and steps, damaged files (always logged)",
}

_BEHIND = "Part of the inputs behind the"
_SET = "that were set in this run; trust the"
FILLED = {
    WINDOW_FILLED: f"{_BEHIND} outputs {_SET} outputs from 1 on",
    "error_estimate_filled": f"{_BEHIND} error estimates {_SET} estimates from 1 on",
}
"""Descriptions of the variables that tell from when on results count."""


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU; its value reference is its position. Bounds None: not given; size
    None: a scalar.

    All are of type Real, those that are 0 or 1 too: every tool can plot, connect and set a Real.
    """

    name: str
    unit: str
    causality: str
    description: str
    low: float | None
    high: float | None
    start: float | None = None
    variability: str = "continuous"
    size: int | None = None


def guid_of(payload: bytes) -> str:
    """Identity of a surrogate file, derived from its bytes as in ``runtime/bytes/payload.c``."""
    stored_crc = int.from_bytes(payload[-4:], "little")
    return f"slide-{stored_crc:08x}-{zlib.adler32(payload):08x}-{len(payload):x}"


def fmu_variables(surrogate: Surrogate) -> list[Variable]:
    """All variables in the order of their value references.

    Raises:
        ValueError: two variables would have the same name.
    """
    variables = [_input(signal) for signal in surrogate.inputs]
    variables += [_output(signal) for signal in surrogate.outputs]
    if surrogate.estimator is not None:
        count = surrogate.estimated_samples
        variables += [_error_estimate(signal, count) for signal in surrogate.outputs]
    for name in samples_behind(surrogate):
        variables.append(Variable(name, "1", "output", FILLED[name], 0.0, 1.0))
    if surrogate.network.measures_truncation:
        variables += [_truncation_error(signal) for signal in surrogate.outputs]
    variables.append(_in_range(surrogate))
    variables += _parameters(surrogate)
    return checked_names(surrogate, variables)


def checked_names(surrogate: Surrogate, variables: list[Variable]) -> list[Variable]:
    """The same variables, when their names are unique.

    Raises:
        ValueError: two have the same name.
    """
    names = [variable.name for variable in variables]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(
            f"surrogate {surrogate.name!r}: two variables of its FMU have the name {twice[0]!r}; "
            "expected unique names, rename the signal"
        )
    return variables


def samples_behind(surrogate: Surrogate) -> dict[str, int]:
    """Variables for the filled part of the inputs, and how many samples of the inputs that is.

    Those behind the outputs are what the network needs; those behind the error estimates are what
    the estimator needs at all its positions.
    """
    samples = {WINDOW_FILLED: surrogate.network.n_needed}
    estimator = surrogate.estimator
    if estimator is not None:
        samples["error_estimate_filled"] = estimator.reach
    return samples


def model_description(surrogate: Surrogate, guid: str, sources: Sequence[str] = ()) -> bytes:
    """The XML document of a surrogate's FMU; the same arguments give the same bytes.

    Args:
        surrogate: what the FMU carries.
        guid: identity of the surrogate file.
        sources: files of the ``sources`` folder to compile; empty if there is none.

    Raises:
        ValueError: two variables would have the same name.
    """
    variables = fmu_variables(surrogate)
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=surrogate.name,
        guid=guid,
        description=summary(surrogate),
        generationTool="slide-fmu",
        variableNamingConvention="flat",
        numberOfEventIndicators="0",
    )
    slave = ElementTree.SubElement(
        root, "CoSimulation", {"modelIdentifier": surrogate.name, **CAPABILITIES}
    )
    if sources:
        files = ElementTree.SubElement(slave, "SourceFiles")
        for name in sources:
            ElementTree.SubElement(files, "File", name=name)
    add_units(root, variables)
    add_log_categories(root)
    ElementTree.SubElement(
        root, "DefaultExperiment", startTime="0", stepSize=repr(surrogate.window.step)
    )
    _add_variables(root, variables)
    _add_structure(root, surrogate, variables)
    return document(root)


def _input(signal: Signal) -> Variable:
    return Variable(
        signal.name,
        signal.unit,
        "input",
        signal.description or "Input; its range is that of the training",
        signal.low,
        signal.high,
        signal.start_value,
    )


def _output(signal: Signal) -> Variable:
    text = signal.description or "Output, predicted for the end of the communication step"
    return Variable(signal.name, signal.unit, "output", text, signal.low, signal.high)


def _error_estimate(signal: Signal, count: int) -> Variable:
    text = (
        f"Estimated root mean square error of {signal.name} over the last {count} samples; costs "
        "time only when it is read"
    )
    return Variable(f"{signal.name}_error_estimate", signal.unit, "output", text, 0.0, None)


def _truncation_error(signal: Signal) -> Variable:
    text = (
        f"What {signal.name} lost by forgetting inputs older than the window, measured once per "
        "window"
    )
    return Variable(f"{signal.name}_truncation_error", signal.unit, "output", text, 0.0, None)


def _in_range(surrogate: Surrogate) -> Variable:
    also = "" if surrogate.estimator is None else ", and moved as the error estimator knows"
    text = f"1 when all inputs behind the outputs lay in their ranges{also}; else 0"
    return Variable(IN_RANGE, "1", "output", text, 0.0, 1.0, variability="discrete")


def _parameters(surrogate: Surrogate) -> list[Variable]:
    text = "1: before the start the inputs were the initial ones; 0: the first input held for ever"
    known = Variable(PREHISTORY_KNOWN, "1", "parameter", text, 0.0, 1.0, 0.0, "fixed")
    initial = [
        Variable(
            initial_name(signal.name),
            signal.unit,
            "parameter",
            f"{signal.name} before the start, where {PREHISTORY_KNOWN} is 1",
            signal.low,
            signal.high,
            signal.start_value,
            "fixed",
        )
        for signal in surrogate.inputs
    ]
    return [known, *initial]


def summary(surrogate: Surrogate) -> str:
    """What the FMU is, in one sentence."""
    window = surrogate.window
    return (
        f"SLIDE surrogate: a network that needs the last {surrogate.network.n_needed} samples of "
        f"the inputs, {window.step:g} s apart, and gives the outputs one step later"
    )


def add_units(root: ElementTree.Element, variables: list[Variable]) -> None:
    """The element UnitDefinitions, alike in both standards."""
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for name in sorted({variable.unit for variable in variables}):
        unit = ElementTree.SubElement(definitions, "Unit", name=name)
        if name in BASE_UNITS:
            ElementTree.SubElement(unit, "BaseUnit", BASE_UNITS[name])


def add_log_categories(root: ElementTree.Element) -> None:
    """The element LogCategories, alike in both standards."""
    categories = ElementTree.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ElementTree.SubElement(categories, "Category", name=name, description=text)


def given_attributes(variable: Variable) -> dict[str, str]:
    """Bounds and start value, those that are given."""
    limits = {"min": variable.low, "max": variable.high, "start": variable.start}
    return {key: repr(float(value)) for key, value in limits.items() if value is not None}


def initial_dependencies(surrogate: Surrogate, variables: list[Variable]) -> dict[int, list[int]]:
    """Outputs, and what each depends on in initialization mode, by value references.

    Outputs follow from past inputs alone, but before the first step from the start inputs, or from
    the initial ones. The filled parts do not follow from inputs: only whether those before the
    start are known counts.
    """
    inputs = [i for i, variable in enumerate(variables) if variable.causality == "input"]
    parameters = [i for i, variable in enumerate(variables) if variable.causality == "parameter"]
    filled = samples_behind(surrogate)
    return {
        i: parameters[:1] if variable.name in filled else [*inputs, *parameters]
        for i, variable in enumerate(variables)
        if variable.causality == "output"
    }


def document(root: ElementTree.Element) -> bytes:
    """The bytes of an XML document."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.encode("utf-8") + b"\n"


def _add_variables(root: ElementTree.Element, variables: list[Variable]) -> None:
    parent = ElementTree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        scalar = ElementTree.SubElement(
            parent,
            "ScalarVariable",
            name=variable.name,
            valueReference=str(reference),
            description=variable.description,
            causality=variable.causality,
            variability=variable.variability,
        )
        if variable.causality == "parameter":
            scalar.set("initial", "exact")
        if variable.causality == "output":
            scalar.set("initial", "calculated")
        real = {"unit": variable.unit, **given_attributes(variable)}
        ElementTree.SubElement(scalar, "Real", real)


def _add_structure(
    root: ElementTree.Element, surrogate: Surrogate, variables: list[Variable]
) -> None:
    """Indices begin at 1."""
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = ElementTree.SubElement(structure, "Outputs")
    unknowns = ElementTree.SubElement(structure, "InitialUnknowns")
    for reference, inputs in initial_dependencies(surrogate, variables).items():
        index, initial = str(reference + 1), " ".join(str(i + 1) for i in inputs)
        ElementTree.SubElement(outputs, "Unknown", index=index, dependencies="")
        ElementTree.SubElement(unknowns, "Unknown", index=index, dependencies=initial)
