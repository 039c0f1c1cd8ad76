"""What comparisons with models of other kinds add: the subcommand."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

APP = App(subcommands={"compare": "slide_fmu.apps.compare.command"})
