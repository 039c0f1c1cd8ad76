"""The subcommands on recipes: each reads its options and prints what came of it.

What a subcommand does is in ``pipeline``, or in the room of its name. It is imported when the
subcommand is called: who exports an FMU need not wait for what trains networks and draws figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from slide_fmu.cli.console import (
    console,
    errors,
    progress_bars,
    show_remark,
    show_validation,
    write_json,
)
from slide_fmu.cli.options import (
    DataSeedOption,
    JsonOption,
    OverwriteOption,
    RecipeArgument,
    RunsOption,
    ThreadsOption,
    TrainingSeedOption,
    TrajectoriesOption,
    WorkersOption,
)
from slide_fmu.pipeline.defaults import UNSEEN_SEED


def run(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    trajectories: TrajectoriesOption = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    threads: ThreadsOption = 1,
    overwrite: OverwriteOption = False,
) -> None:
    """Go the whole way: size the window, make data, train, write the FMU, measure, report."""
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.run import run_recipe

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, seed, data_seed)
        finished = run_recipe(job, UNSEEN_SEED, trajectories, workers, threads, overwrite)
    for name, validation in finished.figures["validation"].items():
        show_validation(validation, name)
    write_json(json_path, finished.figures)
    console.print(f"FMU     {finished.fmu}\nreport  {finished.page}")


def window(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Draw the motions with this seed.")
    ] = None,
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


def generate(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Draw the data with this seed.")] = None,
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


def train(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    runs: RunsOption = Path("runs"),
    threads: ThreadsOption = 1,
) -> None:
    """Train the surrogate of a recipe and its error estimator; go on where that was stopped."""
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.stages import check_window, train_surrogate

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, seed, data_seed)
        check_window(job)
        figures = train_surrogate(job, threads)
        write_json(json_path, figures)
    console.print(f"surrogate  {job.folder.surrogate}")


def reference(
    recipe: RecipeArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Write the FMU here.")],
) -> None:
    """Write the reference system of a recipe as FMU (it needs this Python environment)."""
    from slide_fmu.pipeline.job import make_importable
    from slide_fmu.pipeline.side_by_side import write_reference
    from slide_fmu.recipe.reading import load_recipe

    with errors():
        make_importable(recipe.parent)
        path = write_reference(load_recipe(recipe), output)
    console.print(f"FMU     {path}")
