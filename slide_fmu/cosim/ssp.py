"""Several FMUs as one system: SSP files (System Structure and Parameterization 1.0)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from slide_fmu.core.files import write_zip
from slide_fmu.fmu.description.reading import read_description

STRUCTURE = "SystemStructure.ssd"
DESCRIPTION = "http://ssp-standard.org/SSP1/SystemStructureDescription"
COMMON = "http://ssp-standard.org/SSP1/SystemStructureCommon"


@dataclass(frozen=True)
class Connection:
    """A connection between two components.

    Attributes:
        start: component and its output.
        end: component and its input.
    """

    start: tuple[str, str]
    end: tuple[str, str]


def write_ssp(
    path: Path, name: str, components: Mapping[str, Path], connections: Sequence[Connection]
) -> Path:
    """Write FMUs and how they are connected; the same arguments give the same bytes.

    Every input and output of a component of type Real or Boolean is a connector of it.

    Args:
        path: file to write, ending in ``.ssp``; replaced as a whole when it is there.
        name: of the system.
        components: FMUs for co-simulation by the names of their instances.
        connections: between them.

    Returns:
        The path.

    Raises:
        FmuError: a component is no FMU that can be read.
        OSError: the file cannot be written.
        ValueError: the path does not end in ``.ssp``, or a connection names no connector.
    """
    if path.suffix != ".ssp":
        raise ValueError(f"SSP {str(path)!r}; expected a name ending in .ssp")
    kinds = {component: _connectors(fmu) for component, fmu in components.items()}
    for connection in connections:
        _require(kinds, connection.start, "output")
        _require(kinds, connection.end, "input")
    members = {f"resources/{component}.fmu": fmu for component, fmu in components.items()}
    contents = {member: fmu.read_bytes() for member, fmu in members.items()}
    write_zip(path, {STRUCTURE: _structure(name, kinds, connections), **contents})
    return path


def write_comparison(
    path: Path, name: str, inputs: Path, reference: Path, surrogate: Path
) -> Path:
    """Write an SSP of a surrogate and its reference on the same inputs.

    Its components are ``inputs``, ``reference`` and ``surrogate``. The system has no connectors of
    its own: there are importers that reject them.

    Args:
        path: file to write, ending in ``.ssp``.
        name: of the system.
        inputs: FMU whose outputs are the inputs of the others.
        reference: FMU of the system that the surrogate stands for.
        surrogate: FMU.

    Returns:
        The path.

    Raises:
        FmuError, OSError, ValueError: as for ``write_ssp``.
    """
    components = {"inputs": inputs, "reference": reference, "surrogate": surrogate}
    connections = [
        Connection(("inputs", signal), (component, signal))
        for component in ("reference", "surrogate")
        for signal in _connectors(inputs)
    ]
    return write_ssp(path, name, components, connections)


@dataclass(frozen=True)
class _Connector:
    """A variable that can be connected: ``input`` or ``output``, ``Real`` or ``Boolean``."""

    kind: str
    type: str


_TYPES = {"Real": "Real", "Float64": "Real", "Boolean": "Boolean"}
"""Types of variables that become connectors, and their names in SSP 1.0."""


def _connectors(fmu: Path) -> dict[str, _Connector]:
    """Variables of an FMU that can be connected, by name."""
    return {
        v.name: _Connector(v.causality, _TYPES[v.type])
        for v in read_description(fmu).modelVariables
        if v.causality in ("input", "output") and v.type in _TYPES
    }


def _require(
    kinds: Mapping[str, Mapping[str, _Connector]], connector: tuple[str, str], kind: str
) -> None:
    component, name = connector
    connectors = kinds.get(component, {})
    found = connectors.get(name)
    if found is None or found.kind != kind:
        known = sorted(key for key, value in connectors.items() if value.kind == kind)
        raise ValueError(
            f"SSP connection at {component}.{name}: no {kind} has that name; expected one of "
            f"{known}"
        )


def _structure(
    name: str,
    kinds: Mapping[str, Mapping[str, _Connector]],
    connections: Sequence[Connection],
) -> bytes:
    """The XML document of the structure."""
    ElementTree.register_namespace("ssd", DESCRIPTION)
    ElementTree.register_namespace("ssc", COMMON)
    root = ElementTree.Element(_ssd("SystemStructureDescription"), version="1.0", name=name)
    system = ElementTree.SubElement(root, _ssd("System"), name=name)
    elements = ElementTree.SubElement(system, _ssd("Elements"))
    for component, connectors in kinds.items():
        element = ElementTree.SubElement(
            elements,
            _ssd("Component"),
            name=component,
            type="application/x-fmu-sharedlibrary",
            source=f"resources/{component}.fmu",
        )
        _add_connectors(element, connectors)
    parent = ElementTree.SubElement(system, _ssd("Connections"))
    for connection in connections:
        (start, output), (end, taken) = connection.start, connection.end
        names = ("startElement", "startConnector", "endElement", "endConnector")
        attributes = dict(zip(names, (start, output, end, taken), strict=True))
        ElementTree.SubElement(parent, _ssd("Connection"), attributes)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.encode("utf-8") + b"\n"


def _add_connectors(parent: ElementTree.Element, connectors_of: Mapping[str, _Connector]) -> None:
    connectors = ElementTree.SubElement(parent, _ssd("Connectors"))
    for name, found in connectors_of.items():
        attributes = {"name": name, "kind": found.kind}
        connector = ElementTree.SubElement(connectors, _ssd("Connector"), attributes)
        ElementTree.SubElement(connector, f"{{{COMMON}}}{found.type}")


def _ssd(tag: str) -> str:
    return f"{{{DESCRIPTION}}}{tag}"
