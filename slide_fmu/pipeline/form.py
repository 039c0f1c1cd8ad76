"""A surrogate as FMU of a form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slide_fmu.fmu.export import export_fmu, read_fmu, read_member
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.half_precision import is_rounded, rounding_loss, with_weights
from slide_fmu.surrogate.surrogate import Surrogate

WIDENED = (
    "its weights were rounded to float16 before and stay rounded: as float32 the FMU is larger, "
    "not more accurate"
)
"""What is said about weights that take more room than they have digits for."""


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


@dataclass(frozen=True)
class Written:
    """An FMU that was written.

    Attributes:
        path: of the FMU.
        rounding: what rounding to float16 changes (``rounding_loss``); None without.
        remark: what the user should know about it, if there is anything.
    """

    path: Path
    rounding: dict[str, Any] | None = None
    remark: str | None = None


def export_again(source: Path, path: Path, form: Form) -> Written:
    """Write the surrogate of an FMU as FMU of either standard, with this version's runtime.

    Args:
        source: FMU of slide-fmu.
        path: the FMU to write.
        form: which FMU is written.

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
) -> Written:
    """Write a surrogate as FMU of a form."""
    stored = surrogate if form.weights is None else with_weights(surrogate, form.weights)
    export_fmu(
        stored,
        path,
        fmi=form.fmi,
        provenance=provenance,
        documentation=documentation,
        sources=form.sources,
    )
    if form.weights == "float16":
        return Written(path, rounding_loss(surrogate, stored))
    widened = form.weights == "float32" and is_rounded(surrogate)
    return Written(path, remark=WIDENED if widened else None)
