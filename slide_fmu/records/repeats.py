"""The noise of outputs is seen without any model where inputs repeat a period."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.records.periods import ALIKE, find_period

FEWEST = 100
"""So many pairs of samples, at least, tell the noise."""


def noise_of_repeats(stretches: Iterable[Trajectory], lead: int) -> FloatArray | None:
    """Estimate the RMS of the outputs' noise, shape (n_outputs,), in their units.

    Outputs of a system that forgets within ``lead`` samples are the same, one period after the
    other, but for noise: half of the variance of their difference is that of the noise, white or
    not. What inputs differ from period to period, as far as that is no noise of their own sensors,
    counts as noise too.

    None where the inputs repeat no period for longer than the system remembers.
    """
    differences = [_differences(stretch, lead) for stretch in stretches]
    found = [difference for difference in differences if len(difference)]
    if sum(len(difference) for difference in found) < FEWEST:
        return None
    return np.asarray(rms(np.concatenate(found)) / np.sqrt(2.0))


def _differences(stretch: Trajectory, lead: int) -> FloatArray:
    """Return what outputs differ from those one period before, (pairs, n_outputs)."""
    inputs, outputs = stretch.inputs, stretch.outputs[1:]
    period = find_period(inputs)
    if period is None:
        return np.empty((0, outputs.shape[1]))
    later, before = outputs[period.samples :], outputs[: -period.samples]
    found = (later - before)[_same_past(inputs, period.samples, lead)]
    return np.asarray(found[np.isfinite(found).all(axis=1)])


def _same_past(inputs: FloatArray, period: int, lead: int) -> NDArray[np.bool_]:
    """Tell after which inputs all that a system remembers came one period before too.

    Inputs have the shape (N, n_inputs); the answer, (N - period,), is about those from the second
    period on.
    """
    centred = inputs - inputs.mean(axis=0)
    power = np.mean(centred**2, axis=0)
    off = np.mean((inputs[period:] - inputs[:-period]) ** 2 / np.maximum(power, 1e-300), axis=1)
    total = np.concatenate([[0.0], np.cumsum(off)])
    same = np.zeros(len(off), bool)
    remembered = lead + 1
    if len(off) >= remembered:
        mean = (total[remembered:] - total[:-remembered]) / remembered
        same[remembered - 1 :] = mean <= ALIKE
    return same
