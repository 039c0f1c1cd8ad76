"""The subcommand compares a recipe's network with models of other kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import (
    GOES_ON,
    console,
    errors,
    progress_bars,
    show_remark,
    show_table,
    write_json,
)
from slide_fmu.cli.options import (
    DataSeedOption,
    JsonOption,
    RecipeArgument,
    RunsOption,
    TrainingSeedOption,
    TrajectoriesOption,
    WorkersOption,
)
from slide_fmu.core.extras import require_training
from slide_fmu.core.readable import duration
from slide_fmu.validation.task import UNSEEN_SEED


def compare(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    budget: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Largest CPU time in s of each training. Default: what the training of "
            "the recipe's network took.",
        ),
    ] = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    trajectories: TrajectoriesOption = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
) -> None:
    """Compare the network of a recipe with other kinds of models: same data, same CPU time."""
    with errors():
        require_training()
    from slide_fmu.apps.compare.compare import Terms, compare_recipe
    from slide_fmu.apps.compare.sections import model_table
    from slide_fmu.pipeline.job import open_job

    with progress_bars(GOES_ON) as bar:
        terms = Terms(budget, UNSEEN_SEED, trajectories, workers)
        job = open_job(recipe, runs, bar, seed, data_seed, tell=console.print)
        figures, page = compare_recipe(job, terms)
    console.print(
        f"Errors are relative RMSE on {figures.trajectories} unseen trajectories (seed "
        f"{figures.seed}). Each training had at most {duration(figures.budget_s)} of CPU time."
    )
    show_table(model_table(figures))
    show_remark(figures.remark)
    write_json(json_path, figures)
    console.print(f"report  {page}")
