"""Free simulation of trajectories, and whether it stays bounded."""

from __future__ import annotations

import numpy as np

from slide_fmu.apps.compare.baselines.base import Baseline
from slide_fmu.apps.compare.baselines.lesson import Record
from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray

DIVERGED = 10.0
"""A simulation has diverged where an output leaves the middle of the true ones by so many times
their largest deviation from it, or is no number."""
ROUNDING = 1e-9
"""Smaller errors, in scaled units, count as this: of exact models the smallest one is taken."""


def free_run(baseline: Baseline, inputs: FloatArray, start: FloatArray) -> FloatArray:
    """Simulate one trajectory as ``Baseline.simulate``; one that overflows has diverged."""
    with np.errstate(all="ignore"):
        return baseline.simulate(inputs, start)


def diverged(values: FloatArray, truth: FloatArray) -> bool:
    """Say whether simulated outputs, (n, n_outputs), have left the true ones, (m, n_outputs)."""
    middle = truth.mean(axis=0)
    reach = DIVERGED * np.abs(truth - middle).max(axis=0)
    return not bool(np.all(np.isfinite(values) & (np.abs(values - middle) <= reach)))


def judged(baseline: Baseline, record: Record, first: int) -> tuple[int, float]:
    """Return how many trajectories diverge, and the RMS error of the others; for a choice.

    Errors are in scaled units, over samples from ``first`` on and all outputs; infinite where all
    trajectories diverge.
    """
    all_true = record[1].reshape(-1, record[1].shape[2])
    lost, errors = 0, []
    for inputs, outputs in zip(*record, strict=True):
        values = free_run(baseline, inputs, outputs[: baseline.start_length])[first - 1 :]
        if diverged(values, all_true):
            lost += 1
        else:
            errors.append(values - outputs[first:])
    if not errors:
        return lost, float("inf")
    return lost, max(float(np.linalg.norm(rms(np.concatenate(errors)))), ROUNDING)
