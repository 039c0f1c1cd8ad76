"""A judge has what an error bound takes from observed errors: head, factors and limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.bounds.calibration import (
    domain_limits,
    factors_of,
    floors_of,
    scales_of,
    shares_of,
    span_factors,
)
from slide_fmu.bounds.observations import Observations, samples_of, thinned
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.history import History
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.error_bound import CONFIDENCES, USUAL_CONFIDENCE, ErrorBound, floored
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.span_estimate import SpanEstimate

FURTHER_SHARE = 0.05
"""Largest share of samples of further kinds, relative to the others that the head learns from.

With this share, bounds in range become hardly wider. Neighbouring samples resemble each other, so
little is lost by leaving some out."""

QUIETEST = 0.001
"""Quantile of the logarithms in the head's training; it sees no smaller ones, since networks
extrapolate badly. An input at rest may have the logarithm of nothing at all."""


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
