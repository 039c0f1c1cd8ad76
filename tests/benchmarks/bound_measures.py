"""Measures of error bounds and flags that offline studies use, beside those of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.validation.row import HARMFUL
from slide_fmu.validation.trust import TrustOutputs, rank_correlation

WORST = 0.05
"""Share of the worst trajectories whose best one is given, in addition to the mean of all."""

OFTEN = 0.05
"""A trajectory counts as flagged if more than this part of its samples are."""


@dataclass(frozen=True, kw_only=True)
class OutputBound:
    """These are the measures of the error bound of one output.

    Attributes:
        coverage: share of the samples whose error stays below the bound.
        coverage_of_worst_trajectories: the 5 % worst trajectories have less.
        width: mean bound over the quantile of the errors.
        skill: 1 minus the ratio of the pinball losses of the bound and of the best constant.
        rank_correlation: of bounds and errors; None where one of both is constant.
    """

    name: str
    coverage: float
    coverage_of_worst_trajectories: float
    width: float | None
    skill: float | None
    rank_correlation: float | None


@dataclass(frozen=True, kw_only=True)
class DomainFigures:
    """These are the shares of samples outside of the domain, and of trajectories often outside.

    Attributes:
        untrusted: share of samples at which ``trusted`` is false.
    """

    flagged: float
    trajectories_flagged: float
    untrusted: float


@dataclass(frozen=True, kw_only=True)
class Harm:
    """This is the harm that errors do, as shares of samples.

    A sample is flagged where ``trusted`` is false.

    Attributes:
        harmful: samples with an error far above the usual one.
        harmful_flagged: share of these that are flagged; None without any.
        harmless_flagged: the same share of the harmless samples.
        harmful_unnoticed: harmful ones, not flagged, whose bound does not cover the error.
    """

    harmful: float
    harmful_flagged: float | None
    harmless_flagged: float | None
    harmful_unnoticed: float


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


def pinball_loss(errors: FloatArray, bounds: FloatArray) -> float:
    """Return the mean pinball loss of bounds of absolute errors at the usual confidence.

    It is least, on average, for the quantile itself (Koenker and Bassett, 1978).
    """
    below = errors - bounds
    confidence = USUAL_CONFIDENCE
    return float(np.mean(np.maximum(confidence * below, (confidence - 1.0) * below)))
