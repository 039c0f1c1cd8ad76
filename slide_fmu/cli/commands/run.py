"""``slide-fmu run``: the whole way from a recipe to an FMU with its measured error."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.cli.console import console, progress_bars, show_validation, write_json
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
