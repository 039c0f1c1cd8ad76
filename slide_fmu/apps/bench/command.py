"""The subcommand measures the speed of an FMU."""

from __future__ import annotations

from typing import Annotated

import typer

from slide_fmu.apps.bench.effort import Effort
from slide_fmu.cli.console import errors, show_json
from slide_fmu.cli.options import FmuArgument, JsonOption


def bench(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    rounds: Annotated[
        int, typer.Option(min=1, help="Let all take this many turns.")
    ] = Effort.rounds,
    steps: Annotated[
        int, typer.Option(min=1, help="Take this many steps in each turn.")
    ] = Effort.steps,
) -> None:
    """Measure how long an FMU takes for a step, and for many windows at once."""
    from slide_fmu.apps.bench.bench import bench_fmu

    with errors():
        show_json(json_path, bench_fmu(fmu, Effort(rounds, steps)))
