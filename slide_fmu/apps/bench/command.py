"""The subcommand measures the speed of an FMU."""

from __future__ import annotations

from typing import Annotated

import typer

from slide_fmu.apps.bench.effort import Effort
from slide_fmu.cli.console import errors, figures_console, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption


def bench(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    rounds: Annotated[
        int, typer.Option(min=1, help="Time everything in this number of rounds, in turns.")
    ] = Effort.rounds,
    steps: Annotated[
        int, typer.Option(min=1, help="Time this number of steps in each round.")
    ] = Effort.steps,
) -> None:
    """Measure how long an FMU takes for a step, and for many windows at once."""
    from slide_fmu.apps.bench.bench import bench_fmu
    from slide_fmu.apps.bench.bench_tables import conclusion, summary, tables
    from slide_fmu.report.console import print_table

    effort = Effort(rounds, steps)
    with errors():
        found = bench_fmu(fmu, effort)
    write_json(json_path, found)
    if json_path == "-":
        return
    out = figures_console()
    out.print(summary(found, effort))
    for table in tables(found):
        print_table(table, out)
    out.print(conclusion(found))
