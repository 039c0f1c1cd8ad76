"""This app adds the subcommands ``reference`` and ``ssp``: reference systems as FMUs."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

COMMANDS = "slide_fmu.apps.reference.command"

APP = App(subcommands={"reference": COMMANDS, "ssp": COMMANDS})
