"""``slide-fmu generate``: the trajectories of a recipe."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, write_json
from slide_fmu.cli.options import (
    JsonOption,
    OverwriteOption,
    RecipeArgument,
    RunsOption,
    WorkersOption,
)


def generate(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the data.")] = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Make the trajectories of a recipe; go on where that was stopped."""
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.stages import check_window, generate_data

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, data_seed=seed)
        check_window(job)
        figures = generate_data(job, workers, overwrite)
        write_json(json_path, figures)
    console.print(f"data    {job.folder.store}")
