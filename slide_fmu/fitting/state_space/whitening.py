"""Residuals are weighted by the noise of what was measured, where its spectrum is known.

Where the noise of an output is n[k] = sum of a_j n[k-j] + e[k] with a white e of deviation s, the
residuals r count as (r[k] - sum of a_j r[k-j]) / s: frequencies and outputs with little noise
count more than those with much. These are the residuals of the greatest likelihood (Ljung, "System
Identification", 1999, section 7.4). The first residuals of a segment, which have fewer before
them, go through shorter predictors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch

from slide_fmu.core.autoregression import Autoregression, fit_autoregression
from slide_fmu.core.signals import FloatArray

OWN_ERROR = 1e-3
"""A network's own errors, beside the noise, are about this part of an output's deviation: so much
white noise is added, and outputs with hardly any noise do not rule a fit."""


@dataclass(frozen=True, eq=False)
class Whitening:
    """A whitening filters residuals along the samples of each segment.

    Attributes:
        taps: factors, shape (q + 1, q + 1, n_outputs): taps[m, j] multiplies the residual j
            samples before, where m residuals of the segment, or at least q, lie before.
    """

    taps: torch.Tensor

    @staticmethod
    def of_noise(noise: Sequence[FloatArray]) -> Whitening:
        """Return the whitening for stretches of noise in scaled units, (N, n_outputs) each.

        Raises:
            ValueError: the stretches have no samples.
        """
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
        the outputs' deviation stays one, of what counts of both.
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
        """Return what filters rows of J and residuals, block by block, and lets them be taken.

        Rows have the shape (samples, B, n_outputs, P), residuals (samples, B, n_outputs); the
        blocks are those of the same segments, in the order of time.
        """
        of_rows, of_residuals = Filter(self), Filter(self)

        def add(rows: torch.Tensor, residuals: torch.Tensor) -> None:
            take(of_rows.advance(rows), of_residuals.advance(residuals))

        return add


class Filter:
    """A filter takes values of segments block by block, and knows those that it needs. Final."""

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
        found = taps[:, 0] * values
        for age in range(1, order + 1):
            found.addcmul_(taps[:, age], whole[order - age : order - age + count])
        self._before, self._samples = whole[count:], self._samples + count
        return found


def _taps(model: Autoregression, order: int) -> torch.Tensor:
    """Return the taps of one output for predictors of its own order at most, (q + 1, q + 1)."""
    taps = torch.zeros(order + 1, order + 1, dtype=torch.float64)
    for known in range(order + 1):
        own = min(known, model.order)
        factor = model.variances[own] ** -0.5
        taps[known, 0] = factor
        taps[known, 1 : own + 1] = -factor * torch.from_numpy(model.predictors[own, :own])
    return taps
