"""The error estimate of a surrogate with an error bound: what its head expects, over a span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.block_means import N_BLOCKS, block_means, span_samples
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import MAX_WINDOW


@dataclass(frozen=True, eq=False)
class SpanEstimate:
    """A SpanEstimate gives the RMSE over the last samples from those that a head expects of each.

    It is a factor times the root of their mean square, over ``N_BLOCKS`` whole blocks of samples
    and the one that has begun.

    Attributes:
        block: samples in a block.
        factors: of each output, shape (n_outputs,).
    """

    block: int
    factors: FloatArray

    def __post_init__(self) -> None:
        most = MAX_WINDOW // (N_BLOCKS + 1)
        if not 1 <= self.block <= most:
            raise ValueError(
                f"error estimate with blocks of {self.block} samples; expected 1 to {most}"
            )
        if not np.all(np.isfinite(self.factors) & (self.factors > 0)):
            raise ValueError(
                f"factors of an error estimate {self.factors.tolist()}; expected them finite and "
                "positive"
            )

    @property
    def samples(self) -> int:
        """Over how many samples an estimate is, on average."""
        return span_samples(self.block)

    def along(self, squares: FloatArray) -> FloatArray:
        """Estimate errors from squares of each sample, both of the shape (B, N, n_outputs)."""
        return np.asarray(np.sqrt(block_means(squares, self.block)) * self.factors)
