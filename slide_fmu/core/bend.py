"""Inputs that bend between two samples follow a polynomial through points in between."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from slide_fmu.core.signals import FloatArray


@dataclass(frozen=True, eq=False)
class Bend:
    """A bend is the course of inputs that bend within a sample step: a polynomial.

    A solver that takes one step from sample to sample follows it at the cost of a straight line.

    Attributes:
        step: sample step h in s.
        exponents: of the powers of t / h, (parts + 1,).
        coefficients: of these powers, for the inputs and then for their rates in 1/s,
            (parts + 1, 2 n_inputs).
        low, high: what the inputs stay within, (n_inputs,).
    """

    step: float
    exponents: FloatArray
    coefficients: FloatArray
    low: FloatArray
    high: FloatArray

    @staticmethod
    def through(points: FloatArray, step: float, ends: FloatArray) -> Bend:
        """Return the bend through points that are equally far apart in time.

        Args:
            points: inputs at the beginning of the step and at the end of each of its parts, shape
                (parts + 1, n_inputs).
            step: sample step h in s.
            ends: ranges of the inputs, shape (2, n_inputs): points beyond make them wider.
        """
        exponents = np.arange(len(points), dtype=np.float64)
        powers = _through(len(points) - 1) @ points
        slopes = np.roll(exponents[:, None] * powers, -1, axis=0) / step
        low, high = (
            np.minimum(ends[0], points.min(axis=0)),
            np.maximum(ends[1], points.max(axis=0)),
        )
        return Bend(step, exponents, np.hstack([powers, slopes]), low, high)

    def __call__(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Give the inputs and their rates, (n_inputs,) each, at a time in s from 0 to the step."""
        found = (time / self.step) ** self.exponents @ self.coefficients
        count = len(self.low)
        return np.minimum(np.maximum(found[:count], self.low), self.high), found[count:]


@cache
def _through(degree: int) -> FloatArray:
    """Return what makes coefficients of the values at 0, 1 / degree .. 1, lowest power first."""
    at = np.linspace(0.0, 1.0, degree + 1)
    return np.asarray(np.linalg.inv(np.vander(at, increasing=True)))
