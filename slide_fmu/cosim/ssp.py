"""Several FMUs form one system in an SSP file (System Structure and Parameterization 1.0)."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from slide_fmu.core.files import write_zip
from slide_fmu.cosim.ssv import parameter_set
from slide_fmu.fmu.description.fmi2 import document
from slide_fmu.importer.description import read_description

STRUCTURE = "SystemStructure.ssd"
DESCRIPTION = "http://ssp-standard.org/SSP1/SystemStructureDescription"
COMMON = "http://ssp-standard.org/SSP1/SystemStructureCommon"
OF_PARAMETERS = "application/x-ssp-parameter-set"

LONGEST = 80
"""Largest number of letters of a component's name in the names of its files."""


class Connection(NamedTuple):
    """A Connection leads from an output of a component to an input of a component."""

    start: tuple[str, str]
    end: tuple[str, str]


def write_system(
    path: Path,
    name: str,
    components: Mapping[str, Path],
    connections: Sequence[Connection],
    parameters: Mapping[str, Mapping[str, float | bool]] | None = None,
) -> Path:
    """Write FMUs and how they are connected; the same arguments give the same bytes.

    Every input and output of a component of type Real or Boolean is a connector of it.

    Args:
        path: file to write, ending in ``.ssp``; an old file is replaced as a whole.
        name: name of the system.
        components: FMUs for co-simulation by the names of their instances.
        connections: connections between them.
        parameters: values of parameters by name, by the names of components; each has a file
            ``resources/COMPONENT.ssv``. In names of files, ``_`` stands for whatever a URI does
            not have.

    Returns:
        The path.

    Raises:
        FmuError: a component is not a readable FMU.
        OSError: the file cannot be written.
        ValueError: the path does not end in ``.ssp``, a connection names an unknown connector,
            parameters name an unknown component, or a name has characters that XML has not.
    """
    if path.suffix != ".ssp":
        raise ValueError(f"SSP {str(path)!r}; expected a name ending in .ssp")
    kinds = {component: _connectors(fmu) for component, fmu in components.items()}
    for connection in connections:
        _require(kinds, connection.start, "output")
        _require(kinds, connection.end, "input")
    values = parameters or {}
    if not set(values) <= set(components):
        raise ValueError(
            f"SSP with parameters of {sorted(values)}; expected components out of "
            f"{sorted(components)}"
        )
    places = _places(components)
    contents = {f"{places[one]}.fmu": fmu.read_bytes() for one, fmu in components.items()}
    files = {f"{places[one]}.ssv": parameter_set(values[one]) for one in values}
    structure = _structure(name, kinds, connections, places, sorted(values))
    write_zip(path, {STRUCTURE: structure, **contents, **files})
    return path


def _places(components: Collection[str]) -> dict[str, str]:
    """Return where each component has its files, without their suffix."""
    places: dict[str, str] = {}
    for component in components:
        if not component.isprintable():
            raise ValueError(
                f"SSP component {component!r}; expected a name without control characters: "
                "rename it"
            )
        stem = re.sub(r"[^A-Za-z0-9_-]", "_", component)[:LONGEST]
        place = f"resources/{stem}"
        # some file systems take capital letters for small ones
        while place.lower() in {one.lower() for one in places.values()}:
            place = f"{place}_{len(places)}"
        places[component] = place
    return places


_Connectors = Mapping[str, tuple[str, str]]
"""Variables that can be connected, by name: ``input`` or ``output``, ``Real`` or ``Boolean``."""

_TYPES = {"Real": "Real", "Float64": "Real", "Boolean": "Boolean"}
"""Types of variables that become connectors, and their names in SSP 1.0."""


def _connectors(fmu: Path) -> _Connectors:
    """Read the variables of an FMU that can be connected."""
    return {
        v.name: (v.causality, _TYPES[v.type])
        for v in read_description(fmu).modelVariables
        if v.causality in ("input", "output") and v.type in _TYPES
    }


def _require(kinds: Mapping[str, _Connectors], connector: tuple[str, str], kind: str) -> None:
    """Reject a connector that no component has as input or output."""
    component, name = connector
    known = [key for key, (own, _) in kinds.get(component, {}).items() if own == kind]
    if name not in known:
        raise ValueError(
            f"SSP connection at {component}.{name}: no {kind} has that name; expected one of "
            f"{sorted(known)}"
        )


def _structure(
    name: str,
    kinds: Mapping[str, _Connectors],
    connections: Sequence[Connection],
    places: Mapping[str, str],
    parametrised: Sequence[str],
) -> bytes:
    """Write the XML document of the structure; some components have files of parameters."""
    ElementTree.register_namespace("ssd", DESCRIPTION)
    ElementTree.register_namespace("ssc", COMMON)
    root = ElementTree.Element(
        f"{{{DESCRIPTION}}}SystemStructureDescription", version="1.0", name=name
    )
    system = _add(root, "System", name=name)
    elements = _add(system, "Elements")
    for component, connectors in kinds.items():
        kind, source = "application/x-fmu-sharedlibrary", f"{places[component]}.fmu"
        element = _add(elements, "Component", name=component, type=kind, source=source)
        parent = _add(element, "Connectors")
        for connector, (causality, of_type) in connectors.items():
            child = _add(parent, "Connector", name=connector, kind=causality)
            ElementTree.SubElement(child, f"{{{COMMON}}}{of_type}")
        if component in parametrised:
            bindings, place = _add(element, "ParameterBindings"), f"{places[component]}.ssv"
            _add(bindings, "ParameterBinding", type=OF_PARAMETERS, source=place)
    parent = _add(system, "Connections") if connections else system  # the schema requires one
    for connection in connections:
        names = ("startElement", "startConnector", "endElement", "endConnector")
        values = (*connection.start, *connection.end)
        _add(parent, "Connection", **dict(zip(names, values, strict=True)))
    return document(root)


def _add(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, f"{{{DESCRIPTION}}}{tag}", attributes)
