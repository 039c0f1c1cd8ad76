"""Records of a workshop, with what goes wrong there, as files of the tests.

All are of one oscillator of 1.6 Hz with a tenth of the critical damping, under a smooth force.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import butter, cont2discrete, lfilter, sosfilt

STEP = 0.01
SAMPLES = 4000


def response(valve: np.ndarray, damping: float = 0.1, noise: float = 1e-3) -> np.ndarray:
    """The level that answers a valve, with white noise, shape (N,)."""
    w = 2 * np.pi * 1.6
    numerator, denominator, _ = cont2discrete(([w * w], [1, 2 * damping * w, w * w]), STEP)
    level = lfilter(numerator[0], denominator, valve)
    return level + noise * np.random.default_rng(1).normal(size=len(valve))


def smooth(samples: int = SAMPLES, seed: int = 0) -> np.ndarray:
    """A smooth valve, standard deviation 1, shape (N,)."""
    valve = sosfilt(butter(2, 0.1, output="sos"), np.random.default_rng(seed).normal(size=samples))
    return np.asarray(valve / valve.std())


def late(values: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate([np.zeros(samples), values[:-samples]])


def times(samples: int = SAMPLES) -> np.ndarray:
    return STEP * np.arange(samples)


def write(path: Path, **columns: np.ndarray) -> Path:
    """Write columns as CSV; underscores in the first name stand for themselves."""
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, "%.7g", ",", header=",".join(columns), comments="")
    return path


def write_bench(path: Path, valve: np.ndarray, level: np.ndarray, kept: object = None) -> Path:
    """Write times in s, a valve and its level; of all rows, or of those that are kept."""
    rows = slice(None) if kept is None else kept
    columns = {"time [s]": times(len(valve)), "valve": valve, "level": level}
    return write(path, **{name: values[rows] for name, values in columns.items()})
