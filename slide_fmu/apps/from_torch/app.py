"""This app adds a function for Python that takes other networks."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

APP = App(public={"from_torch": "slide_fmu.apps.from_torch.from_torch"})
