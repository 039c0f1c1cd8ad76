"""The modelDescription.xml (FMI 2.0.4) of a surrogate's FMU is written here.

Its variables are in ``variables.py``. At a communication point no output depends on the inputs set
at it: the dependencies under ``Outputs`` are empty, and importers find no algebraic loops.
Directional derivatives belong to the step before (``runtime/derivative/derivative.h``).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree

from slide_fmu.core.units import BASE_UNITS
from slide_fmu.fmu.description.surrogate_variables import (
    Variable,
    fmu_variables,
    initial_dependencies,
)
from slide_fmu.surrogate.surrogate import Surrogate

TOOL = "slide-fmu"
"""Name of the generation tool in the model description."""

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

INITIAL = {"output": "calculated", "local": "calculated", "parameter": "exact"}
"""FMI's attribute ``initial`` of variables, by causality."""


def guid_of(payload: bytes) -> str:
    """Derive the identity of a surrogate file from its bytes, like ``runtime/bytes/payload.c``."""
    stored_crc = int.from_bytes(payload[-4:], "little")
    return f"slide-{stored_crc:08x}-{zlib.adler32(payload):08x}-{len(payload):x}"


def model_description(surrogate: Surrogate, guid: str, sources: Sequence[str] = ()) -> bytes:
    """Write the XML document of a surrogate's FMU; the same arguments give the same bytes.

    Args:
        surrogate: the surrogate of the FMU.
        guid: identity of the surrogate file.
        sources: files of the ``sources`` folder to compile; empty if the FMU has no such folder.

    Raises:
        ValueError: two variables would have the same name.
    """
    variables = fmu_variables(surrogate)
    root = root_element(surrogate, "2.0", guid=guid)
    root.set("numberOfEventIndicators", "0")
    slave = ElementTree.SubElement(
        root, "CoSimulation", {"modelIdentifier": surrogate.name, **CAPABILITIES}
    )
    if sources:
        files = ElementTree.SubElement(slave, "SourceFiles")
        for name in sources:
            ElementTree.SubElement(files, "File", name=name)
    add_context(root, variables, surrogate)
    _add_variables(root, variables)
    _add_structure(root, variables)
    return document(root)


def root_element(surrogate: Surrogate, version: str, **identity: str) -> ElementTree.Element:
    """Start the document of a version of the standard; each names the identity differently."""
    attributes = {
        "fmiVersion": version,
        "modelName": surrogate.name,
        **identity,
        "description": "SLIDE surrogate: a network that needs the last "
        f"{surrogate.network.memory_length} samples of the inputs, {surrogate.window.step:.10g} s "
        "apart, and gives the outputs one step later",
        "generationTool": TOOL,
        "variableNamingConvention": "flat",
    }
    return ElementTree.Element("fmiModelDescription", attributes)


def add_context(
    root: ElementTree.Element, variables: Sequence[Variable], surrogate: Surrogate
) -> None:
    """Add units, log categories and the default experiment, which both standards share."""
    root.append(unit_definitions({variable.unit for variable in variables if variable.unit}))
    categories = ElementTree.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ElementTree.SubElement(categories, "Category", name=name, description=text)
    step = repr(surrogate.window.step)
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=step)


def unit_definitions(names: Iterable[str]) -> ElementTree.Element:
    """Declare units, which both standards share; units that are not SI by name only."""
    definitions = ElementTree.Element("UnitDefinitions")
    for name in sorted(names):
        unit = ElementTree.SubElement(definitions, "Unit", name=name)
        if name in BASE_UNITS:
            ElementTree.SubElement(unit, "BaseUnit", BASE_UNITS[name])
    return definitions


def common_attributes(variable: Variable) -> dict[str, str]:
    """Return the attributes of every variable, the same in both standards."""
    kind = variable.kind
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.description,
        "causality": kind.causality,
        "variability": kind.variability,
    }
    if kind.causality in INITIAL:
        attributes["initial"] = INITIAL[kind.causality]
    return attributes


def given_attributes(variable: Variable) -> dict[str, str]:
    """Return unit, bounds and start value, as far as a variable has them."""
    limits = {"min": variable.low, "max": variable.high, "start": variable.start}
    unit = {} if variable.unit is None else {"unit": variable.unit}
    return unit | {key: _number(value) for key, value in limits.items() if value is not None}


def _number(value: float) -> str:
    """Write a number as XML does."""
    return "NaN" if math.isnan(value) else repr(float(value))


def document(root: ElementTree.Element) -> bytes:
    """Write an XML document as UTF-8."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.encode("utf-8") + b"\n"


def _add_variables(root: ElementTree.Element, variables: Sequence[Variable]) -> None:
    parent = ElementTree.SubElement(root, "ModelVariables")
    for variable in variables:
        scalar = ElementTree.SubElement(parent, "ScalarVariable", common_attributes(variable))
        ElementTree.SubElement(scalar, variable.type, given_attributes(variable))


def _add_structure(root: ElementTree.Element, variables: Sequence[Variable]) -> None:
    """Write the model structure; indices begin at 1."""
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = ElementTree.SubElement(structure, "Outputs")
    unknowns = ElementTree.SubElement(structure, "InitialUnknowns")
    for position, known in initial_dependencies(variables):
        index, initial = str(position + 1), " ".join(str(i + 1) for i in known)
        ElementTree.SubElement(outputs, "Unknown", index=index, dependencies="")
        ElementTree.SubElement(unknowns, "Unknown", index=index, dependencies=initial)
