"""Measurements are checked for a surrogate, and divided into scored and other samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.given_numbers import given_numbers
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.surrogate.checks import checked_inputs
from slide_fmu.surrogate.surrogate import Surrogate

Arrays = NDArray[Any] | Sequence[NDArray[Any]]
"""The values of one record, or of several."""

FEWEST = 20
"""Smallest number of scored samples for each parameter; fewer give no uncertainty."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measurements are records of inputs and outputs, whose beginning is not scored.

    The inputs before a record are unknown: outputs count from the sample on that no longer depends
    on them.

    Attributes:
        inputs: inputs of each record, shape (N, n_inputs), in their units.
        scored: measured outputs of all records that count, one after the other, shape (T,
            n_outputs), in the outputs' units; NaN where nothing was measured.
        lead: number of samples at the beginning of each record that do not count.
        left_out: lengths of the records of which nothing counts, since they are not longer.
    """

    inputs: tuple[FloatArray, ...]
    scored: FloatArray
    lead: int
    left_out: tuple[int, ...] = ()

    @staticmethod
    def of(
        surrogate: Surrogate, inputs: Arrays, outputs: Arrays, n_parameters: int
    ) -> Measurements:
        """Check records; records that are too short to count are left out.

        Args:
            surrogate: the surrogate of the measured system.
            inputs, outputs: as for ``calibrate``.
            n_parameters: number of parameters to fit.

        Raises:
            ValueError: shapes do not fit, inputs are not finite, or too few samples count.
        """
        pairs = list(zip(_records(inputs), _records(outputs), strict=False))
        if len(_records(inputs)) != len(_records(outputs)):
            raise ValueError(
                f"{len(_records(inputs))} records of inputs and {len(_records(outputs))} of "
                "outputs; expected one of outputs for each of inputs"
            )
        lead, kept = surrogate.window.n_truncated, []
        for driven, measured in pairs:
            checked = checked_inputs(driven, surrogate.inputs)
            kept.append((checked, _checked_outputs(measured, len(checked), surrogate.outputs)))
        left_out = tuple(len(u) for u, _ in kept if len(u) <= lead)
        kept = [(u, y) for u, y in kept if len(u) > lead]
        width = len(surrogate.outputs)
        scored = np.concatenate([np.empty((0, width)), *(y[lead:] for _, y in kept)])
        count = int(np.isfinite(scored).any(axis=1).sum())
        if count < FEWEST * n_parameters:
            step = surrogate.window.step
            raise ValueError(
                f"{count} samples remain after the first {lead} of each record, before which "
                f"the inputs are unknown; expected at least {FEWEST * n_parameters} for "
                f"{n_parameters} parameters: record at least "
                f"{(lead + FEWEST * n_parameters) * step:.3g} s without a break"
            )
        return Measurements(tuple(u for u, _ in kept), scored, lead, left_out)

    @property
    def deviations(self) -> FloatArray:
        """The standard deviation of each measured output, shape (n_outputs,); 0 for others."""
        known = np.isfinite(self.scored)
        counts = np.maximum(known.sum(axis=0), 1)
        middle = np.where(known, self.scored, 0).sum(axis=0) / counts
        off = np.where(known, self.scored - middle, 0)
        return np.asarray(np.sqrt((off**2).sum(axis=0) / counts))

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Whether each output was measured at all, shape (n_outputs,)."""
        return np.asarray(np.isfinite(self.scored).any(axis=0))


def _records(values: Arrays) -> list[NDArray[Any]]:
    return [values] if isinstance(values, np.ndarray) else list(values)


def _checked_outputs(values: NDArray[Any], count: int, signals: tuple[Signal, ...]) -> FloatArray:
    array = given_numbers("outputs", values)
    if array.shape != (count, len(signals)):
        raise ValueError(
            f"outputs of shape {array.shape}; expected ({count}, {len(signals)}): as many samples "
            f"as the inputs, and a column for each of {[signal.name for signal in signals]}"
        )
    if np.isinf(array).any():
        raise ValueError("outputs: a value is infinite; expected numbers, or NaN where none is")
    return array
