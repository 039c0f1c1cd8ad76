"""Write a drive of two minutes as a logger would have it: ramps and rests, with a ripple.

Usage: python drive_cycle.py [FILE [SEED]]
"""

from __future__ import annotations

import sys

import numpy as np

STEP, COUNT = 0.008, 15_000
"""The clock of the logger in s, and the number of its samples."""


def drive(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times in s and voltages in V; each seed gives another drive."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(COUNT)
    corners, levels, end = [0.0], [0.0], 0.0
    while end < times[-1]:
        rest, ramp = rng.uniform(0.5, 4.0), rng.uniform(0.3, 2.0)
        corners += [end + rest, end + rest + ramp]
        levels += [levels[-1], rng.uniform(-9.0, 9.0)]
        end += rest + ramp
    voltage = np.interp(times, corners, levels)
    return times, voltage + 0.4 * np.sin(2 * np.pi * 3.1 * times) * (np.abs(voltage) > 1.0)


if __name__ == "__main__":
    file, seed = [*sys.argv[1:], *("drive.csv", "7")[len(sys.argv) - 1 :]]
    rows = np.stack(drive(int(seed)), axis=1)
    np.savetxt(file, rows, "%.6g", ",", header="time [s],voltage [V]", comments="")
