"""The page that people touch, as part of reports; and the drawings that recipes name for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from slide_fmu.page.drawing import load_drawing
from slide_fmu.page.facts import names_of
from slide_fmu.page.page import page_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.report import Report

DRAWING = "drawing"
"""Where the provenance of an FMU has the description of its machine in motion."""


def with_drawing(
    provenance: Mapping[str, Any], recipe: Recipe, surrogate: Surrogate
) -> dict[str, Any]:
    """Return provenance with the drawing that the recipe names, and without one if it names none.

    Raises:
        DrawingError: the drawing is not usable.
        LoadError: its module cannot be imported.
    """
    rest = {key: value for key, value in provenance.items() if key != DRAWING}
    name = recipe.system.drawing
    return rest if name is None else {**rest, DRAWING: load_drawing(name, names_of(surrogate))}


def touched(report: Report, fmu: Path) -> Report:
    """Return a report whose last section is the page of an FMU.

    Errors are those of ``slide_fmu.page.page.write_page``. The copy of a report inside an FMU has
    no such section: it would hold the surrogate and a runtime once more.
    """
    return replace(report, inside=page_of(fmu))
