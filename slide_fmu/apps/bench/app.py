"""The benchmark adds its subcommand."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

APP = App(subcommands={"bench": "slide_fmu.apps.bench.command"})
