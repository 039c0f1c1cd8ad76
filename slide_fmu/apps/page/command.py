"""The subcommand writes the page of an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from slide_fmu.cli.console import console, errors


def page(
    *,
    fmu: Annotated[
        Path | None, typer.Argument(help="Take this FMU, made by slide-fmu.", show_default=False)
    ] = None,
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
    drop: Annotated[
        bool, typer.Option("--drop", help="Write a page on which users drop any FMU.")
    ] = False,
) -> None:
    """Write an interactive HTML page of an FMU, which runs in any browser."""
    from slide_fmu.apps.page.page import write_drop_page, write_page

    with errors():
        if drop != (fmu is None) or (drop and (drawing or motion)):
            raise ValueError(
                f"FMU {str(fmu)!r} with{'' if drop else 'out'} --drop; expected one FMU, or "
                "--drop without an FMU, --drawing and --motion: leave one out"
            )
        if fmu is None:
            path = write_drop_page(output, title)
        else:
            moves = None if motion is None else _moves_of(fmu, motion)
            path = write_page(fmu, output, title, drawing, moves)
    console.print(f"page    {path}")


def _moves_of(fmu: Path, motion: Path) -> Any:
    """Return the moves of a task in plain values, from the app that chooses moves."""
    from slide_fmu.pipeline.apps import moves_of_task

    moves = moves_of_task(fmu, motion)
    if moves is None:
        raise ValueError(
            f"--motion {motion}: no installed app chooses moves; expected the app motion of "
            "slide-fmu: install it, or leave the option out"
        )
    return moves
