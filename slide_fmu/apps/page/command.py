"""The subcommand writes the page of an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, errors
from slide_fmu.cli.options import FmuArgument

MOVES = "moves of a task"
"""Name of a service of another app: it takes an FMU and a task, and returns the moves as plain
values (``write_page``)."""


def page(
    fmu: FmuArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.html", help="Write the page here.")
    ],
    title: Annotated[
        str | None, typer.Option("--title", help="Head it with this text, not with the name.")
    ] = None,
    drawing: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:FUNCTION",
            help="Draw the machine in motion as this function describes it, not as the FMU does.",
        ),
    ] = None,
    motion: Annotated[
        Path | None,
        typer.Option(
            metavar="TASK.toml", help="Play the move chosen for this task next to a plain one."
        ),
    ] = None,
) -> None:
    """Write one HTML file in which users move the inputs of an FMU and see its outputs."""
    from slide_fmu.apps.page.page import write_page
    from slide_fmu.pipeline.apps import service

    with errors():
        moves = None
        if motion is not None:
            choose = service(MOVES)
            if choose is None:
                raise ValueError(
                    f"--motion {motion}: no installed app chooses moves; expected the app motion "
                    "of slide-fmu: install it, or leave the option out"
                )
            moves = choose(fmu, motion)
        path = write_page(fmu, output, title, drawing, moves)
    console.print(f"page    {path}")
