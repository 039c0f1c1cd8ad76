"""A surrogate as FMU of a form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slide_fmu.fmu.export import export_fmu, read_fmu, read_member
from slide_fmu.fmu.platforms import FmiVersion
from slide_fmu.surrogate import Surrogate
from slide_fmu.weights import rounding_loss, with_weights


@dataclass(frozen=True)
class Form:
    """Which FMU of a surrogate is written.

    Attributes:
        fmi: version of the standard.
        sources: with C sources.
        weights: precision of the weights of layers (``with_weights``); as they are if None.
    """

    fmi: FmiVersion = 2
    sources: bool = False
    weights: str | None = None


def export_again(source: Path, path: Path, form: Form) -> tuple[Path, dict[str, Any] | None]:
    """Write the surrogate of an FMU as FMU of either standard, with this version's runtime.

    Args:
        source: FMU of slide-fmu.
        path: the FMU to write.
        form: which FMU is written.

    Returns:
        The path, and what rounding to float16 changes (``rounding_loss``); None without.

    Raises:
        FmuError: the source is no FMU of slide-fmu.
        ValueError: no such precision.
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
) -> tuple[Path, dict[str, Any] | None]:
    """Write a surrogate as FMU of a form; what rounding changes."""
    stored = surrogate if form.weights is None else with_weights(surrogate, form.weights)
    export_fmu(
        stored,
        path,
        fmi=form.fmi,
        provenance=provenance,
        documentation=documentation,
        sources=form.sources,
    )
    return path, rounding_loss(surrogate, stored) if form.weights == "float16" else None
