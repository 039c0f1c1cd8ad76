"""The modelDescription.xml (FMI 3.0.2) of a surrogate's FMU is written here.

Its variables are in ``variables.py``: the variables of the FMI 2.0 FMU with the same value
references, the independent variable, which FMI 3.0 requires, and arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from slide_fmu.fmu.description.fmi2 import (
    add_context,
    common_attributes,
    document,
    given_attributes,
    root_element,
)
from slide_fmu.fmu.description.surrogate_variables import (
    Variable,
    fmu_variables,
    initial_dependencies,
)
from slide_fmu.surrogate.surrogate import Surrogate

CAPABILITIES = {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "providesIntermediateUpdate": "true",
    "mightReturnEarlyFromDoStep": "false",
    "canReturnEarlyAfterIntermediateUpdate": "true",
    "hasEventMode": "false",
}

ELEMENTS = {"Real": "Float64", "Boolean": "Boolean"}
"""Names of the types in FMI 3.0."""


def model_description3(surrogate: Surrogate, guid: str) -> bytes:
    """Write the XML document of a surrogate's FMU; the same surrogate gives the same bytes.

    Raises:
        ValueError: two variables would have the same name.
    """
    variables, step = fmu_variables(surrogate, 3), repr(surrogate.window.step)
    root = root_element(surrogate, "3.0", instantiationToken=guid)
    interface = {"modelIdentifier": surrogate.name, **CAPABILITIES, "fixedInternalStepSize": step}
    ElementTree.SubElement(root, "CoSimulation", interface)
    add_context(root, variables, surrogate)
    _add_variables(root, variables)
    _add_structure(root, variables)
    return document(root)


def _add_variables(root: ElementTree.Element, variables: Sequence[Variable]) -> None:
    parent = ElementTree.SubElement(root, "ModelVariables")
    for variable in variables:
        attributes = common_attributes(variable) | given_attributes(variable)
        if variable.start is not None and variable.size is not None:
            attributes["start"] = " ".join([attributes["start"]] * variable.size)
        if variable.causality in ("input", "output", "local"):
            attributes["intermediateUpdate"] = "true"
        element = ElementTree.SubElement(parent, ELEMENTS[variable.type], attributes)
        if variable.size is not None:
            ElementTree.SubElement(element, "Dimension", start=str(variable.size))


def _add_structure(root: ElementTree.Element, variables: Sequence[Variable]) -> None:
    """Write the model structure as in FMI 2.0, with value references in place of indices."""
    structure = ElementTree.SubElement(root, "ModelStructure")
    dependencies = {
        str(variables[position].reference): " ".join(str(variables[i].reference) for i in known)
        for position, known in initial_dependencies(variables)
    }
    for reference in dependencies:
        ElementTree.SubElement(structure, "Output", valueReference=reference, dependencies="")
    for reference, known in dependencies.items():
        ElementTree.SubElement(
            structure, "InitialUnknown", valueReference=reference, dependencies=known
        )
