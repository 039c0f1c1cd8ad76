"""Arrays that users give hold real numbers; dates and texts are refused by their type."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray

DATES = "subtract the first one, and divide by numpy.timedelta64(1, 's')"
"""How dates and time differences become times in s."""


def given_numbers(name: str, values: object) -> FloatArray:
    """Return values as an array in float64; None among objects is NaN.

    numpy would read dates as nanoseconds, and complex numbers as their real part.

    Raises:
        TypeError: these are no real numbers, or rows differ in length; the message begins with the
            name.
    """
    try:
        array = np.asarray(values)
        if array.dtype.kind in "fiub":
            return array.astype(np.float64, copy=False)
        if array.dtype.kind == "O":
            return array.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name}: {error}; expected an array of real numbers") from error
    remedy = f": {DATES}" if array.dtype.kind in "mM" else ""
    raise TypeError(f"{name} of type {array.dtype}; expected real numbers{remedy}")
