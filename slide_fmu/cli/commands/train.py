"""``slide-fmu train``: the surrogate of a recipe and its error estimator."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.cli.console import console, progress_bars, write_json
from slide_fmu.cli.options import (
    DataSeedOption,
    JsonOption,
    RecipeArgument,
    RunsOption,
    ThreadsOption,
    TrainingSeedOption,
)


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
