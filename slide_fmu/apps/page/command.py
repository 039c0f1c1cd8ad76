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
        Path,
        typer.Option("-o", "--output", metavar="FILE.html", help="Write the page to this file."),
    ],
    title: Annotated[
        str | None,
        typer.Option("--title", help="Title of the page. Default: the name of the FMU."),
    ] = None,
    drawing: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:FUNCTION",
            help="Function that describes how the machine is drawn. Default: the drawing"
            " in the FMU, if it has one.",
        ),
    ] = None,
    motion: Annotated[
        Path | None,
        typer.Option(
            metavar="TASK.toml",
            help="Play the move that is chosen for this task, next to a plain move.",
        ),
    ] = None,
) -> None:
    """Write an interactive HTML page of an FMU, which runs in any browser."""
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
