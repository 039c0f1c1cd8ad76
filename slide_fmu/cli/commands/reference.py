"""``slide-fmu reference``: the reference system of a recipe, as FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, errors
from slide_fmu.cli.options import RecipeArgument


def reference(
    recipe: RecipeArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="FMU to write.")],
) -> None:
    """Write the reference system of a recipe as FMU (it needs this Python environment)."""
    from slide_fmu.pipeline.job import make_importable
    from slide_fmu.pipeline.side_by_side import write_reference
    from slide_fmu.recipe.reading import load_recipe

    with errors():
        make_importable(recipe.parent)
        path = write_reference(load_recipe(recipe), output)
    console.print(f"FMU     {path}")
