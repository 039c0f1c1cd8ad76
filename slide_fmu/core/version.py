"""Files name the version of slide-fmu that wrote them."""

from __future__ import annotations

import re
from collections.abc import Mapping

__version__ = "0.7.0.dev0"

WRITTEN_BY = "written_by"
"""Key of a provenance: the version that wrote the documents and the files of apps. It is another
than the version of the training where a released FMU was built again."""

A_VERSION = re.compile(r"[\w.+-]{1,40}")


def other_writer(provenance: Mapping[str, object] | None) -> str | None:
    """Return the version that wrote the documents of an FMU, if it is another than this one.

    None also if the provenance names no version, so that nothing is left out for that.
    """
    writer = (provenance or {}).get(WRITTEN_BY)
    if not isinstance(writer, str) or not A_VERSION.fullmatch(writer):
        return None
    return None if writer == __version__ else writer
