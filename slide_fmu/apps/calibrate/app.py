"""This app adds calibration: a subcommand, and the same from Python."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

APP = App(
    subcommands={"calibrate": "slide_fmu.apps.calibrate.command"},
    public={
        "calibrate": "slide_fmu.apps.calibrate.calibrate",
        "Calibration": "slide_fmu.apps.calibrate.result",
    },
)
