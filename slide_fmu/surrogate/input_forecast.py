"""The forecast of moving inputs predicts their values at the end of a step.

An importer that sets u(t) before a step does not know, or does not set, the input's motion within
the step. The C runtime has the same equations (``fmu/runtime/window/forecast.c``).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Signal, cosines_of

BETTER = 0.5
"""A candidate is used only if its mean square error is below this fraction of the held value's. So
after a jump, or with noise, the value is held."""

CUBIC = np.array([[-6.0, 4.0, -1.0]])
"""The cubic through the last four values. Candidates are fitted to motions that change suddenly.
They smooth, so the cubic is far better for smooth motions."""

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

    Raises:
        ValueError: the shapes do not match, or a number is not finite.
    """

    planned: bool = False
    at_step_end: bool = False
    weights: FloatArray = field(default_factory=lambda: np.zeros((1, 0, 1)))
    largest_change: FloatArray = field(default_factory=lambda: np.zeros(1))
    n_scored: int = 24
    sampled: bool = False

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

    def along(
        self, inputs: FloatArray, signals: tuple[Signal, ...], scaling: Affine
    ) -> FloatArray:
        """Forecast each sample of sequences from the samples before it; the first one is known.

        Args:
            inputs: sequences (B, N, n_inputs), in the inputs' units; each counts as constant
                before its first sample.
            signals: the inputs.
            scaling: their scaling; a forecast that begins in its range stays in it.

        Returns:
            Forecasts in the shape and the units of the inputs.
        """
        now = np.concatenate([inputs[:, :1], inputs[:, :-1]], axis=1)
        ahead = np.empty_like(now)
        turning = {index + i for index in cosines_of(signals) for i in (0, 1)}
        for index in cosines_of(signals):
            angles = np.unwrap(np.arctan2(now[:, :, index + 1], now[:, :, index]), axis=1)
            turn = self._changes(index, angles)
            turned = (now[:, :, index] + 1j * now[:, :, index + 1]) * np.exp(1j * turn)
            ahead[:, :, index], ahead[:, :, index + 1] = turned.real, turned.imag
        for index in set(range(inputs.shape[2])) - turning:
            values = now[:, :, index]
            low = np.minimum(values, scaling.offset[index] - scaling.scale[index])
            high = np.maximum(values, scaling.offset[index] + scaling.scale[index])
            ahead[:, :, index] = np.clip(values + self._changes(index, values), low, high)
        return ahead

    def _changes(self, index: int, values: FloatArray) -> FloatArray:
        """Forecast the change after each of an input's values or angles, (B, N), oldest first."""
        if not self.weights.shape[1]:
            return np.zeros_like(values)
        change = np.zeros_like(values)
        held, _ = self._scored(np.zeros((1, 1)), index, values)
        least = BETTER * held[0]
        for weights, better in ((self.weights[index], 1.0), (CUBIC, BETTER)):
            scores, found = self._scored(weights, index, values)
            best = scores.argmin(axis=0)[None]
            score = np.take_along_axis(scores, best, axis=0)[0]
            good = score < better * least
            change = np.where(good, np.take_along_axis(found, best, axis=0)[0], change)
            least = np.where(good, score, least)
        return change

    def _scored(
        self, weights: FloatArray, index: int, values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the squared errors of the last forecasts, and the forecasts, of candidates.

        Both have the shape (n_candidates, B, N).
        """
        n_past, largest = weights.shape[1], self.largest_change[index]
        held = np.pad(values, ((0, 0), (n_past + self.n_scored, 0)), mode="edge")
        views = np.lib.stride_tricks.sliding_window_view(held, n_past + 1, axis=1)[..., ::-1]
        found = changes_of(weights, views.reshape(-1, n_past + 1))
        found = np.clip(found, -largest, largest).reshape(-1, *views.shape[:2])
        true = np.diff(held, axis=1)[:, n_past:]  # of all forecasts except the last
        errors = (true - found[:, :, :-1]) ** 2
        windows = np.lib.stride_tricks.sliding_window_view(errors, self.n_scored, axis=-1)
        return windows.sum(axis=-1), found[:, :, self.n_scored :]


def changes_of(weights: FloatArray, views: NDArray[np.float64]) -> FloatArray:
    """Return the next change by each candidate, shape (n_candidates, N).

    Weights have the shape (n_candidates, n_past), views of the values, newest first, (N, n_past +
    1).
    """
    return np.asarray(weights @ (views[:, 1:] - views[:, :1]).T)
