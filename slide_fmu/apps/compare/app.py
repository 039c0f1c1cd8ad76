"""This app adds the subcommand that compares models of other kinds."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

APP = App(subcommands={"compare": "slide_fmu.apps.compare.command"})
