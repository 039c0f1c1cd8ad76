"""Shapes of the smallest surrogates that have every part of the runtime to do."""

from __future__ import annotations

from tests.fmu.samples import CellShape, Shape

SMALL = Shape(n_in=3, n_out=2, n_inputs=2, hidden=(3,), skip=True, positions=2)
ONE_SAMPLE = Shape(n_in=6, n_out=3, hidden=(2,), activation="tanh", block=False, ages=2)
CELLS = Shape(
    n_in=4,
    n_out=3,
    n_inputs=2,
    positions=7,
    estimator_samples=3,
    ages=2,
    hidden=(3,),
    differences=1,
    cell=CellShape(2, 3),
)
GATED = Shape(
    n_in=4,
    n_out=2,
    n_inputs=2,
    n_outputs=2,
    features="chain",
    positions=2,
    hidden=(2,),
    cell=CellShape(5, 9, "gated", turned=2, factors=2),
)
DIRECTOR = Shape(
    n_in=3,
    n_out=2,
    n_inputs=2,
    features="director",
    positions=2,
    hidden=(2,),
    hold="first_order",
    cell=CellShape(2, 2, "gated", turned=1),
)
TWO_LAYERS = Shape(n_in=3, n_out=2, n_inputs=2, hidden=(3, 2), skip=True, positions=2, ages=2)
ROLES = Shape(n_in=3, n_out=2, differences=2, cell=CellShape(9, 2, "cubic", roles=True, factors=1))
RAMP = Shape(n_in=4, n_out=2, positions=2, hidden=(3,), hold="first_order", cell=CellShape(9, 9))
BENT = Shape(
    n_in=5,
    n_out=2,
    n_inputs=3,
    n_outputs=2,
    differences=2,
    hidden=(3, 2),
    activation="elu",
    positions=3,
    means=True,
    narrow=True,
    hold="first_order",
)
TURNING = Shape(
    n_in=4,
    n_out=2,
    n_inputs=2,
    features="director",
    hidden=(3,),
    activation="gelu",
    block=False,
    positions=2,
    ages=2,
    hold="first_order",
)
CHAIN = Shape(n_in=3, n_out=1, n_inputs=1, features="chain", activation="cubic", positions=1)
ARM = Shape(
    n_in=3,
    n_out=2,
    n_inputs=4,
    n_outputs=2,
    features="chain",
    hidden=(3,),
    activation="tanh",
    block=False,
    hold="first_order",
)

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
)
"""All families, sets of features, kinds of units and of error estimators.

Inputs of the fuzz target name them by their number: add at the end only.
"""
