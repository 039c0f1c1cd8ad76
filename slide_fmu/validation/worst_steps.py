"""This module finds the steps with the largest errors relative to the usual ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from slide_fmu.core.measures import TINY
from slide_fmu.core.signals import FloatArray
from slide_fmu.validation.comparison import Comparison


class WorstStep(NamedTuple):
    """A WorstStep is a sample of a trajectory.

    Attributes:
        comparison: the trajectory.
        sample: index of the sample.
        output: index of the output whose error is largest relative to the usual one.
        ratio: that error over the usual one.
    """

    comparison: Comparison
    sample: int
    output: int
    ratio: float


def worst_steps(
    comparisons: Sequence[Comparison],
    count: int,
    apart: int,
    ratios_of: Callable[[Comparison], FloatArray],
) -> list[WorstStep]:
    """Find the steps with the largest ratios of error to usual error, the largest one first.

    ``ratios_of`` gives these ratios of a trajectory, (N, n_outputs).

    There is one step for each trajectory at most. Where there are fewer trajectories than steps
    wanted, a trajectory has further steps, which lie ``apart`` samples from each other.
    """
    left = [ratios_of(c) for c in comparisons]
    steps: list[WorstStep] = []
    while len(steps) < count:
        of_each = []
        for comparison, ratios in zip(comparisons, left, strict=True):
            sample, output = np.unravel_index(np.argmax(ratios), ratios.shape)
            ratio = float(ratios[sample, output])
            if ratio >= 0:
                of_each.append(WorstStep(comparison, int(sample), int(output), ratio))
                ratios[max(0, sample - apart + 1) : sample + apart] = -1.0
        if not of_each:
            break
        steps += sorted(of_each, key=lambda step: -step.ratio)[: count - len(steps)]
    return sorted(steps, key=lambda step: -step.ratio)


def error_over_bound(comparison: Comparison) -> FloatArray:
    """Return absolute errors over their bounds of a trajectory that has some, (N, n_outputs)."""
    assert comparison.trust is not None
    ratios = np.abs(comparison.error) / np.maximum(comparison.trust.bounds, TINY)
    return np.asarray(ratios)
