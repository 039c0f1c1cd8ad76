"""The subcommand chooses motions with an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, show_remark, write_json
from slide_fmu.cli.findings import show_table
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
            help="Also simulate the reference model, to compare. This imports the module"
            " that the FMU names.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the candidates.")] = 0,
    json_path: JsonOption = None,
) -> None:
    """Choose a fast motion with little vibration, or correct the set points of a path."""
    from slide_fmu.apps.motion.motion_report import motion_report, move_tables, remark_on_moves
    from slide_fmu.apps.motion.path_correction import correct, write_corrected
    from slide_fmu.apps.motion.path_report import path_report, path_table
    from slide_fmu.apps.motion.solve import solve, write_set_points
    from slide_fmu.apps.motion.task import PathTask, read_task

    with progress_bars() as bar:
        wanted = read_task(task)
        if isinstance(wanted, PathTask):
            corrected = correct(fmu, wanted, verify, bar)
            report, tables = path_report(corrected), [path_table(corrected)]
            surrogate = corrected.surrogate
        else:
            solved = solve(fmu, wanted, seed, verify, bar)
            report, tables, surrogate = (
                motion_report(solved),
                move_tables(solved),
                solved.surrogate,
            )
        folder = output or Path("runs") / surrogate.name / "motion"
        folder.mkdir(parents=True, exist_ok=True)
        place = folder / "set_points.csv"
        if isinstance(wanted, PathTask):
            write_corrected(corrected, place)
        else:
            write_set_points(solved, place)
        page = report.write(folder)
    write_json(json_path, {**plain(report.figures), "seed": seed})
    for table in tables:
        show_table(table)
    if not isinstance(wanted, PathTask):
        show_remark(remark_on_moves(solved))
    console.print(f"set points  {place}")
    console.print(f"report      {page}")
