"""The margin is the largest expected error of a prediction; plans include it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import Provenance
from slide_fmu.report.run_figures import released_figures
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.surrogate.trust import Trust

ESTIMATES = 2.0
"""Factor from an RMS error estimate to a 95 % margin, if there is no error bound."""

MOST_AT_REST = 1.5
"""Largest novelty of a known rest. Novelty compares means over time with those of motions, which
rest nowhere for long; errors of moves between such rests were as small as of others."""

AROUND_REST = 1.05
"""Novelty about a rest, relative to it, that is known too: small vibrations add to its level."""


@dataclass(frozen=True)
class Margins:
    """Margins say what the margins of predictions are.

    Attributes:
        factor: factor on all margins.
        usual: margin of a prediction without error bound and estimate: twice the RMS error in
            range when the FMU was measured, as a norm over the outputs; 0 if it was not measured.
    """

    factor: float = 1.0
    usual: float = 0.0


PLAIN = Margins()
"""Margins unscaled."""


def margins_of(
    surrogate: Surrogate, provenance: Provenance | None, factor: float = 1.0
) -> Margins:
    """Return the margins of an FMU's predictions, with a factor on them.

    Raises:
        MotionError: the FMU's figures are needed, and not of the form that this version writes.
    """
    if surrogate.bound is not None or surrogate.estimates_errors:
        return Margins(factor)
    try:
        figures = released_figures(provenance)
    except ValueError as error:
        raise MotionError(str(error)) from error
    if figures is None:
        return Margins(factor)
    return Margins(factor, ESTIMATES * figures.usual_error)


@dataclass(frozen=True, eq=False)
class Reliability:
    """Reliability is that of predictions along a sequence of N samples.

    Attributes:
        margins: largest expected error, as a norm over the outputs, (N,): the error bound of 95 %;
            without one, twice the error estimate; without both, the usual error
            (``what_margins_are`` says which).
        known: whether each sample is in the surrogate's domain, or hardly newer than rest at one
            of both ends; without an error bound, whether its inputs are in their ranges, (N,).
    """

    margins: FloatArray
    known: NDArray[np.bool_]


def judge(surrogate: Surrogate, sequences: FloatArray, margins: Margins) -> list[Reliability]:
    """Return the margins of predictions, and where the surrogate knows the inputs.

    Args:
        surrogate: the surrogate that predicts.
        sequences: inputs of whole motions, (B, N, n_inputs).
        margins: what the margins are.
    """
    if surrogate.bound is not None:
        return [
            Reliability(margins.factor * _norms(trust.bounds()), _known(surrogate, trust, inputs))
            for trust, inputs in zip(surrogate.trust_batch(sequences), sequences, strict=True)
        ]
    return [_estimated(surrogate, inputs, margins) for inputs in sequences]


def _known(surrogate: Surrogate, trust: Trust, inputs: FloatArray) -> NDArray[np.bool_]:
    """Return where a sequence, (N, n_inputs), is in the domain or hardly newer than its rests."""
    if trust.in_domain.all():
        return trust.in_domain
    rests = [min(novelty_at_rest(surrogate, end), MOST_AT_REST) for end in inputs[[0, -1]]]
    known = trust.novelty <= max(1.0, AROUND_REST * max(rests))
    return np.asarray(known & surrogate.inputs_in_range(inputs))


def novelty_at_rest(surrogate: Surrogate, inputs: FloatArray) -> float:
    """Return the novelty of constant inputs, (n_inputs,), for a surrogate with an error bound."""
    # the first input counts as constant before
    return float(surrogate.trust(inputs[None]).novelty[0])


def _estimated(surrogate: Surrogate, inputs: FloatArray, margins: Margins) -> Reliability:
    """Judge a sequence, (N, n_inputs), without an error bound."""
    known = surrogate.inputs_in_range(inputs)
    if surrogate.estimates_errors:
        estimates = ESTIMATES * surrogate.estimate_error(inputs)
        return Reliability(margins.factor * _norms(estimates), known)
    return Reliability(np.full(len(inputs), margins.factor * margins.usual), known)


def _norms(each: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(each, axis=1))


def what_margins_are(surrogate: Surrogate, margins: Margins) -> str:
    """Describe the margins of a surrogate in words."""
    factor = margins.factor
    times = "" if factor == 1 else f", times the factor {factor:.3g} for optimised moves"
    if surrogate.bound is not None:
        return f"the error bound of 95 % confidence{times}"
    if surrogate.estimates_errors:
        return f"twice the error estimate{times}, since the FMU has no error bound"
    if margins.usual > 0:
        return (
            f"twice the RMS error that was measured{times}, since the FMU has no error bound and "
            "no estimate"
        )
    return "nothing, since the FMU has no error bound, no estimate, and was not measured"
