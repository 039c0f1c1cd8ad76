"""Shapes of the smallest surrogates that have every part of the runtime to do."""

from __future__ import annotations

from dataclasses import replace

from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.samples import CellShape, Shape, random_surrogate

SMALL = Shape(n_in=3, n_out=2, n_inputs=2, hidden=(3,), skip=True, positions=2)
ONE_SAMPLE = Shape(n_in=6, n_out=3, hidden=(2,), activation="tanh", block=False, ages=2)
TWO_LAYERS = replace(SMALL, hidden=(3, 2), ages=2)

FEW = Shape(n_in=4, n_out=2, n_inputs=2, hidden=(2,), positions=2)
"""What the next ones have in common."""
CELLS = replace(
    FEW, n_out=3, hidden=(3,), positions=7, estimator_samples=3, ages=2, differences=1,
    cell=CellShape(2, 3),
)  # fmt: skip
GATED = replace(
    FEW, n_outputs=2, features="chain", cell=CellShape(5, 9, "gated", turned=2, factors=2)
)
DIRECTOR = replace(
    FEW, n_in=3, features="director", hold="first_order", cell=CellShape(2, 2, "gated", turned=1)
)
ROLES = Shape(n_in=3, n_out=2, differences=2, cell=CellShape(9, 2, "cubic", roles=True, factors=1))
RAMP = Shape(n_in=4, n_out=2, positions=2, hidden=(3,), hold="first_order", cell=CellShape(9, 9))
BENT = replace(
    FEW, n_in=5, n_inputs=3, n_outputs=2, differences=2, hidden=(3, 2), activation="elu",
    positions=3, means=True, narrow=True, hold="first_order",
)  # fmt: skip

TURNING = replace(
    FEW, features="director", hidden=(3,), activation="gelu", block=False, ages=2,
    hold="first_order",
)  # fmt: skip
CHAIN = Shape(n_in=3, n_out=1, n_inputs=1, features="chain", activation="cubic", positions=1)
ARM = replace(
    TURNING, n_in=3, n_inputs=4, n_outputs=2, features="chain", activation="tanh", positions=0,
    ages=0,
)  # fmt: skip

MOVING = replace(RAMP, n_inputs=2, forecasts=True)
SWINGING = replace(TURNING, forecasts=True)

PARAMETRIC = replace(CELLS, n_out=2, cell=CellShape(2, 3, parameters=2))
SUBSTEPS = replace(CELLS, n_out=2, cell=CellShape(9, 3, "mixed", substeps=3))

BOUNDED = Shape(n_in=3, n_out=2, n_inputs=2, n_outputs=2, differences=1, cell=CellShape(3, 2))
BOUNDED_MOVING = replace(
    MOVING, n_in=3, positions=0, features="director", cell=CellShape(2, 3, "gated", turned=1)
)
SEEN = replace(BOUNDED, positions=3)
SPANNED = replace(BOUNDED_MOVING, n_in=4)
LONGER_SPANNED = replace(BOUNDED_MOVING, n_in=5)
JUMPING = replace(MOVING, n_in=3, positions=0, cell=CellShape(2, 3))

FUZZED = (
    SMALL,
    ONE_SAMPLE,
    CELLS,
    GATED,
    DIRECTOR,
    TWO_LAYERS,
    ROLES,
    RAMP,
    BENT,
    TURNING,
    CHAIN,
    ARM,
    MOVING,
    SWINGING,
    PARAMETRIC,
    SUBSTEPS,
    BOUNDED,
    BOUNDED_MOVING,
    SEEN,
    SPANNED,
    LONGER_SPANNED,
    JUMPING,
)
"""All families, sets of features, kinds of units and of error estimators.

Inputs of the fuzz target name them by their number: add at the end only.
"""


def small_surrogate(shape: Shape) -> Surrogate:
    """A surrogate of one of these shapes; beside bounded ones is an error bound.

    One of them sees what the error estimator expects, others give the error estimate.
    """
    if shape not in (BOUNDED, BOUNDED_MOVING, SEEN, SPANNED, LONGER_SPANNED, JUMPING):
        return random_surrogate(shape)
    surrogate = bounded_surrogate(shape, (1, 2))
    return with_span(surrogate, 2) if shape in (SPANNED, LONGER_SPANNED) else surrogate
