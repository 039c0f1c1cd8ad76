"""Records and signals of the tests."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, chirp, sosfilt

from slide_fmu.record_files.record import Record, Text
from slide_fmu.records.findings import Finding

STEP = 1e-3


def record(
    columns: dict[str, np.ndarray], time: np.ndarray | None = None, texts: tuple[Text, ...] = ()
) -> Record:
    """A record as from the file a.csv, whose first sample stands in line 2."""
    length = len(next(iter(columns.values())))
    times = STEP * np.arange(length) if time is None else time
    units = dict.fromkeys(columns, "V")
    return Record(times, columns, units, "a.csv", "", "time", texts=texts, first_line=2)


def multisine(length: int, rng: np.random.Generator, lines: int = 60) -> np.ndarray:
    """One period of random phases, standard deviation 1."""
    spectrum = np.zeros(length // 2 + 1, complex)
    spectrum[1 : lines + 1] = np.exp(2j * np.pi * rng.random(lines))
    wave = np.fft.irfft(spectrum, length)
    return wave / wave.std()


def clean_signals(seed: int) -> dict[str, np.ndarray]:
    """Signals of a length that is drawn, with which nothing is wrong."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([500, 1000, 5000, 20000]))
    t = np.arange(n)
    rest = 1e-3 * rng.normal(size=n)
    return {
        "normal noise": rng.normal(size=n),
        "uniform noise": rng.uniform(-1, 1, n),
        "low-pass noise": sosfilt(butter(2, 0.05, output="sos"), rng.normal(size=n)),
        "random walk": np.cumsum(rng.normal(size=n)),
        "sine": np.sin(2 * np.pi * 1.3 * t / n + seed),
        "sines": np.sin(2 * np.pi * t * 7.3 / n) + np.sin(2 * np.pi * 11.7234 * t / n),
        "sweep": chirp(t, 1 / n, n, 50 / n),
        "multisine": multisine(n, rng),
        "step": (t > n * rng.uniform(0.1, 0.9)) * 1.0,
        "quick steps": np.repeat(rng.uniform(-1, 1, n // 10), 10),
        "slow steps": np.repeat(rng.uniform(-1, 1, n // 50), 50),
        "binary": np.repeat(rng.integers(0, 2, n // 5) * 2.0 - 1, 5),
        "quick binary": rng.integers(0, 2, n) * 2.0 - 1,
        "response to a step": 1 - np.exp(-t / (n * rng.uniform(0.001, 0.1))),
        "burst": rest + np.where((t > n / 3) & (t < n / 2), rng.normal(size=n), 0),
        "pulse": rest + np.where((t > n / 3) & (t < n / 3 + 20), 1.0, 0),
        "decay": np.exp(-t / (n / 8)) * np.sin(2 * np.pi * t / 37),
    }


def the_one(found: tuple[Finding, ...], kind: str, severity: str) -> str:
    """The message of the only finding, which is of this kind and severity."""
    assert [(finding.kind, finding.severity) for finding in found] == [(kind, severity)]
    return found[0].message
