"""The subcommand chooses motions with an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, show_remark, show_table, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption
from slide_fmu.core.figures import plain


def motion(
    fmu: FmuArgument,
    task: Annotated[Path, typer.Argument(help="The task, a TOML file (docs/motion.md).")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for set_points.csv, report.html and report.json. Default: "
            "runs/NAME/motion.",
        ),
    ] = None,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Also simulate the reference model. Earliest and quietest moves are then planned "
            "again with its answers, until they are within the tolerance. Other tasks are "
            "compared. This imports the module that the FMU names.",
        ),
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            help="Time in s between the rows of set_points.csv, which then has position, speed "
            "and acceleration of each coordinate, for motion controllers. Default: inputs at the "
            "step of the FMU.",
        ),
    ] = None,
    calibrate: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Number of random moves like that of the task, at least 19, which are optimised "
            "and simulated with the reference model. Prints the factor by which the margin "
            "covers the error of 95 % of such moves. No set points are written.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of candidates and random moves.")] = 0,
    json_path: JsonOption = None,
) -> None:
    """Choose a fast motion with little vibration, or correct the set points of a path."""
    from slide_fmu.apps.motion.motion_report import motion_report, move_tables, remark_on_moves
    from slide_fmu.apps.motion.path_correction import correct, write_corrected
    from slide_fmu.apps.motion.path_report import path_report, path_table, remark_on_path
    from slide_fmu.apps.motion.solve import solve, write_set_points
    from slide_fmu.apps.motion.task import PathTask, read_task

    if calibrate is not None:
        _calibrate(fmu, task, calibrate, seed, json_path)
        return
    with progress_bars() as bar:
        wanted = read_task(task)
        if isinstance(wanted, PathTask):
            corrected = correct(fmu, wanted, verify, bar)
            report, tables = path_report(corrected), [path_table(corrected)]
            surrogate, remarks = corrected.surrogate, [remark_on_path(corrected)]
        else:
            solved = solve(fmu, wanted, seed, verify, bar)
            report, tables, surrogate = (
                motion_report(solved),
                move_tables(solved),
                solved.surrogate,
            )
            remarks = [remark_on_moves(solved)]
        folder = output or Path("runs") / surrogate.name / "motion"
        folder.mkdir(parents=True, exist_ok=True)
        place = folder / "set_points.csv"
        if isinstance(wanted, PathTask):
            remarks.append(write_corrected(corrected, place, rate))
        else:
            remarks.append(write_set_points(solved, place, rate))
        page = report.write(folder)
    write_json(json_path, {**plain(report.figures), "seed": seed})
    for table in tables:
        show_table(table)
    for remark in remarks:
        show_remark(remark)
    console.print(f"set points  {place}")
    console.print(f"report      {page}")


def _calibrate(fmu: Path, task: Path, moves: int, seed: int, json_path: str | None) -> None:
    """Print the factor on margins for moves like that of a task."""
    from slide_fmu.apps.motion.calibration import advice, calibrate
    from slide_fmu.apps.motion.predictor import MotionError
    from slide_fmu.apps.motion.task import PathTask, read_task

    with progress_bars() as bar:
        wanted = read_task(task)
        if isinstance(wanted, PathTask):
            raise MotionError(
                f"{task}: a path to correct; expected a move for --calibrate: give start and goal"
            )
        calibrated = calibrate(fmu, wanted, moves, seed, bar)
    write_json(json_path, calibrated)
    for sentence in advice(calibrated):
        console.print(sentence)
