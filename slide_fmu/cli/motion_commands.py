"""The subcommand that chooses motions with an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, table_of, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption


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
        typer.Option("--verify", help="Simulate the reference model beside the result."),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Draw the candidates with this seed.")] = 0,
    json_path: JsonOption = None,
) -> None:
    """Choose or shape a motion from rest to rest that excites the system little."""
    from slide_fmu.motion.task import read_task
    from slide_fmu.pipeline.motion import solve, write_set_points
    from slide_fmu.pipeline.motion_report import motion_report, move_rows

    with progress_bars() as bar:
        solved = solve(fmu, read_task(task), seed, verify, bar)
        folder = output or Path("runs") / solved.surrogate.name / "motion"
        folder.mkdir(parents=True, exist_ok=True)
        path = write_set_points(solved, folder / "set_points.csv")
        report = motion_report(solved)
        page = report.write(folder)
    write_json(json_path, {**report.data, "seed": seed})
    for title, rows in move_rows(solved).items():
        console.print(title)
        table = table_of(*rows[0])
        for row in rows[1:]:
            table.add_row(*row)
        console.print(table)
    console.print(f"set points  {path}")
    console.print(f"report      {page}")
