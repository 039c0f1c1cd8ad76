"""The application, and the one list of its subcommands."""

from __future__ import annotations

import sys
from collections.abc import Callable

import typer

from slide_fmu.cli.commands.bench import bench
from slide_fmu.cli.commands.check import check
from slide_fmu.cli.commands.export import export
from slide_fmu.cli.commands.generate import generate
from slide_fmu.cli.commands.info import info
from slide_fmu.cli.commands.reference import reference
from slide_fmu.cli.commands.run import run
from slide_fmu.cli.commands.ssp import ssp
from slide_fmu.cli.commands.train import train
from slide_fmu.cli.commands.validate import validate
from slide_fmu.cli.commands.window import window
from slide_fmu.cli.console import ENDLESS

SUBCOMMANDS: tuple[Callable[..., None], ...] = (
    run,
    window,
    generate,
    train,
    export,
    reference,
    ssp,
    validate,
    check,
    bench,
    info,
)
"""All subcommands, in the order in which the help lists them."""

app = typer.Typer(
    name="slide-fmu",
    help="Fast, trustworthy stand-ins for slow multibody models, as FMUs that load anywhere.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)
for subcommand in SUBCOMMANDS:
    app.command(short_help=subcommand.__doc__)(subcommand)  # a short help is never cut


def main() -> None:
    """Run the console script; its help is wrapped on a terminal only."""
    app(terminal_width=None if sys.stdout.isatty() else ENDLESS)
