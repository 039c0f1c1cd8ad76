"""Trajectories are simulated freely, and checked for divergence."""

from __future__ import annotations

import numpy as np

from slide_fmu.apps.compare.baselines.base import Baseline
from slide_fmu.apps.compare.baselines.lesson import Motions
from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray

DIVERGED = 10.0
"""A simulation has diverged if an output's distance from the middle of the true ones exceeds this
multiple of their largest distance, or is NaN."""
ROUNDING = 1e-9
"""Smallest error, in scaled units: among exact models the smallest one is taken."""


def free_run(baseline: Baseline, inputs: FloatArray, start: FloatArray) -> FloatArray:
    """Simulate one trajectory as ``Baseline.simulate``; one that overflows has diverged."""
    with np.errstate(all="ignore"):
        return baseline.simulate(inputs, start)


def diverged(values: FloatArray, truth: FloatArray) -> bool:
    """Return whether simulated outputs, (n, n_outputs), diverge from true ones, (m, n_outputs)."""
    middle = truth.mean(axis=0)
    reach = DIVERGED * np.abs(truth - middle).max(axis=0)
    return not bool(np.all(np.isfinite(values) & (np.abs(values - middle) <= reach)))


def judged(baseline: Baseline, motions: Motions, first: int) -> tuple[int, float]:
    """Return the number of diverging trajectories, and the RMS error of the others.

    Errors are in scaled units, over samples from ``first`` on and all outputs; infinite if all
    trajectories diverge.
    """
    all_true = motions[1].reshape(-1, motions[1].shape[2])
    lost, errors = 0, []
    for inputs, outputs in zip(*motions, strict=True):
        values = free_run(baseline, inputs, outputs[: baseline.start_length])[first - 1 :]
        if diverged(values, all_true):
            lost += 1
        else:
            errors.append(values - outputs[first:])
    if not errors:
        return lost, float("inf")
    return lost, max(float(np.linalg.norm(rms(np.concatenate(errors)))), ROUNDING)
