"""Observations are what bounds are made of: errors, and the statistics that go with them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.trajectories import Split
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import not_quieter, statistics_of
from slide_fmu.surrogate.error_bound import MOST_EXPONENT, USUAL_CONFIDENCE, filling_length
from slide_fmu.surrogate.surrogate import Surrogate

AT_ONCE = 100
"""Networks run along this number of trajectories at once: what they need in between takes several
times the memory of the result."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Observations are results of surrogate and companion along a split, with full windows.

    Attributes:
        statistics: shape (n_trajectories, N, n_statistics).
        watched: shape (n_trajectories, N, n_watched).
        disagreement: of ``LocalErrors``, shape (n_trajectories, N, n_outputs).
        errors: absolute errors, relative to the outputs' scales,
            (n_trajectories, N, n_outputs).
    """

    statistics: FloatArray
    watched: FloatArray
    disagreement: FloatArray
    errors: FloatArray

    def head_inputs(self, quietest: FloatArray) -> Observations:
        """Return the same with the statistics that the head gets."""
        return replace(self, statistics=not_quieter(self.statistics, quietest))

    def weighed(self, shares: FloatArray) -> Observations:
        """Return the same with the shares, (n_outputs,), of the disagreement."""
        return replace(self, disagreement=shares * self.disagreement)

    def usual_errors(self) -> FloatArray:
        """Return the 95 % quantile of every output's errors, (n_outputs,), which is positive."""
        usual = np.quantile(samples_of(self.errors)[:, 0], USUAL_CONFIDENCE, axis=0)
        # an output without any error, but in a few samples, must have a tolerance too
        return np.asarray(np.maximum(usual, 2.0**-MOST_EXPONENT))


def observed(
    surrogate: Surrogate,
    companion: StateSpace,
    blocks: tuple[int, int],
    split: Split,
    late: float,
) -> Observations:
    """Run both networks along trajectories whose inputs are known to the end of each step.

    The companion sees a part of each jump later (``late``).

    Values that are not finite are refused later.
    """
    filling = filling_length(companion, blocks[1], surrogate.estimator)
    filled = slice(max(surrogate.window.n_in, filling), None)
    found = []
    for first in range(0, len(split.inputs), AT_ONCE):
        inputs, outputs = (a[first : first + AT_ONCE] for a in (split.inputs, split.outputs))
        scaled = surrogate.input_scaling.apply(inputs)
        given = surrogate.predict_newest_batch(inputs)
        predicted = surrogate.output_scaling.apply(given)
        with np.errstate(all="ignore"):
            errors = np.abs(given - outputs[:, 1:]) / surrogate.output_scaling.scale
            networks = companion, surrogate.estimator
            seen = statistics_of(networks, blocks, scaled, predicted, late)
        found.append([part[:, filled] for part in (*seen, errors)])
    return Observations(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def require_finite(name: str, mix: Observations) -> None:
    """Refuse observations that are not finite.

    Raises:
        ValueError: the message has the key of the split in recipes, ``name``, and the remedy.
    """
    both = np.concatenate([mix.statistics, mix.errors], axis=2)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(both).all(axis=(1, 2)))
    if not known.all():
        raise ValueError(
            "the outputs of the surrogate, or of its companion, are not finite on "
            f"{np.sum(~known)} of {len(known)} trajectories of {name}; expected networks that "
            "stay bounded there: excite it less (bound.excitation), or let both learn from "
            "trajectories beyond the range (data.beyond)"
        )


def thinned(mix: Observations, most: float) -> Observations:
    """Take every n-th sample of each trajectory, so that about ``most`` errors remain."""
    every = max(1, math.ceil(mix.errors.size / most))
    return Observations(*(values[:, ::every] for values in vars(mix).values()))


def samples_of(values: FloatArray) -> FloatArray:
    """Split trajectories into samples, (n_trajectories, N, n) to (n_trajectories * N, 1, n)."""
    return values.reshape(-1, 1, values.shape[2])
