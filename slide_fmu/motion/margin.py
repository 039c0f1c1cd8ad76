"""What a prediction may be off by: plans count it in, so that they do not live off errors."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate

ESTIMATES = 2.0
"""An estimate is an RMS error; so many of them stand for a bound of 95 % where there is none."""


def margins(surrogate: Surrogate, inputs: FloatArray) -> FloatArray:
    """Give how far off predictions may be, as a norm over the outputs, (N,).

    It is the error bound of 95 %; without one, twice the error estimate; without both, zero.
    (``what_margins_are`` says which.)

    Args:
        surrogate: what predicts.
        inputs: of a record, (N, n_inputs).
    """
    if surrogate.bound is not None:
        each = surrogate.error_bounds(inputs)
    elif surrogate.estimator is not None:
        each = ESTIMATES * surrogate.estimate_error(inputs)
    else:
        return np.zeros(len(inputs))
    return np.asarray(np.linalg.norm(each, axis=1))


def what_margins_are(surrogate: Surrogate) -> str:
    """Say in words what ``margins`` gives for a surrogate."""
    if surrogate.bound is not None:
        return "the error bound of 95 % confidence"
    if surrogate.estimator is not None:
        return "twice the error estimate, since the FMU has no error bound"
    return "nothing, since the FMU tells no error"


def known(surrogate: Surrogate, inputs: FloatArray, first: int, last: int) -> float:
    """Give the share of the samples first .. last - 1 that are in the domain, or in range.

    Without an error bound the FMU knows of ranges only. Inputs are those of the whole record,
    (N, n_inputs).
    """
    inside = (
        surrogate.inputs_in_range(inputs)
        if surrogate.bound is None
        else surrogate.in_domain(inputs)
    )
    return float(np.mean(inside[first:last]))
