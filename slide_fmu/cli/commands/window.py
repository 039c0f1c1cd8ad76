"""``slide-fmu window``: how long the window of a recipe must be."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from slide_fmu.cli.console import console, errors, progress_bars, show_remark, write_json
from slide_fmu.cli.options import JsonOption, RecipeArgument, RunsOption


def window(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the motions.")] = None,
    runs: RunsOption = Path("runs"),
) -> None:
    """Compute decay times of a system, linearized and measured, and the window they ask for."""
    from slide_fmu.memory.sizing import decay_rows, require_window
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.stages import size_recipe

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar)
        sizing = size_recipe(job, seed)
    figures = sizing.figures()
    headings, *rows = decay_rows(figures)
    table = Table(*headings)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    show_remark(sizing.remark)
    write_json(json_path, figures)
    with errors():
        require_window(job.recipe, sizing)
