"""The exact response matrix against the closed form of the linear oscillator."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.linalg

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.validation.response import exact_matrix, is_affine, learnt_matrix, response_figures
from tests.fmu.samples import CellShape, Shape, random_surrogate, sum_surrogate

MASS, STIFFNESS, DAMPING, STEP = 1.0, 1600.0, 8.0, 1 / 64

LOW, HIGH = 0.2, 1.0

CLOSED_FORM = 1e-8
"""Of the largest entry; twelve substeps of order six leave some 1e-10."""

ROUNDING = 2e-6
"""Of the range of the outputs: they pass through float32."""


def impulse_response(count: int) -> FloatArray:
    """C A^k B of the held (zero-order-hold) discretisation, k = 0 .. count - 1."""
    continuous = np.zeros((3, 3))
    continuous[:2, :2] = [[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]]
    continuous[1, 2] = 1 / MASS
    discrete = scipy.linalg.expm(STEP * continuous)
    state, response = discrete[:2, 2], []
    for _ in range(count):
        response.append(state[0])
        state = discrete[:2, :2] @ state
    return np.array(response)


def test_exact_response_matrix_of_an_oscillator_is_the_closed_form() -> None:
    window = Window(STEP, 96, 24)
    response = impulse_response(96)
    expected = np.zeros((24, 96))
    for row in range(24):
        for column in range(96):
            age = window.n_truncated + row - column  # steps from the input to the output, less 1
            expected[row, column] = response[age] if age >= 0 else 0.0
    found = exact_matrix(LinearOscillator(), window)
    assert found.shape == (24, 96)
    assert np.max(np.abs(found - expected)) < CLOSED_FORM * np.max(expected)


class OffCentre(LinearOscillator):
    """Its force has a range that does not hold 0, and nothing else is asked of it."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        assert inputs.min() >= LOW
        assert inputs.max() <= HIGH
        return super().simulate(inputs)


def test_exact_response_matrix_needs_no_input_outside_of_its_range() -> None:
    system, window = OffCentre(), Window(STEP, 12, 5)
    system.inputs = (dataclasses.replace(system.inputs[0], low=LOW, high=HIGH, start=None),)
    expected = exact_matrix(LinearOscillator(), window)
    found = exact_matrix(system, window)
    assert np.max(np.abs(found - expected)) < CLOSED_FORM * np.max(expected)


def test_no_output_depends_on_later_inputs() -> None:
    window = Window(STEP, 12, 5)
    found = exact_matrix(LinearOscillator(), window)
    for row in range(5):
        newest = window.n_truncated + row
        assert np.all(found[row, newest + 1 :] == 0.0)
        assert found[row, newest] > 0.0  # the newest input already acts


def test_learnt_response_matrix_of_a_linear_layer_is_its_weights() -> None:
    """Weights W become scale_out W / scale_in."""
    surrogate = random_surrogate(Shape(n_in=6, n_out=3, n_inputs=2, n_outputs=2, hidden=()))
    network = surrogate.network
    assert isinstance(network, FeedForward)
    expected = network.layers[0].weights * np.tile(surrogate.output_scaling.scale, 3)[:, None]
    expected = expected / np.tile(surrogate.input_scaling.scale, 6)
    found = learnt_matrix(surrogate)
    assert found.shape == (6, 12)
    assert np.max(np.abs(found - expected)) < ROUNDING * np.ptp(expected)


def test_learnt_response_matrix_of_a_linear_cell_is_its_impulse_response() -> None:
    """Response of output row to input column: C A^age B (+ D for the newest), 0 for later."""
    shape = Shape(n_in=6, n_out=3, n_inputs=2, n_outputs=2, cell=CellShape(units=0))
    surrogate = random_surrogate(shape)
    network = surrogate.network
    assert isinstance(network, StateSpace)
    cell, expected = network.cell, np.zeros((3, 2, 6, 2))
    for row in range(3):
        for column in range(4 + row):
            response = cell.c @ np.linalg.matrix_power(cell.a, 3 + row - column) @ cell.b
            expected[row, :, column] = response + (cell.d if column == 3 + row else 0)
    expected *= surrogate.output_scaling.scale[:, None, None] / surrogate.input_scaling.scale
    found = learnt_matrix(surrogate)
    assert np.max(np.abs(found - expected.reshape(6, 12))) < ROUNDING * np.ptp(expected)


def test_network_that_is_not_affine_has_no_response_matrix() -> None:
    assert is_affine(random_surrogate(Shape(hidden=())))
    assert is_affine(random_surrogate(Shape(hidden=(3,), activation="identity")))
    assert is_affine(random_surrogate(Shape(cell=CellShape(units=0))))
    assert is_affine(sum_surrogate())
    assert not is_affine(random_surrogate(Shape(hidden=(3,))))
    assert not is_affine(random_surrogate(Shape(cell=CellShape(units=1))))
    assert not is_affine(random_surrogate(Shape(hidden=(), block=False)))  # sees less


def test_figures_of_a_response_matrix_are_those_by_hand() -> None:
    exact = np.array([[2.0, 0.0], [1.0, -4.0]])
    learnt = np.array([[2.0, 0.1], [1.0, -4.4]])
    assert vars(response_figures(learnt, exact)) == pytest.approx(
        {
            "largest_entry": 4.0,
            "max_deviation_relative": 0.1,
            "max_above_diagonal": 0.1,
            "max_above_diagonal_relative": 0.025,
        }
    )
    assert response_figures(exact, np.ones((2, 2))).max_above_diagonal == 0.0


def test_offset_of_the_inputs_does_not_change_the_matrix() -> None:
    surrogate = random_surrogate(Shape(hidden=()))
    scaling = surrogate.input_scaling
    moved = dataclasses.replace(
        surrogate, input_scaling=dataclasses.replace(scaling, offset=scaling.offset + 0.5)
    )
    expected = learnt_matrix(surrogate)
    assert np.max(np.abs(learnt_matrix(moved) - expected)) < ROUNDING * np.ptp(expected)
