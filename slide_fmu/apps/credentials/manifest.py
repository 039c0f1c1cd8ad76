"""The manifest lists related files (FMI-LS-REF 1.0.0-alpha.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from slide_fmu.apps.credentials.members import MANIFEST, link, member
from slide_fmu.apps.credentials.schema import parsed
from slide_fmu.fmu.description.fmi2 import document

NAME = "org.fmi-standard.fmi-ls-ref"
VERSION = "1.0.0-alpha.1"
DESCRIPTION = "Layered Standard providing information on related files included in an FMU."
"""The specification prescribes this text."""

NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"


@dataclass(frozen=True)
class RelatedFile:
    """A RelatedFile is a related file of an FMU.

    Attributes:
        member: its name in the FMU.
        type: its MIME type.
        role: its role, from the specification.
        description: one line for people.
    """

    member: str
    type: str
    role: str
    description: str


def write_manifest(files: Sequence[RelatedFile]) -> bytes:
    """Write the manifest; it has no checksums, since others may change the files."""
    ElementTree.register_namespace("fmi-ls", NAMESPACE)
    own = {"fmi-ls-name": NAME, "fmi-ls-version": VERSION, "fmi-ls-description": DESCRIPTION}
    attributes = {f"{{{NAMESPACE}}}{key}": value for key, value in own.items()}
    root = ElementTree.Element("fmiReferences", attributes)
    for file in files:
        attributes = {
            "type": file.type,
            "source": link(file.member, MANIFEST),
            "role": file.role,
            "description": file.description,
        }
        ElementTree.SubElement(root, "Related", attributes)
    return document(root)


def read_manifest(content: bytes) -> list[RelatedFile]:
    """Read the manifest of an FMU, and return its files that lie in the FMU.

    Raises:
        CredentialError: it is not a manifest.
    """
    root = parsed(content, MANIFEST, "references")
    return [
        RelatedFile(
            member(element.get("source"), MANIFEST),
            element.get("type", "application/octet-stream"),
            element.get("role"),
            element.get("description", ""),
        )
        for element in root.iterfind("Related")
        if is_relative(element.get("source"))
    ]


def is_relative(address: str) -> bool:
    """Return whether an address belongs to a file in the FMU: it has neither scheme nor root."""
    return ":" not in address.split("/")[0] and not address.startswith("/")
