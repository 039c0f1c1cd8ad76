"""Set points are corrected so that the surrogate's prediction follows the wish.

The wish follows from the path itself: the tool of a serial chain must be where rigid links would
place it; other outputs must be what the user specifies. The corrections are splines of time,
found by damped Gauss-Newton steps. Corrections of single samples would excite the vibrations
that they should remove.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import PLAIN, Margins, judge
from slide_fmu.apps.motion.predictor import MotionError, Predictor
from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.network.base import batches
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

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
    differences = np.empty((len(basis) * coordinates, *error.shape))
    every, probes = np.arange(len(differences)), PROBE * np.diag(ranges)
    for some in batches(len(differences), AT_ONCE):
        spline, moved = np.divmod(every[some], coordinates)
        probed = motion + basis[spline, :, None] * probes[moved, None]
        differences[some] = errors(probed) - error
    return np.asarray(differences / PROBE).reshape(len(basis), coordinates, *error.shape)


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
    change = np.linalg.solve(curvature, -matrix @ error.reshape(-1))
    return np.asarray(change.reshape(slopes.shape[:2]))


KNOTS = 3
"""Default distance of the knots of corrections, in samples."""

ROUNDS = 5
"""Largest number of Gauss-Newton steps."""

DAMPING = 1e-6
"""Smallest curvature of every direction, relative to the largest: unneeded changes stay zero."""

WORTH = 0.98
"""A step that leaves more than this fraction of the error is the last one."""

Rigid = Callable[[FloatArray], FloatArray]
"""From coordinates, (..., n_coordinates), to a rigid motion added to the outputs, (...,
n_outputs)."""


@dataclass(frozen=True, eq=False)
class CompensatedPath:
    """A CompensatedPath is a path with its corrections.

    Attributes:
        predictor: predicts motions of its length.
        rigid: rigid motion added to the outputs.
        target: wished sum of both, (count, n_outputs).
        path: the wished path, (count, n_coordinates).
        motion: the corrected path, (count, n_coordinates).
        before, after: predicted error of both, (count, n_outputs), in the outputs' units.
        condition: condition number of the matrix from coordinates to the rigid motion at every
            sample, (count,); 1 without a rigid motion.
    """

    predictor: Predictor
    rigid: Rigid
    target: FloatArray
    path: FloatArray
    motion: FloatArray
    before: FloatArray
    after: FloatArray
    condition: FloatArray


def chain_of_surrogate(surrogate: Surrogate) -> SerialChain | None:
    """Return the serial chain in a surrogate's features, if there is one."""
    network = surrogate.network
    features = network.features.features if isinstance(network, StateSpace) else None
    return features.chain if isinstance(features, ChainMotion) else None


def compensate(
    surrogate: Surrogate,
    path: FloatArray,
    limits: Limits,
    wished: FloatArray | None = None,
    between: float | None = None,
    progress: Progress = quiet,
    margins: Margins = PLAIN,
) -> CompensatedPath:
    """Correct a path that begins at rest.

    Args:
        surrogate: the surrogate that predicts.
        path: coordinates at every sample, (count, n_coordinates).
        limits: limits of the corrected path.
        wished: outputs after every step, (count, n_outputs); None for the tool of a serial chain,
            which must be where rigid links would place it.
        between: time in s between the knots of the corrections; three samples if None.
        progress: called with the number of steps.
        margins: what the margins of predictions are.

    Raises:
        MotionError: nothing is wished and the surrogate has no chain, the outputs have several
            units, the limits are not kept, the improvement is smaller than the margin of the
            prediction, or as for ``Predictor``.
    """
    predictor = Predictor(surrogate, len(path))
    _require_limits("path", path, surrogate, limits)
    rigid, target = _wish(surrogate, path, wished)
    samples = KNOTS if between is None else max(1, round(between / surrogate.window.step))
    basis = splines(len(path), samples)
    ranges = np.array([_half_range(c.low, c.high) for c in predictor.coordinates])

    def errors(motions: FloatArray) -> FloatArray:
        return np.asarray(rigid(motions) + predictor.outputs(motions) - target)

    motion, error = path, errors(path[None])[0]
    before, damping, beyond = error, DAMPING, None
    for done in range(ROUNDS):
        progress(done, ROUNDS)
        if _norm(error) == 0:
            break
        differences = slopes(errors, motion, error, basis, ranges)
        change = gauss_newton(differences, error, damping)
        tried = motion + np.einsum("kt,ki->ti", basis, change * ranges)
        left = errors(tried[None])[0]
        if not limits.kept(tried[0], tried, surrogate.window.step):  # smoother ones may keep them
            beyond, damping = tried, damping * 100
            continue
        if not _norm(left) < _norm(error):
            damping *= 100
            continue
        worth = _norm(left) < WORTH * _norm(error)
        motion, error = tried, left
        if not worth:
            break
    progress(ROUNDS, ROUNDS)
    if beyond is not None and not _norm(error) < WORTH * _norm(before):
        _require_limits("corrected path", beyond, surrogate, limits)
    condition = condition_along(rigid, path, ranges)
    compensated = CompensatedPath(predictor, rigid, target, path, motion, before, error, condition)
    _require_use(compensated, surrogate, margins)
    return compensated


def _wish(
    surrogate: Surrogate, path: FloatArray, wished: FloatArray | None
) -> tuple[Rigid, FloatArray]:
    """Return the rigid motion added to the outputs, and the wished sum."""
    units = sorted({output.unit for output in surrogate.outputs})
    if len(units) > 1:
        raise MotionError(
            f"surrogate {surrogate.name!r} has outputs in {units}; expected one unit, since "
            "errors are distances over all outputs"
        )
    if wished is not None:
        return lambda motions: np.zeros((*motions.shape[:-1], wished.shape[1])), wished
    chain = chain_of_surrogate(surrogate)
    if chain is None or len(surrogate.outputs) != 3:
        raise MotionError(
            f"surrogate {surrogate.name!r} knows no serial chain whose tool its outputs "
            f"{[output.name for output in surrogate.outputs]} move; expected one, or columns for "
            "the outputs in the path: add what they should be"
        )
    return chain.tool_position, chain.tool_position(path)


def _half_range(low: float, high: float) -> float:
    """Return the unit of a coordinate's correction: half its range, or 1 rad for an angle."""
    return 0.5 * (high - low) if np.isfinite(high - low) else 1.0


def _norm(error: FloatArray) -> float:
    return float(np.linalg.norm(error))


def condition_along(rigid: Rigid, path: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the condition number of the rigid motion's slopes at every sample; 1 without one.

    Args:
        rigid: rigid motion added to the outputs.
        path: coordinates, (count, n_coordinates).
        ranges: units of the coordinates, (n_coordinates,).
    """
    shifted = path[:, None] + PROBE * np.diag(ranges)
    slopes = rigid(shifted) - rigid(path)[:, None]
    values = np.linalg.svd(slopes, compute_uv=False)
    return np.asarray(np.where(values[:, 0] > 0, values[:, 0] / (values[:, -1] + 1e-300), 1.0))


def _require_use(compensated: CompensatedPath, surrogate: Surrogate, margins: Margins) -> None:
    """Refuse corrections whose improvement is not certain."""
    unit, step = surrogate.outputs[0].unit, surrogate.window.step
    before, after = _rms(compensated.before), _rms(compensated.after)
    if before > 0 and not after < WORTH * before:
        worst = int(np.argmax(compensated.condition))
        raise MotionError(
            f"the path's error of {before:.3g}{behind(unit)} RMS does not become smaller; the "
            "coordinates move the outputs with a condition number of up to "
            f"{compensated.condition[worst]:.3g} (at {step * worst:.3g} s), and near a singular "
            "place no correction is small: choose another path"
        )
    (judged,) = judge(surrogate, compensated.predictor.inputs(compensated.motion)[None], margins)
    off = judged.margins[compensated.predictor.lead :]
    if (margin := float(np.sqrt(np.mean(off**2)))) > before - after > 0:
        raise MotionError(
            f"the path's error of {before:.3g}{behind(unit)} RMS would become "
            f"{after:.3g}{behind(unit)}, but "
            f"the prediction may be off by {margin:.3g}{behind(unit)} RMS there; expected less "
            "than what "
            "the corrections gain: choose a slower path, which the surrogate knows better"
        )


def _require_limits(what: str, motion: FloatArray, surrogate: Surrogate, limits: Limits) -> None:
    step = surrogate.window.step
    used = limits.used(motion[0], motion, step)
    if not limits.kept(motion[0], motion, step):
        worst = max(used, key=lambda name: used[name])
        remedy = (
            "keep it in the ranges that the FMU declares"
            if worst == "range"
            else "begin and end it at rest, give it more time, or raise the limit"
        )
        raise MotionError(
            f"the {what} uses {100 * used[worst]:.4g} % of the limit of {worst}; expected at most "
            f"100 %: {remedy}"
        )


def _rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
