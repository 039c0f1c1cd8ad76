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
        powers: coefficients of the powers of t / h, the highest first, (parts + 1, n_inputs).
        slopes: those of its rate per s, likewise, (parts, n_inputs).
        low, high: what the inputs stay within, (n_inputs,).
    """

    step: float
    powers: FloatArray
    slopes: FloatArray
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
        degree = len(points) - 1
        powers = _through(degree) @ points
        slopes = np.arange(degree, 0, -1)[:, None] * powers[:-1] / step
        low, high = (
            np.minimum(ends[0], points.min(axis=0)),
            np.maximum(ends[1], points.max(axis=0)),
        )
        return Bend(step, powers, slopes, low, high)

    def __call__(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Give the inputs and their rates, (n_inputs,) each, at a time in s from 0 to the step."""
        part = time / self.step
        values = np.minimum(np.maximum(_polynomial(self.powers, part), self.low), self.high)
        return values, _polynomial(self.slopes, part)


def _polynomial(powers: FloatArray, at: float) -> FloatArray:
    """Evaluate polynomials by Horner's scheme."""
    value = powers[0]
    for coefficient in powers[1:]:
        value = value * at + coefficient
    return np.asarray(value)


@cache
def _through(degree: int) -> FloatArray:
    """Return what makes coefficients of the values at 0, 1 / degree .. 1, highest power first."""
    return np.asarray(np.linalg.inv(np.vander(np.linspace(0.0, 1.0, degree + 1))))
