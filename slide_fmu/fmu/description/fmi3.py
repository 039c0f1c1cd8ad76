"""The modelDescription.xml (FMI 3.0.2) of a surrogate's FMU.

Variables and value references are those of the FMI 2.0 FMU (``model_description.py``). After them
come the independent variable, which FMI 3.0 asks for, and arrays: where the network knows several
samples of the outputs at a time, one of them for each output; one of the samples before the start
for each input.
"""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

from slide_fmu.core.signals import Signal
from slide_fmu.features.base import BEFORE
from slide_fmu.fmu.description.fmi2 import (
    Variable,
    add_log_categories,
    add_units,
    checked_names,
    document,
    fmu_variables,
    given_attributes,
    initial_dependencies,
    summary,
)
from slide_fmu.fmu.description.names import PREHISTORY_KNOWN, initial_name
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

INITIAL = {"output": "calculated", "local": "calculated", "parameter": "exact"}
"""How the start values of variables are found, by causality."""

TIME = Variable("time", "s", "independent", "Simulation time", None, None)


def fmu_variables3(surrogate: Surrogate) -> list[Variable]:
    """All variables in the order of their value references.

    Raises:
        ValueError: two variables would have the same name.
    """
    variables = [_prehistory_known(variable) for variable in fmu_variables(surrogate)]
    variables.append(TIME)
    count = block_size(surrogate)
    if count > 1:
        variables += [_output_window(signal, count) for signal in surrogate.outputs]
    count = initial_window_size(surrogate)
    variables += [_initial_window(signal, count) for signal in surrogate.inputs]
    return checked_names(surrogate, variables)


def initial_window_size(surrogate: Surrogate) -> int:
    """Samples of the inputs that any result depends on, with those before for their features."""
    estimator = surrogate.estimator
    reach = 0 if estimator is None else estimator.reach
    return max(surrogate.window.n_in, reach) + BEFORE


def block_size(surrogate: Surrogate) -> int:
    """Samples of the outputs that the network knows at a time: it gives them at once, or, with a
    state space, they are those of its output window."""
    return surrogate.network.block_length(len(surrogate.outputs))


def model_description3(surrogate: Surrogate, guid: str) -> bytes:
    """The XML document of a surrogate's FMU; the same surrogate gives the same bytes.

    Raises:
        ValueError: two variables would have the same name.
    """
    variables, step = fmu_variables3(surrogate), repr(surrogate.window.step)
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=surrogate.name,
        instantiationToken=guid,
        description=summary(surrogate),
        generationTool="slide-fmu",
        variableNamingConvention="flat",
    )
    interface = {"modelIdentifier": surrogate.name, **CAPABILITIES, "fixedInternalStepSize": step}
    ElementTree.SubElement(root, "CoSimulation", interface)
    add_units(root, variables)
    add_log_categories(root)
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=step)
    _add_variables(root, variables)
    _add_structure(root, surrogate, variables)
    return document(root)


def _prehistory_known(variable: Variable) -> Variable:
    """The same variable, which FMI 3.0 gives one more value."""
    if variable.name != PREHISTORY_KNOWN:
        return variable
    text = f"{variable.description}; 2: their last samples were the arrays initial_..._window"
    return replace(variable, description=text, high=2.0)


def _initial_window(signal: Signal, count: int) -> Variable:
    return Variable(
        f"{initial_name(signal.name)}_window",
        signal.unit,
        "parameter",
        f"{signal.name} at the last {count} samples before the start, oldest first, where "
        f"{PREHISTORY_KNOWN} is 2",
        signal.low,
        signal.high,
        signal.start_value,
        "fixed",
        count,
    )


def _output_window(signal: Signal, count: int) -> Variable:
    """No output, so that masters do not record it unasked."""
    text = (
        f"{signal.name} at the last {count} samples, oldest first, as the network sees them now; "
        "costs time only when it is read"
    )
    return Variable(
        f"{signal.name}_window",
        signal.unit,
        "local",
        text,
        signal.low,
        signal.high,
        size=count,
    )


def _add_variables(root: ElementTree.Element, variables: list[Variable]) -> None:
    parent = ElementTree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        initial = INITIAL.get(variable.causality)
        attributes = {
            "name": variable.name,
            "valueReference": str(reference),
            "description": variable.description,
            "causality": variable.causality,
            "variability": variable.variability,
            **({} if initial is None else {"initial": initial}),
            "unit": variable.unit,
            **given_attributes(variable),
        }
        if variable.start is not None and variable.size is not None:
            attributes["start"] = " ".join([attributes["start"]] * variable.size)
        if variable.causality in ("input", "output", "local"):
            attributes["intermediateUpdate"] = "true"
        element = ElementTree.SubElement(parent, "Float64", attributes)
        if variable.size is not None:
            ElementTree.SubElement(element, "Dimension", start=str(variable.size))


def _add_structure(
    root: ElementTree.Element, surrogate: Surrogate, variables: list[Variable]
) -> None:
    """As in FMI 2.0, but by value references in place of indices, which begin at 1."""
    structure = ElementTree.SubElement(root, "ModelStructure")
    dependencies = initial_dependencies(surrogate, variables)
    for reference in dependencies:
        ElementTree.SubElement(structure, "Output", valueReference=str(reference), dependencies="")
    for reference, inputs in dependencies.items():
        ElementTree.SubElement(
            structure,
            "InitialUnknown",
            valueReference=str(reference),
            dependencies=" ".join(map(str, inputs)),
        )
