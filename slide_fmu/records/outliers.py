"""Single samples that jump away from both of their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray

FAR = 10.0
"""A sample is an outlier if both differences to its neighbours are so many times the usual one."""

NORMAL = 1.4826
"""The median of absolute values times this is the standard deviation, where they are normal."""

AROUND = 10
"""So many differences before and behind a sample say what is usual there."""


def outliers(values: FloatArray) -> NDArray[np.intp]:
    """Find the indices of single samples that jump away and back, in finite values, shape (N,).

    Usual is the median of the absolute differences between neighbours, over the whole column and
    on either side of the sample: a burst after a rest has no outliers. A step jumps, but not back.
    """
    differences = np.diff(values)
    moving = np.abs(differences[differences != 0])
    if not len(moving):
        return np.empty(0, np.intp)
    limit = FAR * NORMAL * float(np.median(moving))
    to, back = differences[:-1], differences[1:]
    least = np.where(to * back < 0, np.minimum(np.abs(to), np.abs(back)), 0.0)
    candidates = [int(k) for k in 1 + np.flatnonzero(least > limit)]
    sizes = np.abs(differences)
    return np.array([k for k in candidates if _is_far(sizes, k, least[k - 1])], np.intp)


def _is_far(sizes: FloatArray, sample: int, least: float) -> bool:
    """Tell whether a jump is far beside the differences on either side of it."""
    before = sizes[max(0, sample - 1 - AROUND) : sample - 1]
    behind = sizes[sample + 1 : sample + 1 + AROUND]
    usual = [float(np.median(side)) for side in (before, behind) if len(side)]
    return bool(usual) and least > FAR * NORMAL * max(usual)
