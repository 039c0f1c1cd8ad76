"""Rows and times that are made by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from slide_fmu.validation.error_figures import SolverSetting, SpeedFigures, Timing
from slide_fmu.validation.row import ALL, SMOOTH, Call, Row, RowOutput
from slide_fmu.validation.task import IN_RANGE

STEP = 0.02


def row(
    inputs: str = ALL,
    group: str = IN_RANGE,
    error: float = 0.01,
    *,
    steps: float = 1.0,
    call: Call = "plain",
    **more: Any,
) -> Row:
    """A row of one output; its bound covers 95 %, and nothing is harmful."""
    shares = {"trusted": 0.96, "harmful": 0.0, "silent": 0.0, **more}
    covered = shares.pop("covered", 0.95)
    output = RowOutput(
        name="position",
        unit="m",
        relative_rmse=error,
        rmse=2e-3 * error,
        largest_error=0.01 * error,
        covered=covered,
        width=None if covered is None else 1.5,
    )
    known = {"trajectories": 12, "samples": 400, "counted": 300, **shares}
    return Row(
        group=group,
        inputs=inputs,
        call=call,
        step_s=STEP / steps,
        steps=steps,
        outputs=(output,),
        **known,
    )


def unfilled(**more: Any) -> Row:
    """A row of an FMU whose bound never counts."""
    nothing = {"covered": None, "trusted": None, "harmful": None, "silent": None}
    return row(**{**more, **nothing, "counted": 0})


def without_bound(**more: Any) -> Row:
    """A row of an FMU without an error bound."""
    return row(**{"harmful": 0.0, **more, "covered": None, "trusted": None, "silent": None})


MEASURED = (
    row(error=0.02),
    row(error=0.015, steps=4.0, trusted=0.99),
    row("steps", error=0.03, harmful=0.01),
    row("sines of 1 Hz", SMOOTH, 0.3, harmful=0.9, silent=0.8),
    row("sines of 1 Hz", SMOOTH, 0.08, steps=4.0),
)
"""What a small FMU was measured on."""


def timing(ratio: float) -> Timing:
    """Times of an FMU of 4 µs a step, whose model takes ``ratio`` times as long."""
    loosened = SolverSetting(
        model="reference",
        solver="RK45",
        setting="rtol = 1e-4",
        relative_error=0.01,
        seconds=2e-4 * ratio,
    )
    speed = SpeedFigures(
        finest=replace(loosened, setting="rtol = 1e-9", relative_error=0.0, seconds=0.2),
        loosened=loosened,
        relative_error=0.02,
        seconds=2e-4,
        ratio=ratio,
        can_be_loosened=True,
        complete=True,
    )
    return Timing(fmu_step_us=4.0, reference_step_us=4e3, speed=speed)
