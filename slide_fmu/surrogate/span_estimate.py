"""The error estimate of a surrogate with an error bound averages expected errors over a span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.block_means import N_BLOCKS, block_means, span_samples
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import MAX_WINDOW


@dataclass(frozen=True, eq=False)
class SpanEstimate:
    """A SpanEstimate gives the RMSE over the last samples from the errors that a head expects.

    It is a factor times the root of their mean square, over ``N_BLOCKS`` whole blocks of samples
    and the block that has begun.

    Attributes:
        block: number of samples in a block.
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
        """The average number of samples that an estimate covers."""
        return span_samples(self.block)

    def along(self, squares: FloatArray) -> FloatArray:
        """Estimate errors from squares of each sample, both of shape (B, N, n_outputs)."""
        return np.asarray(np.sqrt(block_means(squares, self.block)) * self.factors)
