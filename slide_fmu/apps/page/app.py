"""This app adds pages: a subcommand, the drawing that an FMU carries, and a section of reports."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slide_fmu.pipeline.apps import App

if TYPE_CHECKING:
    from slide_fmu.fmu.export import Provenance
    from slide_fmu.recipe.recipe import Recipe
    from slide_fmu.surrogate.surrogate import Surrogate

DRAWING = "drawing"
"""Key of the table ``[apps.page]``, and of the provenance, which has the description itself."""


def _check_table(table: Mapping[str, Any]) -> None:
    """Accept ``drawing = "module:function"`` or ``"file.py:function"`` and nothing else."""
    from slide_fmu.recipe.recipe import RecipeError

    for key, value in table.items():
        if key != DRAWING:
            raise RecipeError(f"[apps.page]: {key} is not a known key; expected {DRAWING}")
        module, colon, function = str(value).rpartition(":")
        if not (isinstance(value, str) and module and colon and function.isidentifier()):
            raise RecipeError(
                f'[apps.page]: {DRAWING} = {value!r}; expected "module:function" or '
                '"file.py:function", which describes the machine'
            )


def _origin(recipe: Recipe, surrogate: Surrogate) -> Provenance:
    """Return the drawing named in the recipe, which the FMU carries.

    Raises:
        DrawingError: the drawing is not usable.
        LoadError: its module cannot be imported.
    """
    from slide_fmu.apps.page.drawing import load_drawing
    from slide_fmu.apps.page.facts import names_of

    name = recipe.apps.get("page", {}).get(DRAWING)
    return {} if name is None else {DRAWING: load_drawing(name, names_of(surrogate)).plain()}


def _check_origin(surrogate: Surrogate, provenance: Provenance | None) -> None:
    from slide_fmu.apps.page.page import carried_drawing

    carried_drawing(surrogate, provenance)


def _section(fmu: Path) -> str:
    """Return the page of an FMU.

    The copy of a report inside an FMU has no such section: it would contain the surrogate and a
    runtime once more.
    """
    from slide_fmu.apps.page.page import page_of

    return page_of(fmu)


APP = App(
    subcommands={"page": "slide_fmu.apps.page.command"},
    check_table=_check_table,
    origin=_origin,
    origin_keys=(DRAWING,),
    check_origin=_check_origin,
    section=_section,
)
