"""This module measures how far error estimates and bounds of an FMU can be trusted.

The measures have no floor. Each is compared with its value for the best constant on the same
samples: the constant knows the distribution of the errors, but not the error of a single sample.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import best_constant
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.validation.error_figures import Deviation
from slide_fmu.validation.trust_figures import DomainFigures, Harm, OutputBound, ToleranceRow

WORST = 0.05
"""Share of the worst trajectories whose best one is given, in addition to the mean of all."""

TINY = sys.float_info.min
"""Pictures with logarithmic axes show nothing smaller."""

BROKEN = 2.0
"""A bound counts as broken where the error is more than this many times as large."""

HARMFUL = 3.0
"""An error is harmful if it is larger than the usual error by this factor."""

TOO_SMALL = 2.0
"""An error estimate was too small where the true error is more than this many times as large."""

MOST_TOO_SMALL = 1e9
"""An estimate of zero counts as too small by this factor."""

ALARMS = (0.005, 0.01, 0.02, 0.04, 0.08)
"""Shares of false alarms in range for which tolerances are given."""

OFTEN = 0.05
"""A trajectory counts as flagged if more than this part of its samples are."""


@dataclass(frozen=True, eq=False)
class TrustOutputs:
    """TrustOutputs are bounds, novelty and domain that an FMU gave along N samples.

    Attributes:
        bounds: of the errors, at the usual confidence, in the outputs' units, (N, n_outputs).
        novelty: 1 at the edge of the domain, (N,).
        in_domain: 1 where the FMU counted the sample as part of its domain, else 0, (N,).
        trusted: 1 where the FMU was counted as right by all its signs, else 0, (N,).
    """

    bounds: FloatArray
    novelty: FloatArray
    in_domain: FloatArray
    trusted: FloatArray

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """Where the FMU reported that it may be wrong, (N,)."""
        return np.asarray(self.trusted == 0)

    def part(self, part: slice) -> TrustOutputs:
        """Return a part of the samples."""
        flags = self.in_domain[part], self.trusted[part]
        return TrustOutputs(self.bounds[part], self.novelty[part], *flags)


def output_bound(
    name: str, errors: Sequence[FloatArray], bounds: Sequence[FloatArray]
) -> OutputBound:
    """Measure bounds of one output, both absolute, (N,) of each trajectory.

    Width and skill are None of errors that are zero.
    """
    shares = [float(np.mean(e <= b)) for e, b in zip(errors, bounds, strict=True)]
    error, bound = np.concatenate(errors), np.concatenate(bounds)
    constant = float(np.quantile(error, USUAL_CONFIDENCE))
    best = pinball_loss(error, np.full(len(error), constant))
    return OutputBound(
        name=name,
        coverage=float(np.mean(error <= bound)),
        coverage_of_worst_trajectories=float(np.quantile(shares, WORST, method="lower")),
        width=float(np.mean(bound)) / constant if constant else None,
        skill=1.0 - pinball_loss(error, bound) / best if best else None,
        rank_correlation=rank_correlation(bound, error),
    )


def domain_figures(answers: Sequence[TrustOutputs]) -> DomainFigures:
    """Return the shares of samples outside of the domain or not trusted, and of trajectories."""
    outside = [float(np.mean(t.in_domain == 0)) for t in answers]
    samples = np.concatenate([t.in_domain == 0 for t in answers])
    return DomainFigures(
        flagged=float(np.mean(samples)),
        trajectories_flagged=float(np.mean(np.array(outside) > OFTEN)),
        untrusted=float(np.mean(np.concatenate([t.flagged for t in answers]))),
    )


def tolerance_rows(
    bounds: FloatArray, outside: NDArray[np.bool_], tolerances: FloatArray
) -> tuple[ToleranceRow, ...]:
    """Return the tolerances with which the shares ``ALARMS`` of some samples are not trusted.

    All tolerances are multiplied by one factor.

    Args:
        bounds: at the usual confidence, shape (N, n_outputs).
        outside: samples that are never trusted, whatever the tolerances are, (N,).
        tolerances: those of the FMU, (n_outputs,), in the units of the bounds.
    """
    ratios = np.where(outside, np.inf, (bounds / tolerances).max(axis=1))
    rising, found = np.sort(ratios), []
    for alarms in ALARMS:
        factor = float(rising[len(rising) - 1 - int(alarms * len(rising))])
        known = tuple((factor * tolerances).tolist()) if np.isfinite(factor) else None
        found.append(ToleranceRow(alarms=alarms, tolerances=known))
    return tuple(found)


def harm_of(
    errors: Sequence[FloatArray], answers: Sequence[TrustOutputs], usual: FloatArray
) -> Harm:
    """Measure how many errors are harmful, and how many of them the FMU does not report.

    A sample is harmful if an error, absolute, (N, n_outputs) of each trajectory, is larger than
    ``HARMFUL`` times the 95 % quantile of the errors in range, ``usual``, (n_outputs,).
    """
    error = np.concatenate(errors)
    above = error > np.concatenate([t.bounds for t in answers])
    flagged = np.concatenate([t.flagged for t in answers])
    large = error > HARMFUL * usual
    harmful, unnoticed = large.any(axis=1), (large & above).any(axis=1) & ~flagged
    return Harm(
        harmful=float(np.mean(harmful)),
        harmful_flagged=_share(flagged[harmful]),
        harmless_flagged=_share(flagged[~harmful]),
        harmful_unnoticed=float(np.mean(unnoticed)),
    )


def _share(flags: NDArray[np.bool_]) -> float | None:
    return float(np.mean(flags)) if len(flags) else None


def deviation_of(estimates: FloatArray, errors: FloatArray, name: str | None = None) -> Deviation:
    """Measure estimates of RMS errors, both (N,), where the errors are positive.

    At least one error must be positive. The name is the output's; None for a norm of all outputs.
    Errors of more than ``TOO_SMALL`` times their estimate count as much larger than it.
    """
    known = errors > 0
    estimate, error = estimates[known], errors[known]
    mean, p95 = _deviations(estimate, error)
    constant_mean, constant_p95 = _deviations(best_constant(error), error)
    above = error / np.maximum(estimate, error / MOST_TOO_SMALL)
    return Deviation(
        name=name,
        mean=mean,
        p95=p95,
        constant_mean=constant_mean,
        constant_p95=constant_p95,
        too_small_share=float(np.mean(above > TOO_SMALL)),
        too_small_factor=float(np.quantile(above, 0.95)),
        rank_correlation=rank_correlation(estimate, error),
    )


def pinball_loss(errors: FloatArray, bounds: FloatArray) -> float:
    """Return the mean pinball loss of bounds of absolute errors at the usual confidence.

    It is least, on average, for the quantile itself (Koenker and Bassett, 1978).
    """
    below = errors - bounds
    confidence = USUAL_CONFIDENCE
    return float(np.mean(np.maximum(confidence * below, (confidence - 1.0) * below)))


def rank_correlation(one: FloatArray, other: FloatArray) -> float | None:
    """Return Spearman's rank correlation, or None where one of both is constant."""
    if np.ptp(one) == 0 or np.ptp(other) == 0:
        return None
    from scipy.stats import spearmanr  # slow to import, and the command line does not need it

    return float(spearmanr(one, other).statistic)


def _deviations(estimates: FloatArray | float, errors: FloatArray) -> tuple[float, float]:
    """Return mean and 95 % quantile of the relative deviation."""
    values = np.abs(estimates - errors) / errors
    return float(np.mean(values)), float(np.quantile(values, 0.95))
