"""This app adds coupled runs of several FMUs: a subcommand, and the same from Python."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

APP = App(
    subcommands={"couple": "slide_fmu.apps.couple.command"},
    public={
        "couple": "slide_fmu.apps.couple.couple",
        "write_ssp": "slide_fmu.apps.couple.ssp",
        "CoupledRun": "slide_fmu.apps.couple.result",
        "StoppedRunError": "slide_fmu.apps.couple.result",
    },
)
