"""``slide-fmu validate``: the error of an FMU, measured on unseen inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, show_validation, write_json
from slide_fmu.cli.options import UNSEEN_SEED, FmuArgument, JsonOption, TrajectoriesOption


def validate(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the trajectories.")] = UNSEEN_SEED,
    trajectories: TrajectoriesOption = None,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="Length in s; the recipe's if not given.")
    ] = None,
    amplitude: Annotated[
        tuple[float, float], typer.Option(help="Range of a factor on the excitation.")
    ] = (1.0, 1.0),
    report: Annotated[
        Path | None, typer.Option("--report", help="Folder for report.html and report.json.")
    ] = None,
) -> None:
    """Run an FMU beside its reference system on unseen inputs and measure the error."""
    from slide_fmu.pipeline.measurement import validate_fmu_file, validation_report
    from slide_fmu.validation.comparison import Task

    with progress_bars() as bar:
        if report is not None:
            report.mkdir(parents=True, exist_ok=True)
        task = Task(seed, trajectories, amplitude, duration)
        result = validate_fmu_file(fmu, task, bar)
        figures = result.figures()
        write_json(json_path, figures)
        folder = report or Path("runs") / result.surrogate.name / "validation"
        page = validation_report(result).write(folder)
    show_validation(figures, "validation")
    console.print(f"report  {page}")
