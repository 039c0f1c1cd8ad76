"""This module runs a surrogate freely along a whole record, from the state at its start.

The truncated window of a surrogate causes errors, and so does a record that begins in mid-motion.
A free run has neither error: it shows the error of the network itself, for comparison with the
FMU.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.initial_state import initial_state
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

FIRST_SAMPLES = 50
"""Default number of first outputs from which the state at the start of a record is found."""


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A free run of a network along a record, in the outputs' units.

    Attributes:
        outputs: at samples 1 .. N, shape (N, n_outputs).
        error: RMS error of each output after the first samples, shape (n_outputs,).
        first_samples: number of outputs from which the initial state was found; not scored.
        state: the initial state, shape (n_states,).
    """

    outputs: FloatArray
    error: FloatArray
    first_samples: int
    state: FloatArray


def free_run(
    surrogate: Surrogate,
    inputs: FloatArray,
    measured: FloatArray,
    first_samples: int = FIRST_SAMPLES,
) -> FreeRun | None:
    """Run the network of a surrogate along a record, never restarted; None if it has no state.

    Inputs have the shape (N, n_inputs), in their units; ``measured`` are the outputs at samples
    1 .. N, (N, n_outputs): the one of row k is reached under the input of row k. They are NaN
    where they are not known. Only the first samples of them are used, to find the initial state.

    Raises:
        ValueError: the record has no samples after the first ones, or the shapes do not fit.
    """
    network = surrogate.network
    if not isinstance(network, StateSpace):
        return None
    if not 1 <= first_samples < len(inputs):
        raise ValueError(
            f"record of {len(inputs)} samples, the initial state from {first_samples} of them; "
            "expected at least one, and a longer record"
        )
    features = network.features.along(surrogate.input_scaling.apply(inputs)[None])
    scaled = surrogate.output_scaling.apply(measured)
    state = initial_state(network, features[0, :first_samples], scaled[:first_samples])
    with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges has an infinite error
        values, _ = network.run(features, state[None].astype(np.float32))
    outputs = surrogate.output_scaling.invert(values[0].astype(np.float64))
    squares = np.square(outputs - measured)[first_samples:]
    return FreeRun(outputs, np.sqrt(np.nanmean(squares, axis=0)), first_samples, state)
