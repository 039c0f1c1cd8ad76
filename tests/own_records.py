"""Records of a damped oscillator with a bent output, quickly made, as files of a user."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import butter, lfilter, sosfilt

STEP, RATE, FREQUENCY = 0.01, 4.0, 20.0
"""Sample step in s; real part and imaginary part of the poles, in 1/s and rad/s."""
GAIN = 0.74
"""Specimens of a mass have the response divided by this, about its deviation."""
BEND = 0.15
"""The output has this part of the cube of the linear response."""


def force_and_travel(
    samples: int, seed: int = 0, bend: float = BEND, mass: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and outputs, (samples,) each, of which the output answers the input at once.

    A specimen of another mass than 1 moves more slowly, and decays more slowly.
    """
    rng = np.random.default_rng(seed)
    force = sosfilt(butter(2, 0.3, output="sos"), rng.normal(size=samples))
    slower = 1.0 if mass is None else 1 / mass
    pole = np.exp((-RATE * slower + 1j * FREQUENCY * slower**0.5) * STEP)
    response = lfilter([1 - pole.real], [1, -2 * pole.real, abs(pole) ** 2], force)
    response /= response.std() if mass is None else GAIN
    return force, response + bend * response**3


def write_record(
    path: Path,
    samples: int = 4000,
    seed: int = 0,
    noise: float = 0.0,
    header: str | None = None,
    mass: float | None = None,
) -> Path:
    """Write a CSV file of time, force and travel; the noise is relative to the travel's RMS."""
    force, travel = force_and_travel(samples, seed, mass=mass)
    rng = np.random.default_rng(1000 + seed)
    travel = travel + noise * travel.std() * rng.normal(size=samples)
    table = np.stack([STEP * np.arange(samples), force, travel], axis=1)
    names = header or "time [s],force [N],travel [m]"
    np.savetxt(path, table, "%.9g", ",", header=names, comments="")
    return path


RECIPE = """
name = "bench"
description = "a bent oscillator, measured"

[system]
kind = "record"
model = "bench.csv"

[system.inputs.force]
range = [-3.0, 3.0]
hold = "first_order"

[system.outputs.travel]
range = [-10.0, 10.0]

[window]
step = 0.01
n_in = 240
n_out = 80

[network]
order = 2
hidden = 4

[training]
iterations = 10
"""
