"""Decay times as plain values for JSON, and as people read them."""

from __future__ import annotations

import math
from typing import Any

from slide_fmu.memory.decay import Decay
from slide_fmu.memory.motions import Linearized


def decay_rows(figures: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the decay times of ``sizing.Sizing.figures`` as rows of a table, the headings first.

    Measured times are those of whole motions, so their last column is empty. Linearized ones are
    not there where the system does not offer them, which the row says. Those of records are of a
    linear fit, with their 95 % interval.
    """
    if "fitted_decay_time_s" in figures:
        fitted = figures["fitted_decay_time_s"]
        return [
            ("decay time", "slowest pole", "95 % interval from", "to"),
            ("fitted", seconds(fitted["value"]), seconds(fitted["low"]), seconds(fitted["high"])),
        ]
    linearized, measured = figures["decay_time_s"], figures["measured_decay_time_s"]
    mean, worst, local = "not offered", "", ""
    if linearized is not None:
        mean, worst, local = (seconds(linearized[key]) for key in ("mean", "worst", "local_worst"))
    return [
        ("decay time", "mean", "worst", "at the worst instant"),
        ("linearized", mean, worst, local),
        ("measured", seconds(measured["mean"]), seconds(measured["worst"]), ""),
    ]


def seconds(value: float | None) -> str:
    """Write a decay time in s as people read it; None stands for a motion that never decays."""
    return "without end" if value is None else f"{value:.4g} s"


def finite(value: float) -> float | None:
    """Return a number for JSON, which knows no infinity: None stands for it."""
    return value if math.isfinite(value) else None


def linearized_figures(linearized: Linearized | None) -> dict[str, Any]:
    """Return what the equations say, by name; None everywhere if they are not offered."""
    if linearized is None:
        return dict.fromkeys(("decay_time_s", "modes_at_rest", "rigid_body_eigenvalues"))
    return {
        "decay_time_s": {
            **times(linearized.decay),
            "local_worst": finite(linearized.local_worst),
        },
        "modes_at_rest": [
            {
                "frequency_rad_s": mode.natural_frequency,
                "damping_ratio": mode.damping_ratio,
                "decay_time_s": finite(mode.decay_time),
            }
            for mode in linearized.modes.modes
        ],
        "rigid_body_eigenvalues": len(linearized.modes.rigid),
    }


def times(decay: Decay) -> dict[str, float | None]:
    """Return the mean and worst decay time in s by name; None for one without end."""
    return {"mean": finite(decay.mean), "worst": finite(decay.worst)}
