"""What the library of an FMU says about its error bounds, beside numpy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.variables import ERROR_BOUND, IN_DOMAIN, NOVELTY
from slide_fmu.surrogate.surrogate import Surrogate

BOUND_TOLERANCE = 1e-2
"""Largest deviation of error bounds, relative to themselves, in half of the samples: where
surrogate and companion agree up to rounding, the logarithm of their difference magnifies it."""

NOVELTY_TOLERANCE = 1e-3
"""Largest deviation of the novelty, relative to itself: it is a mean square, in which rounding in
single precision is small beside what surrogate and companion differ by."""


def bound_problems(
    surrogate: Surrogate, native: Mapping[str, FloatArray], inputs: FloatArray
) -> Iterator[str]:
    """Compare what a library gave with numpy; there is nothing to compare without an error bound.

    Args:
        surrogate: the one in the FMU.
        native: every output variable after every step, by name, (N,) each.
        inputs: those of the steps, shape (N, n_inputs), in their units.

    Returns:
        Problems, each one sentence with its remedy.
    """
    if surrogate.bound is None:
        return
    bounds, novelty = surrogate.error_bounds(inputs), surrogate.trust(inputs).novelty
    for signal, expected in zip(surrogate.outputs, bounds.T, strict=True):
        name = ERROR_BOUND.format(signal=signal.name)
        found = float(np.median(np.abs(native[name] / expected - 1)))
        if not found <= BOUND_TOLERANCE:
            yield _differs(name, found, BOUND_TOLERANCE)
    found = float(np.abs(native[NOVELTY] / novelty - 1).max())
    if not found <= NOVELTY_TOLERANCE:
        yield _differs(NOVELTY, found, NOVELTY_TOLERANCE)
    clear = np.abs(novelty - 1) > NOVELTY_TOLERANCE  # at the edge, rounding decides
    wrong = int(np.sum(clear & (native[IN_DOMAIN] != surrogate.in_domain(inputs))))
    if wrong > 0:
        yield (
            f"{IN_DOMAIN}: native library and numpy differ at {wrong} of {len(inputs)} steps; "
            "expected the same, export again"
        )


def _differs(name: str, found: float, allowed: float) -> str:
    return (
        f"{name}: native library and numpy differ by {found:.3g} of the value; expected at most "
        f"{allowed:.3g}, export again"
    )
