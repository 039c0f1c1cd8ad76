"""Free simulation of trajectories, and whether it stays bounded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.baselines.base import Baseline
from slide_fmu.fitting.baselines.lesson import Record

DIVERGED = 10.0
"""A simulation has diverged where an output leaves the middle of the true ones by so many times
their largest deviation from it, or is no number."""


def free_runs(baseline: Baseline, record: Record) -> FloatArray:
    """Simulate trajectories freely; return the outputs at samples 1 .. N, (B, N, n_outputs)."""
    with np.errstate(all="ignore"):  # what overflows has diverged, and is told as that
        runs = [
            baseline.simulate(inputs, outputs[: baseline.start_length])
            for inputs, outputs in zip(*record, strict=True)
        ]
    return np.array(runs)


def diverged(values: FloatArray, truth: FloatArray) -> NDArray[np.bool_]:
    """Say which of the simulated trajectories, (B, n, n_outputs) as the truth, have diverged."""
    flat = truth.reshape(-1, truth.shape[-1])
    middle = flat.mean(axis=0)
    reach = DIVERGED * np.abs(flat - middle).max(axis=0)
    inside = np.isfinite(values) & (np.abs(values - middle) <= reach)
    return np.asarray(~inside.all(axis=(1, 2)))


def judged(baseline: Baseline, record: Record, first: int) -> tuple[int, float]:
    """Return how many trajectories diverge, and the RMS error of the others; for a choice.

    Errors are in scaled units, over samples from ``first`` on and all outputs; infinite where all
    trajectories diverge.
    """
    values, truth = free_runs(baseline, record)[:, first - 1 :], record[1][:, first:]
    lost = diverged(values, truth)
    if lost.all():
        return int(lost.sum()), float("inf")
    return int(lost.sum()), float(np.linalg.norm(rms((values - truth)[~lost])))
