"""Derivatives of a state-space network by its physical parameters are computed in float64.

A parameter gets an imaginary part too small to change a real number, and the cell is run in
    complex numbers: the imaginary part of a value is its derivative, without the rounding of a
    difference (complex step; Squire and Trapp, 1998). So ``equations.py`` serves here too.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.network import StateSpace

STEP = 1e-30
"""The imaginary part, relative to the parameter's range; its square vanishes next to 1."""


def parameter_slopes(
    network: StateSpace, features: FloatArray, values: FloatArray, n_out: int
) -> FloatArray:
    """Compute the derivatives of ``StateSpace.block`` by the parameters.

    Args:
        network: a network with parameters.
        features: features of input windows, shape (B, n_in, n_features).
        values: values of the parameters, in their units, shape (n_parameters,).
        n_out: samples of the output window.

    Returns:
        Derivatives of the scaled values by each parameter, shape (B, n_out, n_values,
        n_parameters), per unit of the parameter.
    """
    assert network.polynomial is not None
    inputs = ByRole.of(network.roles, np.moveaxis(features, 1, 0))
    slopes = []
    for index, parameter in enumerate(network.parameters):
        step = STEP * (parameter.high - parameter.low)
        moved = values.astype(np.complex128)
        moved[index] += 1j * step
        cell = network.polynomial.complex_at(moved)
        first = np.zeros((len(features), len(cell.a)), np.complex128)
        states = Equations(cell, inputs, network.turned, np).run(first)
        newest = slice(len(states) - n_out, None)
        moved_outputs = outputs(cell, states[newest], inputs.part(newest))
        slopes.append(np.moveaxis(moved_outputs.imag, 0, 1) / step)
    return np.stack(slopes, axis=-1)
