"""``slide-fmu bench``: how long an FMU takes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import errors, show_json
from slide_fmu.cli.options import JsonOption
from slide_fmu.cosim.synthetic import SYNTHETIC, Effort


def bench(
    fmu: Annotated[
        Path | None, typer.Argument(help="FMU made by slide-fmu; or give --synthetic.")
    ] = None,
    synthetic: Annotated[
        str | None,
        typer.Option(help=f"A network with random weights instead: {', '.join(SYNTHETIC)}."),
    ] = None,
    json_path: JsonOption = None,
    rounds: Annotated[int, typer.Option(min=1, help="Rounds; all take turns.")] = Effort.rounds,
    steps: Annotated[int, typer.Option(min=1, help="Steps of each in a round.")] = Effort.steps,
) -> None:
    """Time an FMU: doStep, set-doStep-get, and batches of windows, in one run."""
    from slide_fmu.cosim.bench import bench_fmu, bench_synthetic

    with errors():
        effort = Effort(rounds, steps)
        if (fmu is None) == (synthetic is None):
            raise ValueError("bench: give either an FMU or --synthetic NAME")
        figures = (
            bench_fmu(fmu, effort) if fmu is not None else bench_synthetic(str(synthetic), effort)
        )
        show_json(json_path, figures)
