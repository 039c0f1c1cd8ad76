"""The ``CustomFMU.xml`` of scalar sources tells TwinCAT's TE1420 Target for FMI how to build them.

The file has the elements of Beckhoff's template for additional tools (Infosys, TE1420,
"Integration of additional tools"): the tool's name as in ``modelDescription.xml``, folders of
headers, macros, excluded files, and replacements in files, which these sources do not need.
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
