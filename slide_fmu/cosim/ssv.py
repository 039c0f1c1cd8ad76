"""Values of parameters are SSV files (System Structure Parameter Values 1.0, of SSP 1.0)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

from slide_fmu.fmu.description.fmi2 import document

NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SET = "parameters"
"""Name of all parameter sets; Ecos selects them by this name."""

NUMBERS = {f"{{{NAMESPACE}}}{kind}" for kind in ("Real", "Integer")}
"""Elements whose attribute ``value`` is a number."""

BOOLEAN, TRUTHS = f"{{{NAMESPACE}}}Boolean", {"true": "1", "false": "0"}
"""Elements whose attribute ``value`` is one of these words, and the numbers for them."""


def parameter_set(values: Mapping[str, float | bool]) -> bytes:
    """Write values of a component's parameters, by name, as the XML document of an SSV file.

    Their types there are those in Python: ``Real``, ``Integer`` or ``Boolean``.
    """
    ElementTree.register_namespace("ssv", NAMESPACE)
    root = ElementTree.Element(f"{{{NAMESPACE}}}ParameterSet", version="1.0", name=SET)
    parent = ElementTree.SubElement(root, f"{{{NAMESPACE}}}Parameters")
    for name, value in values.items():
        child = ElementTree.SubElement(parent, f"{{{NAMESPACE}}}Parameter", name=name)
        kind, text = "Real", repr(float(value))
        if isinstance(value, bool | int):
            kind = "Boolean" if isinstance(value, bool) else "Integer"
            text = str(value).lower()
        ElementTree.SubElement(child, f"{{{NAMESPACE}}}{kind}", value=text)
    return document(root)


def read_parameter_set(path: Path) -> dict[str, float]:
    """Read the numbers of an SSV file, by name.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is not an SSV file, or a value in it is not a number.
    """
    return parameters_of(path.read_bytes(), str(path))


def parameters_of(content: bytes, path: str) -> dict[str, float]:
    """Read the numbers of an SSV file, by name, from its content; messages name its path.

    Raises:
        ValueError: it is not an SSV file, or a value in it is not a number.
    """
    try:
        root = ElementTree.fromstring(content)
    except (
        ElementTree.ParseError,
        LookupError,
        ValueError,
    ) as error:  # errors of its encoding too
        raise ValueError(
            f"{path} is no XML document ({error}); expected an SSV file, as slide-fmu calibrate "
            "-o FITTED.ssv writes one"
        ) from error
    if root.tag != f"{{{NAMESPACE}}}ParameterSet":
        raise ValueError(
            f"{path} begins with the element {root.tag!r}; expected an SSV file of SSP 1.0, whose "
            "element is ParameterSet: slide-fmu calibrate -o FITTED.ssv writes one"
        )
    return {
        str(parameter.get("name")): _number(path, parameter)
        for parameter in root.iter(f"{{{NAMESPACE}}}Parameter")
    }


def units_of(content: bytes) -> dict[str, str]:
    """Read the units that the content of an SSV file names for its numbers, by name."""
    units = {
        str(parameter.get("name")): child.get("unit")
        for parameter in ElementTree.fromstring(content).iter(f"{{{NAMESPACE}}}Parameter")
        for child in parameter
    }
    return {name: unit for name, unit in units.items() if unit}


def _number(path: str, parameter: ElementTree.Element) -> float:
    """Return the value of an element ``Parameter``, whose only child is named by its type."""
    texts = [child.get("value", "") for child in parameter if child.tag in {*NUMBERS, BOOLEAN}]
    if parameter.find(BOOLEAN) is not None:
        texts = [TRUTHS.get(text, text) for text in texts]
    try:
        (text,) = texts
        return float(text)
    except ValueError:
        raise ValueError(
            f"{path}: parameter {parameter.get('name')!r} has the values {texts} of type Real, "
            "Integer or Boolean; expected one number, or true or false"
        ) from None
