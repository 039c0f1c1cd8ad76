"""A surrogate as FMU of a form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from slide_fmu.fmu.export import export_fmu, read_fmu, read_member
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True)
class Form:
    """Which FMU of a surrogate is written.

    Attributes:
        fmi: version of the standard.
        sources: with C sources.
    """

    fmi: FmiVersion = 2
    sources: bool = False


def export_again(source: Path, path: Path, form: Form) -> Path:
    """Write the surrogate of an FMU as FMU of either standard, with this version's runtime.

    Args:
        source: FMU of slide-fmu.
        path: the FMU to write.
        form: which FMU is written.

    Raises:
        FmuError: the source is no FMU of slide-fmu.
    """
    surrogate, found = read_fmu(source)
    page = read_member(source, "documentation/index.html")
    documentation = {} if page is None else {"index.html": page}
    return write_form(surrogate, path, form, provenance=found, documentation=documentation)


def write_form(
    surrogate: Surrogate,
    path: Path,
    form: Form,
    *,
    provenance: dict[str, object] | None,
    documentation: Mapping[str, bytes] | None = None,
) -> Path:
    """Write a surrogate as FMU of a form."""
    return export_fmu(
        surrogate,
        path,
        fmi=form.fmi,
        provenance=provenance,
        documentation=documentation,
        sources=form.sources,
    )
