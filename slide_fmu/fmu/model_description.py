"""The modelDescription.xml (FMI 2.0.4) of a surrogate's FMU.

Value references, which ``runtime/fmi2_values.c`` counts in the same way: inputs, outputs, error
estimates, ``window_filled``, ``error_estimate_filled``, truncation errors; estimates and their
filled part only with an estimator, truncation errors only of a state-space network.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from slide_fmu.signals import Signal
from slide_fmu.state_space import StateSpace
from slide_fmu.surrogate import Surrogate
from slide_fmu.units import BASE_UNITS

CAPABILITIES = {
    "needsExecutionTool": "false",
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "maxOutputDerivativeOrder": "0",
    "canRunAsynchronuously": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "false",
}

LOG_CATEGORIES = {
    "logAll": "everything",
    "logEvents": "changes of state",
    "logStatusDiscard": "refused values, nothing was changed (always logged)",
    "logStatusError": "wrong calls and steps, damaged files (always logged)",
}

_BEHIND = "Part of the inputs behind the"
_SET = "that were set in this run; trust the"
FILLED = {
    "window_filled": f"{_BEHIND} outputs {_SET} outputs from 1 on",
    "error_estimate_filled": f"{_BEHIND} error estimates {_SET} estimates from 1 on",
}
"""Descriptions of the variables that tell from when on results count."""


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU; its value reference is its position. Bounds None: not given."""

    name: str
    unit: str
    causality: str
    description: str
    low: float | None
    high: float | None
    start: float | None = None


def guid_of(payload: bytes) -> str:
    """Identity of a surrogate file, derived from its bytes as in ``runtime/payload.c``."""
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
    if isinstance(surrogate.network, StateSpace):
        variables += [_truncation_error(signal) for signal in surrogate.outputs]
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
    samples = {"window_filled": surrogate.network.n_needed}
    estimator = surrogate.estimator
    if estimator is not None:
        seen = estimator.network.n_needed + estimator.positions - 1
        samples["error_estimate_filled"] = seen
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
        description=_summary(surrogate),
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
    _add_units(root, variables)
    categories = ElementTree.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ElementTree.SubElement(categories, "Category", name=name, description=text)
    ElementTree.SubElement(
        root, "DefaultExperiment", startTime="0", stepSize=repr(surrogate.window.step)
    )
    _add_variables(root, variables)
    _add_structure(root, variables, set(samples_behind(surrogate)))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.encode("utf-8") + b"\n"


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


def _summary(surrogate: Surrogate) -> str:
    window = surrogate.window
    return (
        f"SLIDE surrogate: a network that needs the last {surrogate.network.n_needed} samples of "
        f"the inputs, {window.step:g} s apart, and gives the outputs one step later"
    )


def _add_units(root: ElementTree.Element, variables: list[Variable]) -> None:
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for name in sorted({variable.unit for variable in variables}):
        unit = ElementTree.SubElement(definitions, "Unit", name=name)
        if name in BASE_UNITS:
            ElementTree.SubElement(unit, "BaseUnit", BASE_UNITS[name])


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
            variability="continuous",
        )
        if variable.causality == "output":
            scalar.set("initial", "calculated")
        limits = {"min": variable.low, "max": variable.high, "start": variable.start}
        given = {key: repr(float(value)) for key, value in limits.items() if value is not None}
        ElementTree.SubElement(scalar, "Real", {"unit": variable.unit, **given})


def _add_structure(
    root: ElementTree.Element, variables: list[Variable], independent: set[str]
) -> None:
    """Outputs follow from past inputs alone, but before the first step from the start inputs.

    Args:
        root: parent of the element.
        variables: all variables.
        independent: names of outputs that do not follow from inputs at all.
    """
    indices = {
        causality: [i for i, v in enumerate(variables, start=1) if v.causality == causality]
        for causality in ("input", "output")
    }
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = ElementTree.SubElement(structure, "Outputs")
    unknowns = ElementTree.SubElement(structure, "InitialUnknowns")
    all_inputs = " ".join(map(str, indices["input"]))
    for index in indices["output"]:
        ElementTree.SubElement(outputs, "Unknown", index=str(index), dependencies="")
        initial = "" if variables[index - 1].name in independent else all_inputs
        ElementTree.SubElement(unknowns, "Unknown", index=str(index), dependencies=initial)
