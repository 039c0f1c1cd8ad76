"""What a prediction may be off by: plans count it in, so that they do not live off errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate

ESTIMATES = 2.0
"""An estimate is an RMS error; so many of them stand for a bound of 95 % where there is none."""


@dataclass(frozen=True, eq=False)
class Judged:
    """What is known of predictions along a record of N samples.

    Attributes:
        margins: how far off they may be, as a norm over the outputs, (N,): the error bound of
            95 %; without one, twice the error estimate; without both, zero
            (``what_margins_are`` says which).
        known: whether each sample is in the surrogate's domain, or, where it has no error bound,
            its inputs in their ranges, (N,).
    """

    margins: FloatArray
    known: NDArray[np.bool_]


def judge(surrogate: Surrogate, records: FloatArray) -> list[Judged]:
    """Say how far off predictions may be, and where the surrogate knows the inputs.

    Args:
        surrogate: what predicts.
        records: inputs of whole records, (B, N, n_inputs).
    """
    if surrogate.bound is not None:
        found = surrogate.error_bounds_and_domain(records)
        return [Judged(_norms(each), known) for each, known in found]
    return [_estimated(surrogate, inputs) for inputs in records]


def _estimated(surrogate: Surrogate, inputs: FloatArray) -> Judged:
    """Judge a record, (N, n_inputs), without an error bound."""
    known = surrogate.inputs_in_range(inputs)
    if surrogate.estimates_errors:
        return Judged(_norms(ESTIMATES * surrogate.estimate_error(inputs)), known)
    return Judged(np.zeros(len(inputs)), known)


def _norms(each: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(each, axis=1))


def what_margins_are(surrogate: Surrogate) -> str:
    """Say in words what ``margins`` gives for a surrogate."""
    if surrogate.bound is not None:
        return "the error bound of 95 % confidence"
    if surrogate.estimates_errors:
        return "twice the error estimate, since the FMU has no error bound"
    return "nothing, since the FMU tells no error"
