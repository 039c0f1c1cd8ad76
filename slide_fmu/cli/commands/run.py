"""``slide-fmu run``: the whole way from a recipe to an FMU with its measured error."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.cli.console import console, progress_bars, write_json
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
    from slide_fmu.pipeline.run import Choices, run_recipe

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, seed, data_seed)
        choices = Choices(UNSEEN_SEED, trajectories, workers, threads, overwrite)
        finished = run_recipe(job, choices)
    for name, validation in finished.figures["validation"].items():
        show_validation(validation, name)
    write_json(json_path, finished.figures)
    console.print(f"FMU     {finished.fmu}\nreport  {finished.page}")
