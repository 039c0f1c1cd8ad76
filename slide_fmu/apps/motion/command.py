"""The subcommand that chooses motions with an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, show_remark, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption
from slide_fmu.cli.tables import table_of


def motion(
    fmu: FmuArgument,
    task: Annotated[Path, typer.Argument(help="Take this task, a TOML file.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write set_points.csv, report.html and report.json here; runs/NAME/motion if "
            "not given.",
        ),
    ] = None,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Simulate the reference model beside the result. This imports the "
            "module that the FMU names.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Draw the candidates with this seed.")] = 0,
    json_path: JsonOption = None,
) -> None:
    """Choose set points that shake a machine little, or correct those of a path."""
    from slide_fmu.apps.motion.motion_report import motion_report, move_rows, remark_on_moves
    from slide_fmu.apps.motion.path_correction import correct, write_corrected
    from slide_fmu.apps.motion.path_report import path_report, path_rows
    from slide_fmu.apps.motion.solve import solve, write_set_points
    from slide_fmu.apps.motion.task import PathTask, read_task

    with progress_bars() as bar:
        wanted = read_task(task)
        if isinstance(wanted, PathTask):
            corrected = correct(fmu, wanted, verify, bar)
            report, tables = path_report(corrected), {"errors": path_rows(corrected)}
        else:
            solved = solve(fmu, wanted, seed, verify, bar)
            report, tables = motion_report(solved), move_rows(solved)
        folder = output or Path("runs") / str(report.data["fmu"]) / "motion"
        folder.mkdir(parents=True, exist_ok=True)
        place = folder / "set_points.csv"
        if isinstance(wanted, PathTask):
            write_corrected(corrected, place)
        else:
            write_set_points(solved, place)
        page = report.write(folder)
    write_json(json_path, {**report.data, "seed": seed})
    for title, rows in tables.items():
        console.print(title)
        table = table_of(*rows[0])
        for row in rows[1:]:
            table.add_row(*row)
        console.print(table)
    if not isinstance(wanted, PathTask):
        show_remark(remark_on_moves(solved))
    console.print(f"set points  {place}")
    console.print(f"report      {page}")
