"""The parts of a surrogate are checked against each other, and inputs against their ranges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.given_numbers import given_numbers
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Signal, check_inputs, cosines_of, hold_of
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.input_forecast import InputForecast

START_TOLERANCE = 1e-12
"""A start may lie outside offset -+ scale by this, relative to |offset| + scale (rounding)."""

RANGE_SLACK = 1e-4
"""Scaled inputs range from -1 to 1; they may lie outside by this: planned motions go along curves,
which reach a little beyond their samples."""

LENGTH_SLACK = 0.01
"""The length of an angle's cosine and sine, 1 in training, may differ by this."""


def check_signals(
    inputs: tuple[Signal, ...], outputs: tuple[Signal, ...], scaling: Affine
) -> None:
    """Reject inputs that do not match each other, and angles that are scaled off the circle.

    ``scaling`` belongs to the inputs; outputs have neither hold nor angle.

    Raises:
        ValueError: the message has the signal and the expectation.
    """
    check_inputs(inputs)
    for signal in outputs:
        if (signal.hold, signal.angle) != ("zero_order", None):
            raise ValueError(
                f"output {signal.name!r} with hold {signal.hold!r} and angle {signal.angle!r}; "
                "expected neither: only inputs act between samples"
            )
    for index in cosines_of(inputs):
        pair = slice(index, index + 2)
        offset, scale = scaling.offset[pair].tolist(), scaling.scale[pair].tolist()
        if offset != [0.0, 0.0] or scale[0] != scale[1]:
            raise ValueError(
                f"inputs {index} and {index + 1} are cosine and sine of an angle with offsets "
                f"{offset} and scales {scale}; expected offsets of 0 and one scale for both"
            )


def check_bound(
    name: str, bound: ErrorBound, fits: bool, estimator: ErrorEstimator | None
) -> None:
    """Reject an error bound that does not fit a surrogate.

    Args:
        name: name of the surrogate.
        bound: its error bound.
        fits: whether its network is a state-space network without physical parameters.
        estimator: its error estimator.

    Raises:
        ValueError: the network does not fit, or the bound does not use the surrogate's estimator:
            files of such bounds could not be read.
    """
    if not fits:
        raise ValueError(
            f"surrogate {name!r} with an error bound; expected one only of state-space "
            "networks without physical parameters"
        )
    if bound.estimator is not estimator:
        raise ValueError(
            f"surrogate {name!r} with an error bound that uses "
            f"{'no' if bound.estimator is None else 'another'} error estimator; expected "
            f"{'none' if estimator is None else 'its own'}: fit the bound again"
        )


def check_forecast(forecast: InputForecast | None, inputs: tuple[Signal, ...]) -> None:
    """Reject a forecast that does not belong to these inputs.

    Raises:
        ValueError: the number of inputs differs, or they have a zero-order hold.
    """
    if forecast is None:
        return
    if hold_of(inputs) != "first_order" or len(forecast.weights) != len(inputs):
        raise ValueError(
            f"forecast of {len(forecast.weights)} inputs with a first-order hold; expected "
            f"{len(inputs)}, and the inputs have the hold {hold_of(inputs)!r}"
        )


def check_starts(scaling: Affine, inputs: tuple[Signal, ...]) -> None:
    """Reject start values of inputs that do not lie in offset -+ scale, the scaled range.

    Raises:
        ValueError: the message has the input.
    """
    rows = zip(scaling.offset.tolist(), scaling.scale.tolist(), inputs, strict=True)
    for index, (offset, scale, signal) in enumerate(rows):
        allowed = scale + START_TOLERANCE * (abs(offset) + scale)
        start = signal.start_value
        if not (math.isfinite(start) and abs(start - offset) <= allowed):
            raise ValueError(
                f"input {index} starts at {start:g}, but its scaling covers {offset - scale:g} to "
                f"{offset + scale:g}; scale the input by its range"
            )


def checked_inputs(
    inputs: NDArray[Any], signals: tuple[Signal, ...], leading: str = ""
) -> FloatArray:
    """Return inputs in their units as float64, shape (samples, n_inputs).

    ``leading`` names an axis in front of the samples, followed by a comma.

    Raises:
        TypeError: values are no real numbers.
        ValueError: wrong number of channels, no samples, or values that are not finite.
    """
    array = given_numbers("inputs", inputs)
    axes = 3 if leading else 2
    if array.ndim != axes or array.shape[-1] != len(signals) or array.size == 0:
        names = [signal.name for signal in signals]
        raise ValueError(
            f"inputs of shape {array.shape}; expected ({leading}samples, {len(names)}) for "
            f"{names}, at least one sample"
        )
    if not np.all(np.isfinite(array)):
        where = tuple(np.argwhere(~np.isfinite(array))[0])
        raise ValueError(
            f"input {signals[where[-1]].name!r} at sample {where[-2]} is {array[where]}; "
            "expected finite values"
        )
    return array


def in_ranges(signals: tuple[Signal, ...], scaled: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which scaled inputs lie in their ranges: (N, n_inputs) to (N,)."""
    inside = np.abs(scaled) <= 1 + RANGE_SLACK
    for cosine in cosines_of(signals):
        lengths = np.hypot(scaled[:, cosine], scaled[:, cosine + 1])
        inside[:, cosine : cosine + 2] = (np.abs(lengths - 1) <= LENGTH_SLACK)[:, None]
    return np.asarray(inside.all(axis=1))


def inside_throughout(inside: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Return where the newest ``count`` samples are all inside, (N,); the first is held before."""
    samples = np.arange(len(inside))
    strayed = np.maximum.accumulate(np.where(inside, -count, samples))
    return np.asarray(samples - strayed >= count)
