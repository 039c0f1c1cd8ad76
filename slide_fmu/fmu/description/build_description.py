"""A source FMU of FMI 3.0 has a ``sources/buildDescription.xml`` (FMI 3.0.2, section 2.5.1)."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from slide_fmu.fmu.description.fmi2 import document

MACROS = {
    "SLIDE_INSTANCES": ("1", "how many instances there may be at a time"),
    "SLIDE_SAVED_STATES": ("1", "how many states of instances may be saved at a time; may be 0"),
    "SLIDE_STEPS_PER_SAMPLE": (
        "32",
        "how many communication steps are distinguished in a sample step: 32, 16, 8, 4 or 2",
    ),
}
"""Macros that users may define when they compile scalar sources: default value and meaning."""


def build_description(name: str, files: Sequence[str], scalar: bool) -> bytes:
    """Write the XML document; the same arguments give the same bytes.

    Args:
        name: the model identifier.
        files: the files to compile, in the folder ``sources``.
        scalar: whether the sources are scalar, so that their memory is chosen at compile time.
    """
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=name)
    language = {"language": "C99"}
    if not scalar:
        language["compiler"] = "gcc"  # or clang, which takes the same vector types
    sources = ElementTree.SubElement(configuration, "SourceFileSet", language)
    for file in files:
        ElementTree.SubElement(sources, "SourceFile", name=file)
    for macro, (usual, meaning) in MACROS.items() if scalar else ():
        attributes = {"name": macro, "optional": "true", "value": usual, "description": meaning}
        ElementTree.SubElement(sources, "PreprocessorDefinition", attributes)
    return document(root)
