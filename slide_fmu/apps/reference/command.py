"""The subcommands write a reference system as an FMU, alone or next to its surrogate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, errors, show_remark
from slide_fmu.cli.options import FmuArgument, RecipeArgument, numbers_of
from slide_fmu.validation.task import UNSEEN_SEED


def reference(
    recipe: RecipeArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Write the FMU to this file.")],
) -> None:
    """Write the model of a recipe itself as an FMU. It needs this Python to run."""
    from slide_fmu.apps.reference.side_by_side import write_reference
    from slide_fmu.core.search_path import make_importable
    from slide_fmu.recipe.case import case_of
    from slide_fmu.recipe.reading import load_open_recipe

    with errors():
        make_importable(recipe.parent, Path.cwd())
        path = write_reference(case_of(load_open_recipe(recipe).guess), output)
    console.print(f"FMU     {path}")


def ssp(
    fmu: FmuArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Write the SSP to this file.")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of the inputs.")] = UNSEEN_SEED,
    duration: Annotated[
        float | None,
        typer.Option(help="Duration of the inputs in s. Default: as in the recipe."),
    ] = None,
    parameters: Annotated[
        Path | None,
        typer.Option(metavar="PATH.ssv", help="SSV file with values of physical parameters."),
    ] = None,
    given: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Value of a physical parameter; repeat it for each one. Others have the"
            " value of the SSV file, or their start value.",
        ),
    ] = None,
) -> None:
    """Write an FMU, its model and unseen inputs as one SSP. This runs the code of the model."""
    from slide_fmu.apps.reference.side_by_side import write_side_by_side
    from slide_fmu.cosim.ssv import read_parameter_set, units_of

    with errors():
        values = {} if parameters is None else read_parameter_set(parameters)
        units = {} if parameters is None else units_of(parameters.read_bytes())
        values |= (own := numbers_of("set", given))
        units = {name: unit for name, unit in units.items() if name not in own}
        path, remark = write_side_by_side(fmu, output, seed, duration, values, units)
    show_remark(remark)
    console.print(f"SSP     {path}")
