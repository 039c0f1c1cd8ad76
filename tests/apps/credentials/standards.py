"""The schemas that the standards publish, where packages carry them.

SRMD: those in ``pyssp-standard``, which are the XML Schema 1.1 files of SSP Traceability. Manifest
attributes and annotations: those of FMI 3.0 in ``fmpy``. No package carries the schemas of
FMI-LS-REF 1.0.0-alpha.1 and of its experiments: these are held against our own ones, which were
written from the specification.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import fmpy
import xmlschema

FMPY = Path(fmpy.__file__).parent / "schema" / "fmi3"


def srmd_schema() -> xmlschema.XMLSchema11:
    """The published schema of SRMD; nothing is read from the network."""
    specification = importlib.util.find_spec("pyssp_standard")
    assert specification is not None, "pip install pyssp-standard"
    assert specification.origin is not None
    resources = Path(specification.origin).parent / "resources"
    xlink = Path(xmlschema.__file__).parent / "schemas" / "XLINK" / "xlink.xsd"
    locations = {"http://www.w3.org/1999/xlink": str(xlink)}
    return xmlschema.XMLSchema11(str(resources / "SRMD11.xsd"), locations=locations, allow="local")


def layered_standard_schema() -> xmlschema.XMLSchema10:
    """The published schema of the attributes of all manifests of layered standards."""
    return xmlschema.XMLSchema10(str(FMPY / "fmi3LayeredStandardManifest.xsd"), allow="local")
