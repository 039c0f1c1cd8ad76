"""The best fit is searched from several starts; outputs are weighted by their residuals."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from slide_fmu.apps.calibrate.problem import CalibrationProblem
from slide_fmu.core.measures import TINY
from slide_fmu.core.signals import FloatArray

LEAST_NOISE = 1e-6
"""Residuals below this fraction of an output's standard deviation are rounding of float32."""

KEPT = 3
"""Number of the tried points that are refined."""

ROUNDS = 3
"""Number of rounds that compute the weights of outputs from their residuals; they converge
fast."""

MOST_EVALUATIONS = 60


def best_fit(problem: CalibrationProblem, seed: int) -> FloatArray:
    """Find the parameters z within their ranges, shape (n_free,), that fit best.

    Every output is weighted by its noise, which is estimated from its residuals (iteratively
    reweighted least squares; scipy's trust region within bounds).

    Args:
        problem: the problem to solve.
        seed: seed of the Sobol points that are tried first, with the start values.
    """
    noise = np.maximum(problem.measurements.deviations, TINY)
    tried = _tried(problem, seed)
    costs = [float(np.sum((problem.residuals(z) / noise) ** 2)) for z in tried]
    best = [tried[index] for index in np.argsort(costs, kind="stable")[:KEPT]]
    refined = [_refined(problem, z, noise) for z in best]
    z, _ = min(refined, key=lambda found: found[1])
    for _ in range(ROUNDS - 1):
        z, _ = _refined(problem, z, noise_of(problem, problem.residuals(z)))
    return z


def noise_of(problem: CalibrationProblem, residuals: FloatArray) -> FloatArray:
    """Estimate the standard deviation of each output's noise from residuals, (n_outputs,)."""
    counts = np.isfinite(problem.measurements.scored).sum(axis=0)
    n_free = len(problem.free)
    share = np.sqrt(np.maximum(counts, 1) / np.maximum(counts - n_free, 1))
    floor = LEAST_NOISE * problem.measurements.deviations
    smallest = TINY  # outputs that were not measured are all 0
    return np.asarray(np.maximum(share * problem.rmse(residuals), np.maximum(floor, smallest)))


def _tried(problem: CalibrationProblem, seed: int) -> list[FloatArray]:
    """Return the start values and Sobol points, more of them for more parameters."""
    n_free = len(problem.free)
    points = qmc.Sobol(n_free, rng=np.random.default_rng(seed)).random_base2(min(3 + n_free, 6))
    start = np.array([p.scaled(np.float64(p.start_value)) for p in problem.free])
    return [start, *(2 * points - 1)]


def _refined(
    problem: CalibrationProblem, z: FloatArray, noise: FloatArray
) -> tuple[FloatArray, float]:
    """Refine a point; return it and its sum of squares."""
    found = least_squares(
        lambda at: (problem.residuals(at) / noise).ravel(),
        np.clip(z, -1, 1),
        jac=lambda at: (problem.slopes(at) / noise[:, None]).reshape(-1, len(z)),
        bounds=(-1.0, 1.0),
        max_nfev=MOST_EVALUATIONS,
    )
    return np.asarray(found.x), float(found.cost)
