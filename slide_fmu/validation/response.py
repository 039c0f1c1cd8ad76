"""This module compares the response matrix of an affine network with the exact one."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.error_figures import ResponseFigures


def is_affine(surrogate: Surrogate) -> bool:
    """Tell whether the surrogate is one affine map from the input window to a block of outputs."""
    whole = surrogate.network.n_samples == surrogate.window.n_in
    return whole and surrogate.network.is_affine


def learnt_matrix(surrogate: Surrogate) -> FloatArray:
    """Return the response of every output sample to a unit of every input sample.

    The shape is (n_out * n_outputs, n_in * n_inputs), rows and columns sample by sample, in output
    units per input unit.
    """
    window, n_inputs = surrogate.window, len(surrogate.inputs)
    # half the range: the whole matrix lies where the network was trained
    size = surrogate.input_scaling.scale
    count = window.n_in * n_inputs
    pulses = np.zeros((count + 1, window.n_in, n_inputs)) + surrogate.input_scaling.offset
    for column in range(count):
        pulses[column, column // n_inputs, column % n_inputs] += size[column % n_inputs]
    outputs = surrogate.predict_windows(pulses).reshape(count + 1, -1)
    units = np.tile(size, window.n_in)
    return np.asarray(((outputs[:-1] - outputs[-1]) / units[:, None]).T)


def exact_matrix(system: System, window: Window) -> FloatArray:
    """Return the same matrix from pulses of one sample on the reference system at rest.

    The system rests in the middle of the ranges of its inputs, and pulses go to their ends.

    Entries are zero where an input comes after an output; shape and order are the same as in
    ``learnt_matrix``.
    """
    n_inputs, n_outputs = len(system.inputs), len(system.outputs)
    result = np.zeros((window.n_out, n_outputs, window.n_in, n_inputs))
    middle = np.array([0.5 * (signal.low + signal.high) for signal in system.inputs])
    rest = np.tile(middle, (1 + window.n_in, 1))  # the system starts under the first sample
    still = simulate(system, rest).outputs[1:]
    for channel, signal in enumerate(system.inputs):
        size, pulse = 0.5 * (signal.high - signal.low), rest.copy()
        pulse[1, channel] += size
        response = (simulate(system, pulse).outputs[1:] - still) / size
        for row in range(window.n_out):
            newest = window.n_truncated + row
            for column in range(newest + 1):
                result[row, :, column, channel] = response[newest - column + 1]
    return result.reshape(window.n_out * n_outputs, window.n_in * n_inputs)


def response_figures(learnt: FloatArray, exact: FloatArray) -> ResponseFigures:
    """Return how far the learnt matrix is from the exact one, relative to the latter's peak."""
    largest = float(np.max(np.abs(exact)))
    later = exact == 0.0
    above = float(np.max(np.abs(learnt[later]))) if np.any(later) else 0.0
    return ResponseFigures(
        largest_entry=largest,
        max_deviation_relative=float(np.max(np.abs(learnt - exact))) / largest,
        max_above_diagonal=above,
        max_above_diagonal_relative=above / largest,
    )
