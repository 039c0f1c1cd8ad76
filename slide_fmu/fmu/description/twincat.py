"""The ``CustomFMU.xml`` of scalar sources: how TwinCAT's TE1420 Target for FMI builds them.

The file has the elements of the template that Beckhoff publishes for further tools (Infosys,
TE1420, "Integration of additional tools"): the tool's name as ``modelDescription.xml`` has it,
folders of headers, macros, files that are left out, and replacements in files, of which the
sources need none.
"""

from __future__ import annotations

from xml.etree import ElementTree

from slide_fmu.fmu.description.fmi2 import TOOL, document

SCHEMA = "http://www.w3.org/2001/XMLSchema-instance"


def twincat_description() -> bytes:
    """Write the XML document; it is the same for all FMUs of slide-fmu."""
    ElementTree.register_namespace("xsi", SCHEMA)
    location = {f"{{{SCHEMA}}}noNamespaceSchemaLocation": "CustomFmu.xsd"}
    root = ElementTree.Element("CustomConfigurations", location)
    configuration = ElementTree.SubElement(root, "FmuConfiguration")
    values = {
        "ToolName": TOOL,
        "AdditionalInclude": "$(ProjectDir);$(ProjectDir)sources;",
        "PreprocessorDefinitions": "",
        "ExcludedFromBuild": "",
    }
    for name, text in values.items():
        ElementTree.SubElement(configuration, name).text = text
    return document(root)
