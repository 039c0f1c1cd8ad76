"""Write two minutes of voltages as a logger would have them: ramps and rests, or lasting tones.

Usage: python drive_cycle.py [FILE [SEED [ramps | tones]]]
"""

from __future__ import annotations

import sys

import numpy as np

LASTS = 120.0
"""Length of a record in s."""


def ramps(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times in s and voltages in V, at 125 Hz: ramps and rests, with a ripple."""
    rng = np.random.default_rng(seed)
    times = 0.008 * np.arange(round(LASTS / 0.008))
    corners, levels, end = [0.0], [0.0], 0.0
    while end < times[-1]:
        rest, ramp = rng.uniform(0.5, 4.0), rng.uniform(0.3, 2.0)
        corners += [end + rest, end + rest + ramp]
        levels += [levels[-1], rng.uniform(-9.0, 9.0)]
        end += rest + ramp
    voltage = np.interp(times, corners, levels)
    return times, voltage + 0.4 * np.sin(2 * np.pi * 3.1 * times) * (np.abs(voltage) > 1.0)


def tones(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times in s and voltages in V, at 200 Hz: another large tone every 4 s."""
    rng, step = np.random.default_rng(seed), 0.005
    times = step * np.arange(round(LASTS / step))
    pieces = [np.repeat(rng.uniform(*ends, 30), 800) for ends in ((1, 8), (5, 12), (-1, 1))]
    mean = np.ones(60) / 60  # from one tone to the next within 0.3 s
    hz, size, level = (np.convolve(np.pad(p, (30, 29), "edge"), mean, "valid") for p in pieces)
    voltage = level * (12.5 - size) + size * np.sin(2 * np.pi * np.cumsum(hz) * step)
    return times, np.clip(voltage, -12.9, 12.9)


if __name__ == "__main__":
    file, seed, kind = [*sys.argv[1:], *("drive.csv", "7", "ramps")[len(sys.argv) - 1 :]]
    rows = np.stack({"ramps": ramps, "tones": tones}[kind](int(seed)), axis=1)
    np.savetxt(file, rows, "%.6g", ",", header="time [s],voltage [V]", comments="")
