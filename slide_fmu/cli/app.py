"""The application has one list of its subcommands."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from slide_fmu.cli.console import (
    INTERRUPTED,
    KILLED,
    errors,
    interruptible,
    replace_unprintable,
)
from slide_fmu.cli.fmu_commands import check, export, info, simulate, validate
from slide_fmu.cli.recipe_commands import generate, init, run, train, try_, window
from slide_fmu.core.version import __version__
from slide_fmu.pipeline.apps import subcommands_of_apps
from slide_fmu.report.table import ENDLESS

SUBCOMMANDS: tuple[Callable[..., None], ...] = (
    init,
    try_,
    run,
    window,
    generate,
    train,
    export,
    validate,
    simulate,
    check,
    info,
)
"""The subcommands of the way, in the order of the help; subcommands of apps follow."""

NAME = "slide-fmu"
"""Name of the command, also where Python runs the package (``python -m slide_fmu``)."""

HELP = "Turn slow models into fast FMUs with a measured error."


class _Subcommands(TyperGroup):
    """The group reports an interrupt before a subcommand can, for example in its imports."""

    def make_context(self, *args: Any, **keys: Any) -> Any:
        with interruptible():
            return super().make_context(*args, **keys)

    def invoke(self, ctx: Any) -> Any:
        with interruptible():
            return super().invoke(ctx)


app = typer.Typer(
    name=NAME, cls=_Subcommands, help=HELP, no_args_is_help=True, rich_markup_mode=None
)


def name_of(subcommand: Callable[..., None]) -> str:
    """Return the name of a subcommand on the command line: that of its function, with hyphens.

    A function whose name would be a word of Python's own has a mark behind it.
    """
    return subcommand.__name__.rstrip("_").replace("_", "-")


_BY_NAME, LEFT_OUT = subcommands_of_apps([name_of(own) for own in SUBCOMMANDS])
"""One sentence on each app or subcommand that cannot be used."""

OF_APPS = tuple(_BY_NAME.values())
"""The subcommands of installed apps, which follow the others."""

for subcommand in (*SUBCOMMANDS, *OF_APPS):
    # a short help is never cut
    app.command(name_of(subcommand), short_help=subcommand.__doc__)(subcommand)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"{NAME} {__version__}")
        raise typer.Exit


@app.callback(help=HELP)
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and stop."
        ),
    ] = False,
) -> None:
    """Take the options before any subcommand; each acts by itself."""


def main() -> None:
    """Run the console script; its help is wrapped only on a terminal."""
    replace_unprintable()
    with _killed_as_interrupted():
        quick_completion()
        for reason in LEFT_OUT:
            typer.echo(f"remark: {reason}. Until then it is left out.", err=True)
        try:
            app(prog_name=NAME, terminal_width=None if sys.stdout.isatty() else ENDLESS)
        except ModuleNotFoundError:  # of what a subcommand imports first
            with errors():
                raise


@contextmanager
def _killed_as_interrupted() -> Iterator[None]:
    """Let kill end the program as Ctrl-C does, which removes temporary files; the code differs."""
    killed = False

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal killed
        killed = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, end)
    try:
        yield
    except SystemExit as ended:
        if killed and ended.code == INTERRUPTED:
            raise SystemExit(KILLED) from None
        raise


def quick_completion() -> None:
    """Let completions show help texts unchanged.

    The texts of this package have no markup. Typer would look for markup with the Markdown parser
    of rich, whose import takes as long as the rest of a completion. A version of typer without
    this function completes correctly, only more slowly.
    """
    with suppress(ImportError):
        from typer import _completion_classes

        _completion_classes._sanitize_help_text = _as_it_is


def _as_it_is(text: str) -> str:
    return text
