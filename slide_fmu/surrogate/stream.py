"""A surrogate along a record that comes step by step, as the FMU sees it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.base import ParametricStepper, Stepper
from slide_fmu.surrogate.checks import checked_inputs
from slide_fmu.surrogate.ranges import in_ranges

if TYPE_CHECKING:
    from slide_fmu.surrogate.surrogate import Surrogate


class Stream:
    """A Stream evaluates a surrogate step by step: newest output only, as the FMU does. Final."""

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate
        estimator = surrogate.estimator
        self._predictor: Stepper = surrogate.network.stepper()
        self._estimator = None if estimator is None else estimator.network.stepper()
        self._squares: FloatArray | None = None
        self._parameters: dict[str, float] = {}
        self._inside = math.inf  # newest samples in range

    def step(self, inputs: NDArray[Any]) -> tuple[FloatArray, FloatArray | None]:
        """Take the input of one communication step.

        Args:
            inputs: shape (n_inputs,), in the inputs' units.

        Returns:
            Outputs at the end of the step, shape (n_outputs,), and the error estimate of the
            same shape, or None without an estimator. Error bounds, and estimates that are made of
            them, are those of ``Surrogate.error_bounds`` and ``Surrogate.estimate_error``.

        Raises:
            ValueError: wrong number of inputs or values that are not finite.
        """
        surrogate = self.surrogate
        row = checked_inputs(np.asarray(inputs)[None, :], surrogate.inputs)[0]
        scaled = surrogate.input_scaling.apply(row)
        values = self._predictor.step(scaled)[-len(surrogate.outputs) :]
        self._inside = self._inside + 1 if in_ranges(surrogate.inputs, scaled[None])[0] else 0
        estimates = self._estimate(scaled)
        return surrogate.output_scaling.invert(values.astype(np.float64)), estimates

    def set_parameters(self, parameters: Mapping[str, float]) -> None:
        """Change physical parameters from the next step on; what the network remembers is kept.

        Those that are not given keep their values.

        Raises:
            ValueError: as for ``Surrogate.at``.
        """
        given = {**self._parameters, **parameters}
        network = self.surrogate.at(given).network
        self._parameters = given
        if isinstance(self._predictor, ParametricStepper):
            self._predictor.change(network)

    @property
    def inputs_in_range(self) -> bool:
        """Give what ``Surrogate.inputs_in_range`` says of the last sample."""
        return self._inside >= self.surrogate.network.memory_length

    @property
    def truncation_error(self) -> FloatArray | None:
        """The last measured truncation error of the outputs, shape (n_outputs,), in their units.

        None before the first step, and for networks that do not measure it.
        """
        error = self._predictor.truncation_error
        scale = self.surrogate.output_scaling.scale
        return None if error is None else np.asarray(error.astype(np.float64) * scale)

    def _estimate(self, scaled: FloatArray) -> FloatArray | None:
        estimator = self.surrogate.estimator
        if estimator is None or self._estimator is None:
            return None
        values = self._estimator.step(scaled)[None].astype(np.float64)
        newest = self._estimator.newest[None]
        square = estimator.squares(values, newest, len(self.surrogate.outputs))
        if self._squares is None:
            self._squares = np.repeat(square, estimator.positions, axis=0)
        self._squares = np.concatenate([self._squares[1:], square])
        return np.asarray(
            np.sqrt(self._squares.mean(axis=0)) * self.surrogate.output_scaling.scale
        )
