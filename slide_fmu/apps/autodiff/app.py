"""This app adds functions for Python: surrogates in other programs."""

from __future__ import annotations

from slide_fmu.pipeline.apps import App

HOME = "slide_fmu.apps.autodiff.functions"

APP = App(public={name: HOME for name in ("casadi_function", "device_surrogate", "torch_module")})
