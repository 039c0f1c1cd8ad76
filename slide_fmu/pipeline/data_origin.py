"""An FMU says what its data came from, as far as that can be another one when it is measured."""

from __future__ import annotations

from slide_fmu.fmu.export import Provenance
from slide_fmu.systems.answers import asked_of_sources
from slide_fmu.systems.base import System


@asked_of_sources
def origin_of_data(system: System) -> Provenance:
    """Return the part of a provenance that names files of data; a system has none."""
    return {}


@asked_of_sources
def require_same_origin(system: System, provenance: Provenance, fmu: str) -> None:
    """Refuse files of data that have changed since an FMU was learnt from them.

    Raises:
        StageError: a file is another one, or the FMU does not say which ones there were.
    """
