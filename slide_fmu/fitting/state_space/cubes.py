"""Clipped cubes of mixed units get room beyond the range that they were learnt in.

A cube of a scaled argument is a scaled cube: rows of W and columns of E may be scaled against each
other, and the cell answers as before. So they are scaled until the cubes are clipped at a given
factor on the largest argument of the training: no sooner, since they go on rightly just beyond
it, and not much later, so that the cell stays bounded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.memory.stability import check_stability, excited_features
from slide_fmu.network.activations import CLIPPED
from slide_fmu.network.state_space.cell import MIXED_UNITS, Cell
from slide_fmu.network.state_space.equations import times
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source

ROOM = 3.0
"""Cubes are clipped at this factor on the largest argument of the training."""
CHUNK = 64
"""Segments that are run at once."""


def with_room(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Return parameters, (P,), of a cell that answers as before on segments like these.

    Cells of other units stay as they are, and so do cubes that are clipped on the segments.
    """
    if shape.units != MIXED_UNITS or shape.n_units == 0:
        return theta
    result = theta.clone()
    peaks = torch.stack([_peaks(shape, theta, part) for part in segments.chunks(CHUNK)]).amax(0)
    usable = (peaks > 0) & (peaks < CLIPPED)
    factors = torch.where(usable, CLIPPED / (ROOM * peaks), torch.ones_like(peaks))
    for cell in shape.cells(result):  # one for each term of physical parameters
        cell.w[::2] *= factors[:, None]
        cell.e[:, ::2] /= factors**3
    return result


def with_half_the_room(network: StateSpace) -> StateSpace:
    """Return a network whose cubes are clipped at half the arguments, and which else is the same.

    All factors are powers of two, so that nothing is rounded.
    """
    weights = network.cell if network.polynomial is None else network.polynomial
    if isinstance(weights, CellPolynomial):
        terms = tuple(_clipped_sooner(cell) for cell in weights.terms)
        weights = CellPolynomial(weights.basis, terms)
    else:
        weights = _clipped_sooner(weights)
    return StateSpace(
        weights,
        network.n_samples,
        network.n_out,
        network.features,
        network.roles,
        network.turned,
    )


def _clipped_sooner(cell: Cell) -> Cell:
    w, e = cell.w.copy(), cell.e.copy()
    w[::2] *= np.float32(2.0)
    e[:, ::2] /= np.float32(2.0**3)
    return replace(cell, w=w, e=e)


def _peaks(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Return the largest arguments of all cubes, shape (cubes,), on segments."""
    _, states = simulate(shape, theta, segments.features, segments.phi)
    before = torch.cat([torch.zeros_like(states[:1]), states[:-1]])
    seen = [before, segments.features[:, :, list(shape.roles.drive)]]
    if shape.bias:
        seen.append(torch.ones_like(before[:, :, :1]))
    w = shape.split(shape.weights(theta, segments.phi)).w
    arguments = times(torch.cat(seen, 2), w[..., ::2, :])
    peaks: torch.Tensor = arguments.abs().amax((0, 1))
    return peaks


def with_enough_room(surrogate: Surrogate, recipe: Recipe, system: Source) -> Surrogate:
    """Return a surrogate that passes the test of stability, if less room for its cubes brings it.

    The more room cubes have, the steeper they get, and a network whose cubes are too steep does
    not forget its state at large amplitudes. The surrogate stays as it is if it passes with all
    its room, or if less does not help or would change what it answers within the range.
    """
    network = surrogate.network
    if not isinstance(network, StateSpace) or network.cell.activation != MIXED_UNITS:
        return surrogate
    if _is_stable(surrogate, recipe, system):
        return surrogate
    smaller = with_half_the_room(network)
    features = excited_features(surrogate, recipe, system, 1.0)
    if not np.array_equal(network.run(features)[0], smaller.run(features)[0]):
        return surrogate
    other = replace(surrogate, network=smaller)
    return other if _is_stable(other, recipe, system) else surrogate


def _is_stable(surrogate: Surrogate, recipe: Recipe, system: Source) -> bool:
    return all(test.problem is None for test in check_stability(surrogate, recipe, system))
