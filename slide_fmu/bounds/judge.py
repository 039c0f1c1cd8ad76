"""A judge has what an error bound takes from observed errors: head, factors and limits.

Nothing was trained on the errors by which it is calibrated. Conformal prediction turns a scale of
the error into a bound by a factor. Samples of one trajectory resemble each other, so a trajectory
counts as one observation. A factor is the smallest one for which the share of covered samples per
trajectory, averaged over N trajectories, is at least c (N + 1) / N. (A sample whose error is at
most its floor, or at most the disagreement, is covered by any factor.) For a new trajectory that
is exchangeable with these, the expected share is then at least c (pooled-CDF split conformal
prediction: Dunn, Wasserman, Ramdas, 2023, "Distribution-free prediction sets for two-layer
hierarchical models").
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.bounds.observations import Observations, samples_of, thinned
from slide_fmu.core.block_means import N_BLOCKS, block_means
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.history import History
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import SMALLEST
from slide_fmu.surrogate.error_bound import (
    CONFIDENCES,
    MOST_EXPONENT,
    NO_BOUND,
    USUAL_CONFIDENCE,
    ErrorBound,
    calibrated,
    floored,
    least_trajectories,
    local_scales,
)
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.span_estimate import SpanEstimate

FURTHER_SHARE = 0.05
"""Largest share of samples of further kinds, relative to the others that the head learns from.

With this share, bounds in range become hardly wider. Neighbouring samples resemble each other, so
little is lost by leaving some out."""

QUIETEST = 0.001
"""Quantile of the logarithms in the head's training; it sees no smaller ones, since networks
extrapolate badly. An input at rest may have the logarithm of nothing at all."""

FLOOR, FLOOR_OF_MEDIAN = 0.15, 0.45
"""The floor of an output's bounds is this part of its usual error, and at most that part of the
usual error in the median trajectory. It covers small errors on kinds of input that the head has
never seen. Where few kinds have far larger errors than the others, the first alone would make all
other bounds wide."""

UNEVEN, COMMON = 1.6, 3
"""Samples of one kind of input in the mix may lie above their bound more often than all samples,
but at most by the first factor. Without this limit, a user who drives the machine by the kind with
the largest errors alone would get less than the bound promises. It counts for kinds that have the
second factor times the least number of trajectories: with fewer, chance makes bounds too large."""

KIND_CONFIDENCE = 1 - UNEVEN * (1 - USUAL_CONFIDENCE)
OF_A_KIND = COMMON * least_trajectories(KIND_CONFIDENCE)
"""The usual bound covers this share of the samples of each kind that has so many trajectories in
the calibration."""

LEAST_FACTOR = 0.5
"""Least factor over the factor without floors and disagreement. Where both cover enough samples of
the calibration, the head must still count: other kinds of input have larger errors."""

BOX_MARGIN = 1.002
"""The box is larger by this factor. A mean that is reached again and again, as that of the cosine
of a crank at rest, would leave it by its last digits."""

USUAL = 0.999
"""Quantile of the watched means that gives the shape of the domain, a box."""


@dataclass(frozen=True, eq=False)
class Judge:
    """A Judge has the parts of an error bound that follow from observed errors.

    Attributes:
        head, factors, limits, span, floors, shares, quietest: as in ``ErrorBound``.
        calibration: what was observed on the calibration, as the head gets it.
        history: course of the head's training.
    """

    head: FeedForward
    factors: FloatArray
    limits: FloatArray
    span: SpanEstimate | None
    floors: FloatArray
    shares: FloatArray
    quietest: FloatArray
    calibration: Observations
    history: History

    def bounds(self, mix: Observations) -> FloatArray:
        """Return the 95 % bounds on a calibration, (n_trajectories, N, n_outputs)."""
        factors = self.factors[CONFIDENCES.index(USUAL_CONFIDENCE)]
        scales = scales_of(self.head, mix.statistics)[..., : len(factors)]
        return floored(factors * scales, self.floors, mix.disagreement)

    def outside(self, mix: Observations) -> NDArray[np.bool_]:
        """Return where a calibration is outside of the domain, (n_trajectories, N)."""
        return np.asarray((mix.watched / self.limits).max(axis=2) > 1)

    def error_bound(
        self,
        companion: StateSpace,
        blocks: tuple[int, int],
        estimator: ErrorEstimator | None,
        tolerances: FloatArray,
        doubt: float,
        moving: bool,
    ) -> ErrorBound:
        """Return the bound of this judge; the arguments are as in ``ErrorBound``."""
        return ErrorBound(
            companion,
            self.head,
            blocks,
            self.factors,
            self.limits,
            tolerances=tolerances,
            floors=self.floors,
            shares=self.shares,
            doubt=doubt,
            moving=moving,
            quietest=self.quietest,
            estimator=estimator,
            span=self.span,
        )


def fit_judge(
    mixes: Sequence[Observations],
    kinds: NDArray[np.int64],
    domain_alarms: float,
    block: int | None,
    fit: Callable[[Sequence[Observations]], tuple[FeedForward, History]],
) -> Judge:
    """Train the head of a judge, and calibrate it.

    Args:
        mixes: what the head learns from, the calibration, and possibly further kinds that the
            head learns from, too.
        kinds: kind of each trajectory of the calibration, (n_trajectories,).
        domain_alarms: share of the calibration's samples that lie outside of the domain.
        block: number of samples in a block of the error estimate; None without one.
        fit: trains a head.

    Raises:
        TrainingError: the training diverged, or the checkpoint cannot be read.
        ValueError: the surrogate makes no error at all, or there are too few trajectories.
    """
    learnt, calibration, *further = mixes
    n_outputs = calibration.errors.shape[2]
    of_head = [learnt, *(thinned(mix, FURTHER_SHARE * learnt.errors.size) for mix in further)]
    n_seen = learnt.watched.shape[2] - 2 * n_outputs  # after these come logarithms
    flat = np.concatenate([samples_of(mix.statistics)[:, 0, n_seen:] for mix in of_head])
    quietest = np.quantile(flat, QUIETEST, axis=0)
    head, history = fit([mix.head_inputs(quietest) for mix in of_head])
    floors, shares = floors_of(calibration), shares_of(calibration)
    calibration = calibration.head_inputs(quietest).weighed(shares)
    span = None
    if block is not None:
        rms = scales_of(head, calibration.statistics)[..., n_outputs:]
        span = SpanEstimate(block, span_factors(calibration.errors, rms, block))
    return Judge(
        head=head,
        factors=factors_of(head, floors, calibration, kinds),
        limits=domain_limits(learnt.watched, calibration.watched, domain_alarms),
        span=span,
        floors=floors,
        shares=shares,
        quietest=quietest,
        calibration=calibration,
        history=history,
    )


def tolerances_of(judge: Judge, false_alarms: float) -> FloatArray:
    """Return the largest bounds that are trusted, relative to the outputs' scales, (n_outputs,).

    They are the same multiple of the usual error of every output, which is the 95 % quantile. At
    most the share of false alarms of the samples has a larger bound or lies outside of the domain.
    """
    mix = judge.calibration
    usual = mix.usual_errors()
    ratios = (judge.bounds(mix) / usual).max(axis=2)
    ratios[judge.outside(mix)] = ratios.max()  # they are alarms anyway
    return np.asarray(usual * np.quantile(ratios, 1 - false_alarms, method="higher"))


def scales_of(head: FeedForward, statistics: FloatArray) -> FloatArray:
    """Return the head's local scales, and RMS errors if any, (n_trajectories, N, n_values)."""
    exponents = head.evaluate(samples_of(statistics)).astype(np.float64)
    return local_scales(exponents).reshape(*statistics.shape[:2], head.n_values)


def floors_of(calibration: Observations) -> FloatArray:
    """Return what no bound is smaller than, relative to the outputs' scales, (n_outputs,)."""
    of_trajectories = np.quantile(calibration.errors, USUAL_CONFIDENCE, axis=1)
    median = np.median(of_trajectories, axis=0)
    return np.asarray(np.minimum(FLOOR * calibration.usual_errors(), FLOOR_OF_MEDIAN * median))


def shares_of(calibration: Observations) -> FloatArray:
    """Return which share of the disagreement is the surrogate's own error, (n_outputs,).

    The rest is the companion's error. Both are compared by their 95 % quantiles. The share is at
    most 1.
    """
    disagreement = samples_of(calibration.disagreement)[:, 0]
    usual = np.quantile(disagreement, USUAL_CONFIDENCE, axis=0)
    return np.asarray(calibration.usual_errors() / np.maximum(usual, calibration.usual_errors()))


def factors_of(
    head: FeedForward, floors: FloatArray, calibration: Observations, kinds: NDArray[np.int64]
) -> FloatArray:
    """Return the factors for all confidences, (3, n_outputs).

    They cover all trajectories together with the confidence, and those of each kind of input that
    has enough of them with a lower one (``UNEVEN``). The kinds have the shape (n_trajectories,).

    The floors have the shape (n_outputs,); the disagreement of the calibration is weighed. Each
    sample is covered from some factor on (``floored``), and these factors are the ratios for
    ``conformal_factors``. See ``LEAST_FACTOR`` too.

    If there are too few trajectories for a confidence above the usual one, its bound is infinite.
    No factor is smaller than one of a lower confidence, for which a kind may have enough
    trajectories alone.
    """
    n_outputs = calibration.errors.shape[2]
    scales = scales_of(head, calibration.statistics)[..., :n_outputs]
    errors = calibration.errors
    left = np.sqrt(np.maximum(errors**2 - floors**2, 0.0))
    ratios = np.where(errors <= calibration.disagreement, 0.0, left / scales)
    without = np.maximum(errors / scales, 2.0**-MOST_EXPONENT)  # factors must be positive
    enough = calibrated(len(ratios))
    factors = [
        np.full(n_outputs, NO_BOUND)
        if confidence > USUAL_CONFIDENCE and confidence not in enough
        else np.maximum.reduce(
            [
                conformal_factors(ratios, confidence),
                LEAST_FACTOR * conformal_factors(without, confidence),
                *_factors_of_kinds(ratios, kinds, 1 - UNEVEN * (1 - confidence)),
            ]
        )
        for confidence in CONFIDENCES
    ]
    return np.asarray(np.maximum.accumulate(factors, axis=0))


def _factors_of_kinds(
    ratios: FloatArray, kinds: NDArray[np.int64], confidence: float
) -> list[FloatArray]:
    """Return the factors of each kind of input alone, if its trajectories suffice for that."""
    parts = [ratios[kinds == kind] for kind in np.unique(kinds)]
    least = least_trajectories(confidence)
    return [conformal_factors(part, confidence) for part in parts if len(part) >= COMMON * least]


def conformal_factors(ratios: FloatArray, confidence: float) -> FloatArray:
    """Return the factor of every output, (n_outputs,).

    Args:
        ratios: absolute errors over the scale of the error, shape (n_trajectories, N, n_outputs).
        confidence: expected share of covered samples in a new trajectory.

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


def span_factors(errors: FloatArray, rms: FloatArray, block: int) -> FloatArray:
    """Return the factors from expected errors of samples to errors over a span, (n_outputs,).

    Both arrays have the shape (n_trajectories, N, n_outputs). On the calibration, estimates are
    too large as often as too small.
    """
    known = slice((N_BLOCKS + 1) * block, None)
    true, estimated = (block_means(values**2, block)[:, known] for values in (errors, rms))
    ratios = np.log(np.maximum(true, SMALLEST) / estimated)
    return np.asarray(np.exp(0.5 * np.median(ratios.reshape(-1, ratios.shape[2]), axis=0)))


def domain_limits(learnt: FloatArray, calibration: FloatArray, false_alarms: float) -> FloatArray:
    """Return the watched means at the edge of the domain, (n_watched,).

    The box of the usual means, (n_trajectories, N, n_watched), is enlarged in all directions until
    the share of calibration samples outside equals the share of false alarms, and by a margin.
    """
    usual = np.quantile(learnt.reshape(-1, learnt.shape[2]), USUAL, axis=0)
    usual = np.maximum(usual, SMALLEST)
    outermost = (calibration / usual).max(axis=2)
    return np.asarray(BOX_MARGIN * usual * np.quantile(outermost, 1 - false_alarms))
