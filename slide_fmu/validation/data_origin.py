"""An FMU names the files of its data, so that it is measured on the same files."""

from __future__ import annotations

from slide_fmu.data.answers import asked_of_sources
from slide_fmu.fmu.export import Provenance
from slide_fmu.systems.base import System


@asked_of_sources
def origin_of_data(system: System) -> Provenance:
    """Return the part of a provenance that names files of data; empty for a system."""
    return {}


@asked_of_sources
def require_same_origin(system: System, provenance: Provenance, fmu: str) -> None:
    """Refuse files of data that have changed since an FMU was learnt from them.

    Raises:
        StageError: a file has changed, or the FMU does not name its files.
    """
