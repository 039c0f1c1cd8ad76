"""The resource metadata (SRMD 1.0.0) of an FMU states its validity as keywords with values."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from slide_fmu.apps.credentials.members import CLASSIFICATION, METADATA, link
from slide_fmu.fmu.description.fmi2 import document
from slide_fmu.fmu.export import SURROGATE

VERSION = "1.0.0"
NAMESPACE = "http://ssp-standard.org/SSPTraceability1/SimulationResourceMetaData"
COMMON = "http://ssp-standard.org/SSPTraceability1/SSPTraceabilityCommon"
OWN = "urn:slide-fmu:credentials"
"""The namespace of tables in entries."""

PREFIXES = {"srmd": NAMESPACE, "stc": COMMON, "slide": OWN}

Row = Mapping[str, object]
"""A row of a table: attributes by name; attributes that are None are omitted."""


@dataclass(frozen=True, eq=False)
class Entry:
    """An Entry is a keyword with its value.

    Attributes:
        keyword: the keyword, such as ``validity.inputs``.
        value: a sentence, or a list of several; or a table.
    """

    keyword: str
    value: Sequence[str] | ElementTree.Element

    @property
    def type(self) -> str:
        """The MIME type of the value."""
        if isinstance(self.value, ElementTree.Element):
            return "application/xml"
        return "text/plain" if len(self.value) == 1 else "text/markdown"


def table(name: str, row_name: str, rows: Iterable[Row], **attributes: object) -> Entry:
    """Return an entry whose value is a table, of elements with attributes.

    Args:
        name: keyword of the entry; its last part is the name of the table.
        row_name: name of the elements that are rows.
        rows: attributes of each row.
        attributes: attributes of the table itself.
    """
    element = ElementTree.Element(_qualified(name.rpartition(".")[2]), _texts(attributes))
    for row in rows:
        ElementTree.SubElement(element, _qualified(row_name), _texts(row))
    return Entry(name, element)


def joined(keyword: str, tables: Iterable[Entry]) -> Entry:
    """Return an entry whose value has the tables of others."""
    element = ElementTree.Element(_qualified(keyword.rpartition(".")[2]))
    for entry in tables:
        assert isinstance(entry.value, ElementTree.Element)
        element.append(entry.value)
    return Entry(keyword, element)


def resource_metadata(
    name: str, description: str, entries: Sequence[Entry], payload: bytes
) -> bytes:
    """Write the XML document; the same arguments give the same bytes.

    It has no date, since a date would change whenever the FMU is written again. The checksum is
    from the surrogate file, which determines all outputs, so that credentials of another surrogate
    are detected.

    Args:
        name: name of the FMU.
        description: one line for people.
        entries: the entries.
        payload: bytes of the surrogate file.
    """
    for prefix, namespace in PREFIXES.items():
        ElementTree.register_namespace(prefix, namespace)
    attributes = {
        "version": VERSION,
        "name": name,
        "description": description,
        "generationTool": "slide-fmu",
        "data": link(SURROGATE, METADATA),
        "checksum": checksum(payload),
        "checksumType": "SHA3-256",
    }
    root = ElementTree.Element(f"{{{NAMESPACE}}}SimulationResourceMetaData", attributes)
    parent = ElementTree.SubElement(root, f"{{{COMMON}}}Classification", type=CLASSIFICATION)
    for entry in entries:
        parent.append(_element(entry))
    return document(root)


def checksum(content: bytes) -> str:
    """Return the SHA3-256 hash, the only one that SRMD allows."""
    return hashlib.sha3_256(content).hexdigest()


def _element(entry: Entry) -> ElementTree.Element:
    attributes = {"keyword": entry.keyword, "type": entry.type}
    element = ElementTree.Element(f"{{{COMMON}}}ClassificationEntry", attributes)
    if isinstance(entry.value, ElementTree.Element):
        element.append(entry.value)
    elif len(entry.value) == 1:
        element.text = entry.value[0]
    else:
        element.text = "\n".join(["", *(f"- {sentence}" for sentence in entry.value), ""])
    return element


def _qualified(name: str) -> str:
    return f"{{{OWN}}}{name}"


def _texts(values: Row) -> dict[str, str]:
    """Return attributes as texts; numbers have all their digits."""
    return {name: _text(value) for name, value in values.items() if value is not None}


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, int | float) else str(value)
