"""Scalings map physical values to network values and back: apply and invert form a pair."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slide_fmu.core.signals import FloatArray, Signal


@dataclass(frozen=True, eq=False)
class Affine:
    """An Affine maps each channel: scaled = (physical - offset) / scale.

    Attributes:
        offset: shape (n_channels,), in the channels' units.
        scale: shape (n_channels,), in the channels' units, positive.

    Raises:
        ValueError: shapes differ, or a scale is not positive and finite.
    """

    offset: FloatArray
    scale: FloatArray

    def __post_init__(self) -> None:
        if self.offset.ndim != 1 or self.offset.shape != self.scale.shape:
            raise ValueError(
                f"affine scaling: offset of shape {self.offset.shape}, scale of shape "
                f"{self.scale.shape}; expected the same one-dimensional shape"
            )
        if not (np.all(np.isfinite(self.offset)) and np.all(np.isfinite(self.scale))):
            raise ValueError(
                "affine scaling: offset or scale is not finite; expected finite numbers"
            )
        if np.any(self.scale <= 0):
            raise ValueError(
                f"affine scaling: scale {self.scale.tolist()}; expected positive numbers"
            )

    @staticmethod
    def of_channels(offset: ArrayLike, scale: ArrayLike) -> Affine:
        """Build the map from anything that numpy can turn into float64 vectors."""
        return Affine(
            np.atleast_1d(np.asarray(offset, dtype=np.float64)),
            np.atleast_1d(np.asarray(scale, dtype=np.float64)),
        )

    def apply(self, physical: NDArray[Any]) -> NDArray[Any]:
        """Map physical values, shape (..., n_channels), to scaled values of the same shape."""
        return (physical - self.offset) / self.scale

    def invert(self, scaled: NDArray[Any]) -> NDArray[Any]:
        """Map scaled values, shape (..., n_channels), to physical values of the same shape."""
        return scaled * self.scale + self.offset


def range_scaling(signals: tuple[Signal, ...]) -> Affine:
    """Make the scaling that maps the ranges of signals to [-1, 1]."""
    return Affine.of_channels(
        [0.5 * (signal.high + signal.low) for signal in signals],
        [0.5 * (signal.high - signal.low) for signal in signals],
    )


@dataclass(frozen=True)
class LogError:
    """A LogError maps the logarithm of an error in [10**low, 10**high] to [-1, 1].

    With m = (high + low) / 2 and r = (high - low) / 2: eps = (log10 e - m) / r and
    log10 e = m + r eps. The paper prints r in place of m, which is right for high = 0 only.

    Attributes:
        low: log10 of the smallest error, e_minus of the paper.
        high: log10 of the largest error, e_plus of the paper.

    Raises:
        ValueError: low is not smaller than high.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low < self.high):
            raise ValueError(
                f"log error map: low = {self.low}, high = {self.high}; "
                "expected finite decimal exponents, low < high"
            )

    @property
    def middle(self) -> float:
        """The midpoint m of the decimal exponents."""
        return 0.5 * (self.high + self.low)

    @property
    def half_range(self) -> float:
        """Half the range of the decimal exponents, r."""
        return 0.5 * (self.high - self.low)

    def apply(self, error: NDArray[Any]) -> NDArray[Any]:
        """Map positive errors of any shape to logarithmic errors eps of the same shape."""
        return np.asarray((np.log10(error) - self.middle) / self.half_range)

    def invert(self, eps: NDArray[Any]) -> NDArray[Any]:
        """Map logarithmic errors eps to errors of the same shape; very large ones are inf."""
        with np.errstate(over="ignore"):
            return np.asarray(np.power(10.0, self.middle + self.half_range * eps))
