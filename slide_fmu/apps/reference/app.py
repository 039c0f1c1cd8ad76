"""Reference systems as FMUs add the subcommands ``reference`` and ``ssp``."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

COMMANDS = "slide_fmu.apps.reference.command"

APP = App(subcommands={"reference": COMMANDS, "ssp": COMMANDS})
