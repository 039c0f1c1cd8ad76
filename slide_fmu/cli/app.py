"""The application that verbs register with."""

import typer

app = typer.Typer(
    name="slide-fmu",
    help="Fast, trustworthy stand-ins for slow multibody models, as FMUs that load anywhere.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)
