"""Cubes of mixed hidden units are clipped sooner where a network forgets its state only then.

The later cubes are clipped, the steeper they get. A network whose cubes are too steep does not
forget its state at large amplitudes, far beyond the range that it was trained in.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.memory.stability import check_stability, excited_features
from slide_fmu.network.state_space.cell import MIXED_UNITS, Cell
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate


def with_stable_cubes(surrogate: Surrogate, case: Case) -> Surrogate:
    """Return a surrogate that passes the test of stability, if clipping its cubes sooner does it.

    The surrogate stays as it is if it passes, if clipping sooner does not help, or if that would
    change its outputs within the trained range.
    """
    network = surrogate.network
    if not isinstance(network, StateSpace) or network.cell.activation != MIXED_UNITS:
        return surrogate
    if _is_stable(surrogate, case):
        return surrogate
    sooner = clipped_sooner(network)
    features = excited_features(surrogate, case.recipe, case.source, 1.0)
    if not np.array_equal(network.run(features)[0], sooner.run(features)[0]):
        return surrogate
    other = replace(surrogate, network=sooner)
    return other if _is_stable(other, case) else surrogate


def clipped_sooner(network: StateSpace) -> StateSpace:
    """Return the network whose cubes are clipped at half the arguments, and else unchanged.

    All factors are powers of two, so that nothing is rounded.
    """
    weights = network.cell if network.polynomial is None else network.polynomial
    if isinstance(weights, CellPolynomial):
        terms = tuple(_halved(cell) for cell in weights.terms)
        weights = CellPolynomial(weights.basis, terms)
    else:
        weights = _halved(weights)
    return StateSpace(
        weights,
        network.n_samples,
        network.n_out,
        network.features,
        network.roles,
        network.turned,
    )


def _halved(cell: Cell) -> Cell:
    """Return a cell with the same cubes of twice the arguments: every second hidden unit."""
    w, e = cell.w.copy(), cell.e.copy()
    w[::2] *= np.float32(2.0)
    e[:, ::2] /= np.float32(2.0**3)
    return replace(cell, w=w, e=e)


def _is_stable(surrogate: Surrogate, case: Case) -> bool:
    return all(test.problem is None for test in check_stability(surrogate, case))
