"""``slide-fmu ssp``: an FMU and its reference system, as a system of FMUs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, errors, show_remark
from slide_fmu.cli.options import UNSEEN_SEED, FmuArgument


def ssp(
    fmu: FmuArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="SSP to write.")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of the inputs.")] = UNSEEN_SEED,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="Of the inputs in s; the recipe's if not given.")
    ] = None,
) -> None:
    """Write an FMU and its reference system, driven by the same unseen inputs, as SSP."""
    from slide_fmu.pipeline.side_by_side import write_side_by_side

    with errors():
        path, remark = write_side_by_side(fmu, output, seed, duration)
    show_remark(remark)
    console.print(f"SSP     {path}")
