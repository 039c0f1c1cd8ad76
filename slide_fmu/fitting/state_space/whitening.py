"""Residuals are weighted by the noise of measured outputs, if its spectrum is known.

If the noise of an output is n[k] = sum of a_j n[k-j] + e[k] with a white e of deviation s, the
residuals r count as (r[k] - sum of a_j r[k-j]) / s: frequencies and outputs with little noise have
larger weights. This is the maximum likelihood estimate (Ljung, "System Identification", 1999,
section 7.4). The first residuals of a segment, with fewer before them, use shorter predictors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

import torch

from slide_fmu.core.autoregression import Autoregression, fit_autoregression
from slide_fmu.core.signals import FloatArray

OWN_ERROR = 1e-3
"""Assumed error of a network in addition to the noise, relative to an output's deviation: white
noise of this size is added, so that outputs with hardly any noise do not dominate a fit."""


@dataclass(frozen=True, eq=False)
class Whitening:
    """A Whitening filters residuals along the samples of each segment.

    Attributes:
        taps: factors, shape (q + 1, q + 1, n_outputs): taps[m, j] multiplies the residual j
            samples before, if m residuals of the segment precede, or at least q.
    """

    taps: torch.Tensor

    @staticmethod
    def of_noise(noise: Sequence[FloatArray]) -> Whitening:
        """Return the whitening for pieces of noise in scaled units, (N, n_outputs) each."""
        outputs = range(noise[0].shape[1])
        models = [fit_autoregression([part[:, k] for part in noise], OWN_ERROR) for k in outputs]
        order = max(model.order for model in models)
        return Whitening(torch.stack([_taps(model, order) for model in models], 2))

    def to(self, like: torch.Tensor) -> Whitening:
        """Return the whitening with the precision, and on the device, of a tensor."""
        return Whitening(self.taps.to(like))

    def of_output(self, number: int) -> Whitening:
        """Return the whitening of one output."""
        return Whitening(self.taps[:, :, number : number + 1])

    def normalised(self, targets: torch.Tensor) -> Whitening:
        """Return the whitening times the factor that keeps the mean square of targets.

        The targets, (samples, B, n_outputs), are taken about their mean. So an error relative to
        the outputs' deviation remains a relative error, with both filtered.
        """
        centred = targets - targets.mean((0, 1))
        size = centred.square().mean() / self.along(centred).square().mean()
        return Whitening(size.sqrt() * self.taps)

    def along(self, values: torch.Tensor) -> torch.Tensor:
        """Filter values of whole segments, shape (samples, B, n_outputs, ...)."""
        return Filter(self).advance(values)

    def streamed(
        self, take: Callable[[torch.Tensor, torch.Tensor], None]
    ) -> Callable[[torch.Tensor, torch.Tensor], None]:
        """Return a function that filters rows of J and residuals, block by block.

        Rows have the shape (samples, B, n_outputs, P), residuals (samples, B, n_outputs); the
        blocks belong to the same segments, in the order of time.
        """
        of_rows, of_residuals = Filter(self), Filter(self)

        def add(rows: torch.Tensor, residuals: torch.Tensor) -> None:
            take(of_rows.advance(rows), of_residuals.advance(residuals))

        return add


@final
class Filter:
    """A Filter takes values of segments block by block, and stores those that it needs."""

    def __init__(self, whitening: Whitening) -> None:
        self._taps = whitening.taps
        self._before: torch.Tensor | None = None
        self._samples = 0

    def advance(self, values: torch.Tensor) -> torch.Tensor:
        """Filter the next values, shape (samples, B, n_outputs, ...)."""
        order, count = len(self._taps) - 1, len(values)
        if self._before is None:
            self._before = values.new_zeros(order, *values.shape[1:])
        known = torch.arange(self._samples, self._samples + count, device=values.device)
        taps = self._taps[known.clamp_max(order)]  # (samples, q + 1, n_outputs)
        taps = taps.reshape(count, order + 1, 1, -1, *[1] * (values.ndim - 3))
        whole = torch.cat([self._before, values])
        whitened = taps[:, 0] * values
        for age in range(1, order + 1):
            whitened.addcmul_(taps[:, age], whole[order - age : order - age + count])
        self._before, self._samples = whole[count:], self._samples + count
        return whitened


def _taps(model: Autoregression, order: int) -> torch.Tensor:
    """Return the taps of one output for predictors up to its own order, (q + 1, q + 1)."""
    taps = torch.zeros(order + 1, order + 1, dtype=torch.float64)
    for known in range(order + 1):
        own = min(known, model.order)
        factor = model.variances[own] ** -0.5
        taps[known, 0] = factor
        taps[known, 1 : own + 1] = -factor * torch.from_numpy(model.predictors[own, :own])
    return taps
