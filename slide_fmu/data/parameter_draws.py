"""Values of physical parameters for trajectories: points of a Sobol sequence over their ranges.

A Sobol sequence fills the box of the ranges evenly, however many of its points are taken.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from slide_fmu.core.parameters import Parameter
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import STREAMS, Stream
from slide_fmu.recipe.parameters import EDGE
from slide_fmu.recipe.recipe import Recipe

PARAMETERS = 8
"""No stream of trajectories has this number: the values have seeds of their own."""
LEARNT = STREAMS["train"], STREAMS["beyond"]
"""Trajectories of these streams are learnt from, also a little beyond the ranges."""


def drawn_parameters(recipe: Recipe, stream: Stream, index: int) -> dict[str, float]:
    """Draw the parameters of trajectory ``index``, from 0, of a stream, by name.

    The result depends on the arguments alone; there are none where the recipe has none.
    """
    parameters = recipe.physical()
    if not parameters:
        return {}
    seeds = np.random.SeedSequence(stream.seed, spawn_key=(PARAMETERS, stream.number))
    sequence = qmc.Sobol(len(parameters), seed=np.random.default_rng(seeds))
    if index > 0:  # scipy takes no 0
        sequence.fast_forward(index)
    shares = sequence.random(1)[0]
    edge = EDGE if stream.number in LEARNT else 0.0
    return {
        parameter.name: _value(parameter, share, edge)
        for parameter, share in zip(parameters, shares.tolist(), strict=True)
    }


def _value(parameter: Parameter, share: float, edge: float) -> float:
    """Return the value at a share, from 0 to 1, of a range; evenly in the transformed value."""
    ends = parameter.beyond(edge) if edge else (parameter.low, parameter.high)
    low, high = (float(parameter.scaled(end)) for end in ends)
    return float(parameter.unscaled(low + share * (high - low)))


def as_row(values: dict[str, float]) -> FloatArray:
    """Return the values of parameters, (n_parameters,), in their order."""
    return np.array(list(values.values()), dtype=np.float64)
