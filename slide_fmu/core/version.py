"""Files name the version of slide-fmu that wrote them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import import_module

WRITTEN_BY = "written_by"
"""Key of a provenance: the version that wrote the documents and the files of apps. It is another
than the version of the training where a released FMU was built again."""

A_VERSION = re.compile(r"[\w.+-]{1,40}")


def own_version() -> str:
    """Return this version; a plain import of the root would count as one of all rooms."""
    return str(import_module("slide_fmu").__version__)


def other_writer(provenance: Mapping[str, object] | None) -> str | None:
    """Return the version that wrote the documents of an FMU, if it is another than this one.

    None also if the provenance names no version, so that nothing is left out for that.
    """
    writer = (provenance or {}).get(WRITTEN_BY)
    if not isinstance(writer, str) or not A_VERSION.fullmatch(writer):
        return None
    return None if writer == own_version() else writer
