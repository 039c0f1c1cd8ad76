"""The forecast of moving inputs predicts their values at the end of a step.

An importer that sets u(t) before a step does not know, or does not set, the input's motion within
the step. The C runtime makes the forecast (``fmu/runtime/window/forecast.c``).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray

BETTER = 0.5
"""A candidate is used only if its mean square error is below this fraction of the held value's. So
after a jump, or with noise, the value is held."""

MAX_CANDIDATES, MAX_PAST, MAX_SCORED = 8, 8, 64
"""Largest sizes in a file; protect against damaged files."""


@dataclass(frozen=True, eq=False)
class InputForecast:
    """An InputForecast predicts inputs with a first-order hold.

    Candidate c predicts that an input changes by sum_i weights[c, i - 1] (u(t - i H) - u(t)) in a
    step of the length H, i = 1, 2, ... A held value, a straight line and a parabola are such sums,
    for any H, and constants stay constant. At every step the candidate is used whose forecasts of
    the last inputs were the best, if they were clearly better than the held value. The cubic
    through the last values is used where it was clearly better than these. For an angle, given by
    cosine and sine, the turn is forecast.

    Attributes:
        planned: whether the inputs are planned motions, known ahead, whose curves between samples
            come from the model.
        sampled: whether the network takes input samples as they are, even if the inputs are curved
            between them: it was trained so, or on measured records, where the motion between
            samples is unknown.
        at_step_end: start value of the FMU's parameter ``inputs_at_step_end``: whether a value
            that is set counts as reached by the end of the step, so that nothing is forecast. Only
            FMUs inside an SSP start with 1.
        weights: shape (n_inputs, n_candidates, n_past); the weights of an angle are in the row of
            its cosine.
        largest_change: largest change in a sample step, in the inputs' units; for an angle its
            turn in rad; shape (n_inputs,). Forecasts are clipped to it.
        n_scored: number of inputs whose forecasts decide which candidate is used.
        jumps: whether inputs of the training jumped between samples, at any time, up to the
            largest change. Else a jump is what is much faster than the largest change in a step.

    Raises:
        ValueError: the shapes do not match, or a number is not finite.
    """

    planned: bool = False
    at_step_end: bool = False
    weights: FloatArray = field(default_factory=lambda: np.zeros((1, 0, 1)))
    largest_change: FloatArray = field(default_factory=lambda: np.zeros(1))
    n_scored: int = 24
    sampled: bool = False
    jumps: bool = False

    def __post_init__(self) -> None:
        shape, changes = self.weights.shape, self.largest_change
        fits = len(shape) == 3 and changes.shape == shape[:1]
        if not (fits and shape[1] <= MAX_CANDIDATES and 1 <= shape[2] <= MAX_PAST):
            raise ValueError(
                f"forecast with weights of shape {shape} and largest changes of shape "
                f"{changes.shape}; expected (n_inputs, up to {MAX_CANDIDATES}, 1 to {MAX_PAST}) "
                "and (n_inputs,)"
            )
        if not 1 <= self.n_scored <= MAX_SCORED:
            raise ValueError(f"forecast by {self.n_scored} samples; expected 1 to {MAX_SCORED}")
        if not (np.all(np.isfinite(self.weights)) and np.all(np.isfinite(changes))):
            raise ValueError("forecast with numbers that are not finite; expected finite ones")
        if np.any(changes < 0):
            raise ValueError(f"forecast with largest changes {changes}; expected none below 0")


def changes_of(weights: FloatArray, views: NDArray[np.float64]) -> FloatArray:
    """Return the next change by each candidate, shape (n_candidates, N).

    Weights have the shape (n_candidates, n_past), views of the values, newest first, (N, n_past +
    1).
    """
    return np.asarray(weights @ (views[:, 1:] - views[:, :1]).T)
