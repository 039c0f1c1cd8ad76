"""Conformal calibration by trajectory: factors with which a scale of the error becomes a bound.

Samples of one trajectory resemble each other, so a trajectory counts as one observation: the
factor is the least one such that the share of its samples that a trajectory has covered is, on
average over N trajectories, at least c (N + 1) / N. For a further trajectory that is exchangeable
with these, the expected share is then at least c (pooled-CDF split conformal prediction: Dunn,
Wasserman, Ramdas, 2023, "Distribution-free prediction sets for two-layer hierarchical models").
"""

from __future__ import annotations

import math

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.error_bound import least_trajectories


def conformal_factors(ratios: FloatArray, confidence: float) -> FloatArray:
    """Give the factor of every output, (n_outputs,).

    Args:
        ratios: absolute errors over the scale of the error, shape (n_trajectories, N, n_outputs).
        confidence: expected share of covered samples in a further trajectory.

    Raises:
        ValueError: there are too few trajectories for the confidence.
    """
    count, least = len(ratios), least_trajectories(confidence)
    if count < least:
        raise ValueError(
            f"calibration for a confidence of {confidence:g} with {count} trajectories; expected "
            f"at least {least}: raise data.calibration"
        )
    share = confidence * (count + 1) / count
    pooled = np.sort(ratios.reshape(-1, ratios.shape[-1]), axis=0)
    place = math.ceil(share * len(pooled)) - 1
    return np.asarray(pooled[place])
