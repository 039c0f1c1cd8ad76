"""A network may come to rest at outputs that depend on what moved it before.

A system with hysteresis or dry friction comes to rest elsewhere after each motion. Inputs that
never rest hide that: as long as they keep it moving it forgets, and the test of fading memory,
which runs under the same inputs, passes. So motions of a record are followed by inputs that stand
still, for one window.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.recorded import inputs_beyond
from slide_fmu.memory.stability import RECORDS
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.surrogate.surrogate import Surrogate


def apart_at_rest(
    surrogate: Surrogate, recipe: Recipe, source: MeasuredRecords
) -> FloatArray | None:
    """Return how far from each other outputs come to rest after different motions.

    The inputs of stretches of the records, one window long each, are followed by one window of
    their mean. The result is the standard deviation of the last outputs over the stretches,
    relative to that of the output in motion, shape (n_outputs,). It is None of networks other
    than state-space ones, whose memory is their window.

    Raises:
        RecipeError: the records cannot be divided as the recipe says.
    """
    network, n_in = surrogate.network, surrogate.window.n_in
    if not isinstance(network, StateSpace):
        return None
    moving, still = (
        network.features.along(
            surrogate.input_scaling.apply(inputs_beyond(recipe, source, n_in, RECORDS, factor))
        )
        for factor in (1.0, 0.0)
    )
    outputs, states = network.run(moving)
    rest, _ = network.run(still, states)
    size = np.maximum(outputs.std(axis=(0, 1), dtype=np.float64), np.finfo(np.float32).tiny)
    return np.asarray(rest[:, -1].std(axis=0, dtype=np.float64) / size)
