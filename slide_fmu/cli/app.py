"""The application, and the one list of its subcommands."""

from __future__ import annotations

import sys
from collections.abc import Callable

import typer

from slide_fmu.cli.calibration_commands import calibrate
from slide_fmu.cli.comparison_commands import compare
from slide_fmu.cli.fmu_commands import bench, check, export, info, page, ssp, validate
from slide_fmu.cli.motion_commands import motion
from slide_fmu.cli.recipe_commands import cost, generate, init, reference, run, train, try_, window
from slide_fmu.pipeline.display import ENDLESS

SUBCOMMANDS: tuple[Callable[..., None], ...] = (
    init,
    try_,
    run,
    window,
    generate,
    cost,
    train,
    compare,
    export,
    reference,
    ssp,
    validate,
    page,
    check,
    bench,
    calibrate,
    motion,
    info,
)
"""All subcommands, in the order in which the help lists them."""

app = typer.Typer(
    name="slide-fmu",
    help="Make fast, trustworthy stand-ins for slow multibody models: FMUs that load anywhere.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)
for subcommand in SUBCOMMANDS:
    # a short help is never cut; a word of Python's own has a mark behind it
    name = subcommand.__name__.rstrip("_")
    app.command(name, short_help=subcommand.__doc__)(subcommand)


def main() -> None:
    """Run the console script; its help is wrapped on a terminal only."""
    app(terminal_width=None if sys.stdout.isatty() else ENDLESS)
