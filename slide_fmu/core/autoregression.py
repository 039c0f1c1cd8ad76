"""Autoregressive models predict noise from its own past and give its spectrum.

The noise n has predictors of all orders up to q: the best prediction of n[k] from the m samples
before it is sum over j = 1 .. m of a_j n[k-j]. The residual of the predictor of order q is
white. The coefficients solve the equations of Yule and Walker, by the recursion of Levinson
and Durbin (Brockwell and Davis, "Time Series: Theory and Methods", 1991, proposition 5.2.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray

MOST_ORDER = 8
"""Largest number of past samples that a predictor sees."""


@dataclass(frozen=True, eq=False)
class Autoregression:
    """An Autoregression has the predictors of a noise, of all orders up to its own.

    Attributes:
        predictors: coefficients a_j, shape (q + 1, q): row m has the m coefficients of order m,
            then zeros.
        variances: variances of the residuals of the predictors, shape (q + 1,); the first one is
            the variance of the noise itself.
    """

    predictors: FloatArray
    variances: FloatArray

    @property
    def order(self) -> int:
        """The longest predictor sees q samples of the past."""
        return len(self.variances) - 1

    @property
    def unpredictable(self) -> float:
        """The part of the noise's deviation that its past does not predict; 1 of white noise."""
        return float(np.sqrt(self.variances[-1] / self.variances[0]))


def fit_autoregression(pieces: Sequence[FloatArray], floor: float = 0.0) -> Autoregression:
    """Fit an autoregression to pieces of one noise, of shapes (N,), about their common mean.

    White noise of the deviation ``floor``, in the unit of the pieces, is added to the estimate, so
    that no part of the spectrum is empty. The order is the one with the smallest Bayesian
    information criterion (Schwarz, 1978).

    Raises:
        ValueError: the pieces have no samples, or one value only and no floor.
    """
    samples = sum(len(piece) for piece in pieces)
    covariances = autocovariances(pieces, MOST_ORDER) if samples else np.zeros(1)
    covariances[0] += floor**2
    if not covariances[0] > 0:
        raise ValueError(
            f"noise of {samples} samples with a deviation of 0; expected some noise: leave out "
            "what has none"
        )
    whole = _levinson_durbin(covariances)
    orders = np.arange(len(covariances))
    criterion = samples * np.log(whole.variances) + orders * np.log(samples)
    order = int(np.argmin(criterion))
    return Autoregression(whole.predictors[: order + 1, :order], whole.variances[: order + 1])


def autocovariances(pieces: Sequence[FloatArray], most: int) -> FloatArray:
    """Estimate the covariances of samples 0 .. most steps apart, shape (most + 1,).

    Products of samples of one piece are divided by the number of all samples, so that the
    covariances are those of a possible noise.
    """
    samples = sum(len(piece) for piece in pieces)
    mean = sum(float(piece.sum()) for piece in pieces) / samples
    covariances = np.zeros(most + 1)
    for piece in pieces:
        centred = piece - mean
        for lag in range(min(most, len(centred) - 1) + 1):
            covariances[lag] += float(centred[lag:] @ centred[: len(centred) - lag])
    return covariances / samples


def _levinson_durbin(covariances: FloatArray) -> Autoregression:
    """Compute the predictors of all orders for covariances, shape (q + 1,)."""
    most = len(covariances) - 1
    predictors, variances = np.zeros((most + 1, most)), np.full(most + 1, covariances[0])
    for order in range(1, most + 1):
        before = predictors[order - 1, : order - 1]
        partial = covariances[order] - before @ covariances[order - 1 : 0 : -1]
        last = partial / variances[order - 1]
        predictors[order, : order - 1] = before - last * before[::-1]
        predictors[order, order - 1] = last
        variances[order] = variances[order - 1] * (1 - last**2)
    return Autoregression(predictors, variances)
