"""Descriptions of FMUs that were measured, or not."""

from __future__ import annotations

import json
from typing import Any

from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.surrogate.surrogate import Surrogate


def described(
    surrogate: Surrogate,
    measured: RunFigures | None = None,
    description: str = "An oscillator",
    **origin: Any,
) -> FmuDescription:
    """Describe the FMU of a surrogate, whose recipe has nothing but a description."""
    provenance = {"recipe": f"description = {json.dumps(description)}", **origin}
    if measured is not None:
        provenance["measured"] = measured.dump()
    return FmuDescription.of(surrogate, provenance)
