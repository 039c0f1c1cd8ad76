"""Initial states of networks, found again from the outputs of runs that began with them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.base import Float32Array
from slide_fmu.network.state_space.initial_state import initial_state
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.refusals import refused

SHAPES = {
    "tanh": CellShape(states=3, units=5, contraction=0.9),
    "cubic": CellShape(states=3, units=5, activation="cubic", contraction=0.9),
    "gated": CellShape(states=4, units=3, activation="gated", contraction=0.9, turned=1),
    "linear": CellShape(states=2, units=0, contraction=0.9),
}
CLOSE = 2e-2
"""States of size 1, from outputs in float32, drawn to zero a little."""


def run(cell: str, samples: int = 40) -> tuple[StateSpace, Float32Array, FloatArray, FloatArray]:
    """A network, features (N, q), the values (N, p) of a run, and the state that it began with."""
    network = random_surrogate(Shape(n_outputs=3, n_inputs=2, cell=SHAPES[cell], seed=3)).network
    assert isinstance(network, StateSpace)
    rng = np.random.default_rng(1)
    features = network.features.along(rng.uniform(-1, 1, (1, samples, 2)))
    state = rng.normal(0, 0.5, len(network.cell.a))
    values, _ = network.run(features, state[None].astype(np.float32))
    return network, features[0], values[0].astype(np.float64), state


@pytest.mark.parametrize("cell", SHAPES)
def test_state_is_found_from_the_first_outputs(cell: str) -> None:
    network, features, values, state = run(cell)
    assert initial_state(network, features, values) == pytest.approx(state, abs=CLOSE)


@pytest.mark.parametrize("cell", SHAPES)
def test_missing_outputs_are_left_out(cell: str) -> None:
    network, features, values, state = run(cell)
    values[::3], values[4:9, 1] = np.nan, np.nan
    assert initial_state(network, features, values) == pytest.approx(state, abs=CLOSE)


def test_state_that_no_output_shows_stays_near_zero() -> None:
    network, features, values, _ = run("linear")
    network.cell.c[:] = 0
    assert initial_state(network, features, 0 * values).tolist() == [0.0, 0.0]


def test_values_of_another_shape_are_refused() -> None:
    network, features, values, _ = run("tanh")
    message = "values of shape (40, 2), 80 of them known; expected (40, 3)"
    with pytest.raises(ValueError, match=re.escape(message)):
        initial_state(network, features, values[:, :2])


def test_values_of_which_none_is_known_are_refused() -> None:
    network, features, values, _ = run("tanh")
    with refused(ValueError, "0 of them known; expected", "at least one known"):
        initial_state(network, features, np.full_like(values, np.nan))
