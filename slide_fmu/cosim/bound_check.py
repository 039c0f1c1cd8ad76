"""Error bounds from the library of an FMU are compared with numpy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.variables import ERROR_BOUND, IN_DOMAIN, NOVELTY, TRUSTED
from slide_fmu.surrogate.surrogate import Surrogate

BOUND_TOLERANCE = 1e-2
"""Largest relative deviation of error bounds in half of the samples. Where surrogate and companion
agree up to rounding, the logarithm of their difference magnifies it."""

NOVELTY_TOLERANCE = 1e-2
"""Largest relative deviation of the novelty; below 1, the edge of the domain, relative to 1. Where
surrogate and companion hardly differ, most of their difference is rounding."""


def bound_problems(
    surrogate: Surrogate, native: Mapping[str, FloatArray], inputs: FloatArray
) -> Iterator[str]:
    """Compare results of a library with numpy; without an error bound there are none.

    Args:
        surrogate: the surrogate in the FMU.
        native: every output variable after every step, by name, (N,) each.
        inputs: inputs of the steps, shape (N, n_inputs), in their units.

    Returns:
        Problems, each one sentence with its remedy.
    """
    if surrogate.bound is None:
        return
    trust = surrogate.trust(inputs)
    bounds = zip(bound_names(surrogate), trust.bounds().T, strict=True)
    expected = {
        **dict(bounds),
        NOVELTY: trust.novelty,
        IN_DOMAIN: trust.in_domain.astype(np.float64),
        TRUSTED: trust.trusted().astype(np.float64),
    }
    for name, (deviation, allowed) in bound_deviations(surrogate, native, expected).items():
        if not deviation <= allowed:
            flag = name in (IN_DOMAIN, TRUSTED)
            where = "at {:.3g} of the steps" if flag else "by {:.3g} of the value"
            yield (
                f"{name}: native library and numpy differ {where.format(deviation)}; expected at "
                f"most {allowed:.3g}, export again"
            )


def bound_names(surrogate: Surrogate) -> list[str]:
    """Return the names of the error bounds of a surrogate's outputs."""
    return [ERROR_BOUND.format(signal=signal.name) for signal in surrogate.outputs]


def bound_deviations(
    surrogate: Surrogate, native: Mapping[str, FloatArray], expected: Mapping[str, FloatArray]
) -> dict[str, tuple[float, float]]:
    """Compare bounds, novelty and flags with others, which may differ by rounding.

    Args:
        surrogate: the surrogate in the FMU; it has an error bound.
        native, expected: these variables by name, (N,) each.

    Returns:
        By name the deviation, and the largest allowed one: for bounds the median of the relative
        differences, for the novelty the largest one (see ``NOVELTY_TOLERANCE``), for the
        domain and for trust the fraction of samples. Samples at the domain's edge, or with a
        bound at its tolerance, where rounding decides, do not count.
    """
    result = {
        name: (float(np.median(_relative(native[name], expected[name]))), BOUND_TOLERANCE)
        for name in bound_names(surrogate)
    }
    novelty = expected[NOVELTY]
    apart = np.abs(native[NOVELTY] - novelty) / np.maximum(novelty, 1.0)
    result[NOVELTY] = float(apart.max()), NOVELTY_TOLERANCE
    clear = np.abs(novelty - 1) > NOVELTY_TOLERANCE
    result[IN_DOMAIN] = _share_of_others(clear, native, expected, IN_DOMAIN), 0.0
    if TRUSTED in native and TRUSTED in expected:
        for name, most in zip(bound_names(surrogate), surrogate.error_tolerances, strict=True):
            clear &= (native[name] <= most) == (expected[name] <= most)
        result[TRUSTED] = _share_of_others(clear, native, expected, TRUSTED), 0.0
    return result


def _share_of_others(
    counted: NDArray[np.bool_],
    native: Mapping[str, FloatArray],
    expected: Mapping[str, FloatArray],
    name: str,
) -> float:
    """Return the share of samples whose flag differs, of those that count."""
    return float(np.mean(counted & (native[name] != expected[name])))


def _relative(native: FloatArray, expected: FloatArray) -> FloatArray:
    """Return differences relative to the expected values, which may be zero."""
    return np.asarray(np.abs(native - expected) / np.maximum(expected, np.finfo(np.float64).tiny))
