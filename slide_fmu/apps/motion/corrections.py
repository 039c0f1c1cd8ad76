"""Corrections of a path are splines of time; Gauss-Newton steps find their coefficients."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BSpline

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.base import batches

PROBE = 1e-4
"""Step of the forward differences of responses, relative to a coordinate's range."""

AT_ONCE = 250
"""Number of probes evaluated together: their sequences fit into memory."""


def splines(count: int, between: int) -> FloatArray:
    """Return cubic B-splines with knots every ``between`` samples, (n, count).

    Any constant is a sum of them.
    """
    pieces = max(1, -(-(count - 1) // between))
    inner = np.linspace(0, count - 1, pieces + 1)
    knots = np.concatenate([np.zeros(3), inner, np.full(3, float(count - 1))])
    return np.asarray(BSpline.design_matrix(np.arange(float(count)), knots, 3).toarray().T)


def slopes(
    errors: Callable[[FloatArray], FloatArray],
    motion: FloatArray,
    error: FloatArray,
    basis: FloatArray,
    ranges: FloatArray,
) -> FloatArray:
    """Differentiate errors by corrections in ranges: (n_splines, n_coordinates, *error.shape).

    Args:
        errors: function from motions, (B, count, n_coordinates), to errors.
        motion: point of the derivative, (count, n_coordinates).
        error: error of that motion.
        basis: splines, (n_splines, count).
        ranges: units of the corrections, (n_coordinates,).
    """
    coordinates = len(ranges)
    found = np.empty((len(basis) * coordinates, *error.shape))
    every, probes = np.arange(len(found)), PROBE * np.diag(ranges)
    for some in batches(len(found), AT_ONCE):
        spline, moved = np.divmod(every[some], coordinates)
        probed = motion + basis[spline, :, None] * probes[moved, None]
        found[some] = errors(probed) - error
    return np.asarray(found / PROBE).reshape(len(basis), coordinates, *error.shape)


def gauss_newton(slopes: FloatArray, error: FloatArray, damping: float) -> FloatArray:
    """Return one damped Gauss-Newton step, (n_splines, n_coordinates), in ranges.

    Args:
        slopes: result of ``slopes``.
        error: the error to reduce to zero.
        damping: smallest curvature of every direction, relative to the largest.
    """
    matrix = slopes.reshape(-1, error.size)
    curvature = matrix @ matrix.T
    curvature += damping * np.diag(curvature).max() * np.eye(len(curvature))
    found = np.linalg.solve(curvature, -matrix @ error.reshape(-1))
    return np.asarray(found.reshape(slopes.shape[:2]))
