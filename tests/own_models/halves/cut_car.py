"""A quarter car over a road: its two halves as FMUs, and the whole, which scipy integrates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from slide_fmu.core.signals import FloatArray
from tests.own_models.halves.lower_half import (
    TYRE,
    TYRE_DAMPER,
    WHEEL,
    force_on_body,
)
from tests.python_fmus import write_python_fmu

HERE = Path(__file__).parent
LINKS = [("lower.force", "upper.force"), ("upper.position", "lower.body")]
KNOT = 0.02
"""The road is a straight line over each of these times, in s."""


def write_halves(folder: Path, rollback: bool = True, any_step: bool = True) -> dict[str, Path]:
    """Write both halves as FMUs.

    Without ``rollback``, they cannot go back to a former state; without ``any_step``, the lower
    one takes steps of 10 ms only, as its description says.
    """
    option = {
        "canGetAndSetFMUstate": str(rollback).lower(),
        "canHandleVariableCommunicationStepSize": str(any_step).lower(),
    }
    return {
        name: write_python_fmu(
            f"{name.title()}Half", HERE / f"{name}_half.py", folder / f"{name}.fmu", **option
        )
        for name in ("lower", "upper")
    }


def road(stop: float, seed: int = 1) -> tuple[FloatArray, FloatArray]:
    """Return times in s and heights in m: sines of 0.3 to 4 Hz, up to 40 mm."""
    rng = np.random.default_rng(seed)
    times = KNOT * np.arange(round(stop / KNOT) + 1)
    frequencies = np.exp(rng.uniform(np.log(0.3), np.log(4.0), 12))
    phases = rng.uniform(0, 2 * np.pi, 12)
    waves = np.sin(2 * np.pi * np.outer(frequencies, times) + phases[:, None])
    heights = (waves / frequencies[:, None]).sum(axis=0)
    heights -= heights[0]
    return times, 0.04 * heights / np.abs(heights).max()


def whole(
    mass: float, times: FloatArray, heights: FloatArray, tolerance: float = 1e-9
) -> FloatArray:
    """Return the position of the body at the times in m, without any cut."""
    x, found = np.array([heights[0], 0.0, 0.0, 0.0]), [0.0]
    for k in range(len(times) - 1):
        slope = (heights[k + 1] - heights[k]) / KNOT

        def rates(
            t: float, x: FloatArray, height: float = heights[k], slope: float = slope
        ) -> list[float]:
            force = force_on_body(x[:2], x[2], x[3])
            tyre = TYRE * (height + slope * t - x[0]) + TYRE_DAMPER * (slope - x[1])
            return [x[1], (tyre - force) / WHEEL, x[3], force / mass]

        exact = {"rtol": tolerance, "atol": 1e-3 * tolerance}
        run = solve_ivp(rates, (0.0, KNOT), x, method="DOP853", **exact)
        x = run.y[:, -1]
        found.append(float(x[2]))
    return np.array(found)


def relative_error(found: FloatArray, true: FloatArray) -> float:
    """Return the RMS error, relative to the RMS about the mean of the truth."""
    return float(np.sqrt(np.mean((found - true) ** 2) / np.mean((true - true.mean()) ** 2)))
