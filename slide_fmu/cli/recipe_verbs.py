"""Verbs from a recipe to a trained surrogate, and all of them in one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from slide_fmu.cli.app import app
from slide_fmu.cli.console import console, errors, progress_bars, write_json
from slide_fmu.cli.options import (
    UNSEEN_SEED,
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
from slide_fmu.cli.tables import show_validation


@app.command()
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
    """Everything: window, data, training, FMU, validation, report."""
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.preparation import check_window, generate_data
    from slide_fmu.pipeline.release import finish
    from slide_fmu.pipeline.training import train_surrogate

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, seed, data_seed)
        sizing = check_window(job)
        generate_data(job, workers, overwrite)
        train_surrogate(job, threads)
        fmu, page = finish(job, sizing, UNSEEN_SEED, trajectories)
    figures = json.loads((page.parent / "report.json").read_text(encoding="utf-8"))
    for name, validation in figures["validation"].items():
        show_validation(validation, name)
    write_json(json_path, figures)
    console.print(f"FMU     {fmu}\nreport  {page}")


@app.command()
def window(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the motions.")] = None,
    runs: RunsOption = Path("runs"),
) -> None:
    """Decay times of the system, linearized and measured, and the window they ask for."""
    from slide_fmu.memory.sizing import decay_rows, require_window
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.preparation import size_recipe

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar)
        sizing = size_recipe(job, seed)
    figures = sizing.figures()
    headings, *rows = decay_rows(figures)
    table = Table(*headings)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    if sizing.remark is not None:
        console.print(f"remark: {sizing.remark}", style="yellow")
    write_json(json_path, figures)
    with errors():
        require_window(job.recipe, sizing)


@app.command()
def generate(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the data.")] = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Make the recipe's trajectories; goes on where it was stopped."""
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.preparation import check_window, generate_data

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, data_seed=seed)
        check_window(job)
        figures = generate_data(job, workers, overwrite)
        write_json(json_path, figures)
    console.print(f"data    {job.folder.store}")


@app.command()
def train(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    runs: RunsOption = Path("runs"),
    threads: ThreadsOption = 1,
) -> None:
    """Train surrogate and error estimator; goes on where it was stopped."""
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.preparation import check_window
    from slide_fmu.pipeline.training import train_surrogate

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, seed, data_seed)
        check_window(job)
        figures = train_surrogate(job, threads)
        write_json(json_path, figures)
    console.print(f"surrogate  {job.folder.surrogate}")
