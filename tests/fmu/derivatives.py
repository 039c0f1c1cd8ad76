"""Directional derivatives of an FMU, and surrogates that have smooth ones."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import OK, Native
from tests.fmu.samples import SEEN, CellShape, Shape, random_surrogate

ROUNDED = 3e-7
"""Rounding of single-precision outputs; finite differences divide it by their distance."""

SHAPE = Shape(n_in=8, n_out=3, n_outputs=2, positions=2, hidden=(9, 5), seed=2)
FAMILIES = {
    "elu block": {"activation": "elu"},
    "tanh, skip": {"activation": "tanh", "skip": True, "block": False},
    "gelu, some ages": {"activation": "gelu", "ages": 4},
    "elu, skip": {"activation": "elu", "skip": True},
    "tanh cell": {"cell": CellShape(4, 9, contraction=0.8)},
    "cubic cell": {"cell": CellShape(4, 9, "cubic", 0.8, roles=True, factors=1)},
    "mixed cell": {"cell": CellShape(4, 9, "mixed", 0.8, roles=True)},
    "gated cell": {"cell": CellShape(9, 9, "gated", 0.8, turned=2, factors=2)},
}


def surrogate_of(seen: str, family: str, **others: object) -> Surrogate:
    return random_surrogate(replace(SHAPE, **SEEN[seen], **FAMILIES[family], **others))


def inputs_for(surrogate: Surrogate, count: int) -> FloatArray:
    rng = np.random.default_rng(8)
    return 0.8 + np.cumsum(rng.normal(0, 0.03, (count, len(surrogate.inputs))), axis=0)


def derivative(native: Native, n_outputs: int, direction: FloatArray) -> FloatArray:
    """All outputs in a direction of all inputs."""
    count = len(direction)
    return derivative_of(native, range(count, count + n_outputs), direction)


def derivative_of(native: Native, unknowns: Sequence[int], direction: FloatArray) -> FloatArray:
    """Some variables in a direction of all inputs."""
    count, sensitivity = len(direction), (ctypes.c_double * len(unknowns))()
    status = native.call(
        "fmi2GetDirectionalDerivative",
        native.places.references(unknowns),
        ctypes.c_size_t(len(unknowns)),
        native.places.references(range(count)),
        ctypes.c_size_t(count),
        (ctypes.c_double * count)(*direction),
        sensitivity,
    )
    assert status == OK, native.messages
    return np.array(sensitivity)


def derivatives(native: Native, n_inputs: int, n_outputs: int) -> FloatArray:
    """Shape (n_outputs, n_inputs)."""
    return np.stack([derivative(native, n_outputs, e) for e in np.eye(n_inputs)], axis=1)
