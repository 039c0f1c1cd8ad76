"""``slide-fmu check``: what is wrong with an FMU."""

from __future__ import annotations

import typer

from slide_fmu.cli.console import console, errors, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption


def check(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """List the problems of an FMU; an empty list and exit code 0 when it is fine."""
    from slide_fmu.cosim.check import check_fmu

    with errors():
        problems = check_fmu(fmu)
        write_json(json_path, {"fmu": str(fmu), "problems": problems})
    for problem in problems:
        console.print(problem, style="red")
    if problems:
        raise typer.Exit(1)
    console.print(f"{fmu}: no problems")
