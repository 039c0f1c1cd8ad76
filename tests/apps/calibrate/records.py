"""Records of surrogates whose parameters are known exactly, with noise of a known colour."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, Shape, random_surrogate

TRUE = {"mass": 2.6, "damping": -0.7}
"""Values of both parameters, within their ranges."""


def surrogate_with(parameters: int, n_outputs: int = 1) -> Surrogate:
    """A small surrogate whose outputs depend on one or two parameters."""
    cell = CellShape(states=4, parameters=parameters)
    return random_surrogate(Shape(n_in=20, n_out=6, n_outputs=n_outputs, cell=cell))


def measured(
    surrogate: Surrogate,
    true: Mapping[str, float],
    seed: int = 0,
    samples: int = 600,
    noise: float = 0.0,
    colour: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Inputs, (N, n_inputs), and outputs, (N, n_outputs), of a record.

    The noise is relative to the standard deviation of each output; its values follow each other as
    e[k] = colour e[k-1] + white noise.
    """
    rng = np.random.default_rng(seed)
    inputs = rng.uniform(-1, 1, (samples, len(surrogate.inputs)))
    outputs = surrogate.predict_newest(inputs, true)
    white = rng.normal(size=outputs.shape) * np.sqrt(1 - colour**2)
    added = lfilter([1.0], [1.0, -colour], white, axis=0)
    return inputs, outputs + noise * outputs.std(axis=0) * added
