"""This module measures how far error estimates and bounds of an FMU can be trusted.

The measures have no floor. Each is compared with its value for the best constant on the same
samples: the constant knows the distribution of the errors, but not the error of a single sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import best_constant
from slide_fmu.core.signals import FloatArray
from slide_fmu.validation.error_figures import Deviation, ToleranceRow

TOO_SMALL = 2.0
"""An error estimate was too small where the true error is more than this many times as large."""

MOST_TOO_SMALL = 1e9
"""An estimate of zero counts as too small by this factor."""

ALARMS = (0.005, 0.01, 0.02, 0.04, 0.08)
"""Shares of false alarms in range for which tolerances are given."""


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
    rising, tolerances_by_alarms = np.sort(ratios), []
    for alarms in ALARMS:
        factor = float(rising[len(rising) - 1 - int(alarms * len(rising))])
        known = tuple((factor * tolerances).tolist()) if np.isfinite(factor) else None
        tolerances_by_alarms.append(ToleranceRow(alarms=alarms, tolerances=known))
    return tuple(tolerances_by_alarms)


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
