"""The error estimator is a second network, which estimates the error of the first one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.scaling import LogError
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import MAX_WINDOW
from slide_fmu.network.base import Float32Array
from slide_fmu.network.feed_forward.network import FeedForward


@dataclass(frozen=True, eq=False)
class ErrorEstimator:
    """An ErrorEstimator estimates the RMSE of the surrogate over its last samples.

    Attributes:
        network: gives the logarithmic error eps of every output, at one or several positions; or
            first the expected error mu of every output, relative to the standard deviation around
            it, then the eps of that standard deviation.
        log_error: map between eps and the error relative to the scale of the output.
        positions: number of consecutive evaluations whose mean square is taken; 1 if the network
            estimates the error of an output window directly.
        ranges: smallest and largest value of every feature in training, shape (2, n_features).
    """

    network: FeedForward
    log_error: LogError
    positions: int
    ranges: Float32Array

    def require_outputs(self, n_outputs: int) -> None:
        """Reject an error estimator that does not fit this number of outputs.

        Raises:
            ValueError: the number of values, samples or positions is wrong, or the ranges are not
                valid.
        """
        network = self.network
        if network.n_values not in (n_outputs, 2 * n_outputs):
            raise ValueError(
                f"estimator gives {network.n_values} values; expected {n_outputs} or "
                f"{2 * n_outputs}"
            )
        if not 1 <= self.positions <= MAX_WINDOW or network.n_samples > MAX_WINDOW:
            raise ValueError(
                f"estimator sees {network.n_samples} samples at {self.positions} positions; "
                f"expected 1 to {MAX_WINDOW} of both"
            )
        if self.ranges.shape != (2, network.features.n_signals):
            raise ValueError(
                f"estimator with ranges of shape {self.ranges.shape}; expected least and largest "
                f"value of {network.features.n_signals} features"
            )
        for index, (least, largest) in enumerate(self.ranges.T.tolist()):
            if not -math.inf < least <= largest < math.inf:
                raise ValueError(
                    f"estimator whose feature {index} lies in {least:g} .. {largest:g}; expected "
                    "finite numbers, the smaller one first"
                )

    @property
    def memory_length(self) -> int:
        """The number of samples whose features an estimate depends on, over all its positions."""
        return self.network.memory_length + self.positions - 1

    def knows(self, newest: Float32Array) -> NDArray[np.bool_]:
        """Return where features lie in the ranges of the training: (N, n_features) to (N,)."""
        return np.asarray(((newest >= self.ranges[0]) & (newest <= self.ranges[1])).all(axis=1))

    def along(self, scaled: FloatArray, n_outputs: int) -> FloatArray:
        """Estimate squared errors at every sample of a sequence, relative to the outputs' scales.

        Scaled inputs (N, n_inputs) give (N, n_outputs). The first input counts as constant before
        the sequence.
        """
        features = self.network.features.along(scaled[None])
        values = self.network.stream_features(features)[0].astype(np.float64)
        return self.squares(values, features[0], n_outputs)

    def estimates(self, scaled: FloatArray, n_outputs: int) -> FloatArray:
        """Estimate the RMSE over the last positions, relative to the outputs' scales.

        Shapes are as for ``along``.
        """
        squares = self.along(scaled, n_outputs)
        squares = np.concatenate([np.repeat(squares[:1], self.positions - 1, 0), squares])
        views = np.lib.stride_tricks.sliding_window_view(squares, self.positions, axis=0)
        return np.asarray(np.sqrt(views.mean(axis=-1)))

    def squares(self, values: FloatArray, newest: Float32Array, n_outputs: int) -> FloatArray:
        """Form squared errors, (N, n_outputs), relative to the outputs' scales.

        The values of the network, (N, n_outputs) or (N, 2 n_outputs), give e^2 (1 + mu^2), with mu
        = 0 if only eps is given. The result is at most the square of the largest error of the map.
        It is that square if a value is not finite, or if the features of the newest sample, (N,
        n_features), lie outside the ranges of the training.
        """
        eps, mean = values[:, -n_outputs:], values[:, :-n_outputs]
        with np.errstate(over="ignore"):  # the square of a very large error may be inf
            squares = self.log_error.invert(np.minimum(eps, 1.0)) ** 2
            squares = squares * (1 + mean**2) if mean.size else squares
            largest = self.log_error.invert(np.array(1.0)) ** 2
        known = np.isfinite(values).reshape(len(values), -1, n_outputs).all(axis=1)
        known &= self.knows(newest)[:, None]
        return np.where(known, np.minimum(squares, largest), largest)
