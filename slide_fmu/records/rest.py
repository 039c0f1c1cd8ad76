"""A record may begin at rest: then what was before its first sample is known.

A window before the record has the inputs at rest, and outputs stay at their first values. So no
samples are lost as a lead, and motions can be learnt that are shorter than a machine's memory.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray

LEAST = 5
"""Fewer samples before the first move show no rest."""
STILL = 0.01
"""Inputs rest while they stay within this part of their range about the first one. Outputs rest if
they deviate, beside their noise, by at most this part of their standard deviation."""
NOISE, DRIFT = 3.0, 10.0
"""Outputs at rest deviate by at most the first multiple of the noise that their differences show,
and the means of both halves of n samples differ by at most the second one over sqrt(n): five
standard deviations, since many files are looked at."""
LONGER = 3.0
"""Rest is shown if it is this many times as long as outputs then take to answer the first move: a
slow machine seems to rest at first, too, when its input has changed just before the record."""
SURE = 2.0
"""Outputs surely move if they deviate by more than this multiple of what rest allows."""


def resting_samples(inputs: FloatArray) -> int:
    """Return how many first samples of inputs, (N, n_inputs), do not move."""
    size = STILL * np.maximum(np.ptp(inputs, axis=0), np.finfo(np.float64).tiny)
    moved = np.flatnonzero(np.any(np.abs(inputs - inputs[0]) > size, axis=1))
    return int(moved[0]) if len(moved) else len(inputs)


def are_still(outputs: FloatArray, count: int, margin: float = 1.0) -> bool:
    """Tell whether the first ``count`` samples of outputs, (N, n_outputs), rest.

    Noise is allowed, drift is not, within a margin. Missing values (NaN) are left out.
    """
    for column in outputs.T:
        known = column[np.isfinite(column)]
        first = column[:count][np.isfinite(column[:count])]
        if len(first) < LEAST:
            return False
        noise = float(np.std(np.diff(first)) / np.sqrt(2.0))
        drift = abs(float(first[len(first) // 2 :].mean() - first[: len(first) // 2].mean()))
        own = STILL * float(known.std())
        most = NOISE * noise + own, DRIFT * noise / np.sqrt(len(first)) + own
        if np.std(first) > margin * most[0] or drift > margin * most[1]:
            return False
    return True


def begins_at_rest(inputs: FloatArray, outputs: FloatArray) -> bool:
    """Tell whether a record shows that it begins at rest: inputs and outputs are constant first.

    Args:
        inputs: shape (N, n_inputs), without gaps.
        outputs: shape (N, n_outputs), measured at the same samples; NaN where unknown.
    """
    count = resting_samples(inputs)
    if count < LEAST or not are_still(outputs, count):
        return False
    return count >= LONGER * _samples_to_answer(outputs, count)


def _samples_to_answer(outputs: FloatArray, count: int) -> float:
    """Return after how many samples some output leaves its rest, which lasts ``count`` samples.

    It is infinite where none does.
    """
    first = outputs[:count]
    with np.errstate(invalid="ignore"):
        away = np.abs(outputs[count:] - np.nanmean(first, axis=0))
        size = NOISE * np.nanstd(first, axis=0) + STILL * np.nanstd(outputs, axis=0)
        moved = np.flatnonzero(np.any(away > size, axis=1))
    return float(moved[0]) if len(moved) else np.inf


def begins_in_motion(inputs: FloatArray, outputs: FloatArray) -> bool:
    """Tell whether a record shows that it does not begin at rest: outputs move before inputs do.

    Where the first input moves at once, nothing is shown. Arguments are as for ``begins_at_rest``.
    """
    count = resting_samples(inputs)
    return count >= LEAST and not are_still(outputs, count, SURE)
