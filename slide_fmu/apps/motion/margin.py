"""The margin is the largest expected error of a prediction; plans include it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate

ESTIMATES = 2.0
"""Factor from an RMS error estimate to a 95 % margin, if there is no error bound."""


@dataclass(frozen=True, eq=False)
class Judged:
    """Judged has the reliability of predictions along a sequence of N samples.

    Attributes:
        margins: largest expected error, as a norm over the outputs, (N,): the error bound of 95 %;
            without one, twice the error estimate; without both, zero (``what_margins_are`` says
            which).
        known: whether each sample is in the surrogate's domain, or, without an error bound, its
            inputs in their ranges, (N,).
    """

    margins: FloatArray
    known: NDArray[np.bool_]


def judge(surrogate: Surrogate, sequences: FloatArray) -> list[Judged]:
    """Return the margins of predictions, and where the surrogate knows the inputs.

    Args:
        surrogate: the surrogate that predicts.
        sequences: inputs of whole motions, (B, N, n_inputs).
    """
    if surrogate.bound is not None:
        found = surrogate.error_bounds_and_domain(sequences)
        return [Judged(_norms(each), known) for each, known in found]
    return [_estimated(surrogate, inputs) for inputs in sequences]


def _estimated(surrogate: Surrogate, inputs: FloatArray) -> Judged:
    """Judge a sequence, (N, n_inputs), without an error bound."""
    known = surrogate.inputs_in_range(inputs)
    if surrogate.estimates_errors:
        return Judged(_norms(ESTIMATES * surrogate.estimate_error(inputs)), known)
    return Judged(np.zeros(len(inputs)), known)


def _norms(each: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(each, axis=1))


def what_margins_are(surrogate: Surrogate) -> str:
    """Describe the margins of a surrogate in words."""
    if surrogate.bound is not None:
        return "the error bound of 95 % confidence"
    if surrogate.estimates_errors:
        return "twice the error estimate, since the FMU has no error bound"
    return "nothing, since the FMU has no error estimate"
