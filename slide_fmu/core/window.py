"""The index law of the sliding window is defined here only.

A network sees the inputs u[s .. s+n_in-1] and gives the outputs y[s+n_in-n_out+1 .. s+n_in]
(paper, section "The SLIDE method"). In a co-simulation step from t_k to t_k + h the newest input
is therefore u(t_k) and the newest output y(t_k + h): no direct feedthrough and no lag.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.given_numbers import given_numbers
from slide_fmu.core.signals import FloatArray

MAX_WINDOW = 1 << 20
"""Largest n_in; protects against damaged files, and is far above any use."""


def checked_batch(name: str, values: NDArray[Any], shape: tuple[int, int]) -> FloatArray:
    """Return values as a batch in float64 whose elements have a shape: (B, samples, channels).

    Raises:
        TypeError: they are no real numbers.
        ValueError: they have another shape; the message starts with the name.
    """
    array = given_numbers(name, values)
    if array.ndim != 3 or array.shape[1:] != shape:
        raise ValueError(f"{name} of shape {array.shape}; expected (B, {shape[0]}, {shape[1]})")
    return array


@dataclass(frozen=True)
class Window:
    """A Window has the lengths of the input window and the truncated output window (paper).

    Attributes:
        step: sample step h in s.
        n_in: number of input samples the network sees.
        n_out: number of output samples it gives, the newest one step after the newest input.

    Raises:
        ValueError: the step is not positive, or not 1 <= n_out <= n_in.
    """

    step: float
    n_in: int
    n_out: int

    def __post_init__(self) -> None:
        if not (math.isfinite(self.step) and self.step > 0):
            raise ValueError(
                f"window step = {self.step} s; expected a positive, finite sample step"
            )
        if not 1 <= self.n_out <= self.n_in:
            raise ValueError(
                f"window n_in = {self.n_in}, n_out = {self.n_out}; expected 1 <= n_out <= n_in"
            )

    @property
    def n_truncated(self) -> int:
        """Return the number of leading samples without an output (n_in - n_out)."""
        return self.n_in - self.n_out

    @property
    def truncation_time(self) -> float:
        """Return the time (n_in - n_out) h in s in which initial effects decay (paper, t_d)."""
        return self.n_truncated * self.step

    @property
    def memory_length(self) -> int:
        """Return the number of inputs that an output may depend on: n_in - n_out + 1."""
        return self.n_truncated + 1

    def starts(self, n_inputs: int, stride: int = 1) -> NDArray[np.int64]:
        """Return the first-sample indices s of all windows within a sequence of inputs."""
        return np.arange(0, n_inputs - self.n_in + 1, stride, dtype=np.int64)

    def input_indices(self, starts: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the input sample indices of windows, shape (len(starts), n_in)."""
        return starts[:, None] + np.arange(self.n_in)

    def output_indices(self, starts: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the output sample indices of windows, shape (len(starts), n_out)."""
        return starts[:, None] + np.arange(self.n_truncated + 1, self.n_in + 1)
