"""Remarks on a surrogate of records are about records, errors, and positions of rest.

A system with hysteresis or dry friction comes to rest elsewhere after each motion. Inputs that
never rest hide that: while they keep the system moving it forgets, and the test of fading memory
under the same inputs passes. So motions of a record are followed by constant inputs for one
window.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.stability import SEQUENCES
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.part_remarks import remarks_on_division
from slide_fmu.records.segments import inputs_beyond
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.results import Validation

CUT_OFF = 1.5
"""A window is too short where the FMU's error is this many times that of the free network."""
APART = 2e-3
"""Outputs have several positions of rest if these differ by more than this part of their standard
deviation: twice the usual remaining amplitude. Networks of systems that forget reach 1e-5."""


def remarks_on_records(source: MeasuredRecords, in_range: Validation) -> tuple[str, ...]:
    """Return all remarks, one sentence each.

    Raises:
        RecipeError: the records cannot be divided as the recipe says.
    """
    return (
        *source.remarks,
        *remarks_on_division(in_range.recipe, source),
        *_on_what_is_cut_off(in_range),
        *_on_rest(source, in_range),
    )


def _on_what_is_cut_off(validation: Validation) -> list[str]:
    """Name the outputs whose error comes from the window."""
    remarks = []
    for output in validation.figures().outputs:
        error, free = output.relative_rmse, output.free_relative_rmse
        if free is not None and error > CUT_OFF * free:
            remarks.append(
                f"output {output.name!r}: the FMU has an error of {percent(error)}, but the "
                f"network that runs freely along the record one of {percent(free)}: the system "
                "remembers what the window cuts off. It may have hysteresis, which no window can "
                "hold, or a "
                "slow part that a linear fit does not show: raise window.n_in, and see whether "
                "that helps"
            )
    return remarks


def _on_rest(source: MeasuredRecords, validation: Validation) -> list[str]:
    """Name the outputs whose position of rest depends on the motion before."""
    surrogate = validation.surrogate
    apart = apart_at_rest(surrogate, validation.recipe, source)
    if apart is None:
        return []
    return [
        f"output {signal.name!r}: after different motions of the record the network comes to rest "
        f"apart, by {100 * share:.2g} % of the output's standard deviation one window after the "
        f"inputs stand still; expected at most {100 * APART:g} %: the system seems to have "
        "hysteresis or dry friction, or to be damped less where it hardly moves. Trust the "
        "surrogate under inputs that keep it moving as the record does, and not at rest"
        for signal, share in zip(surrogate.outputs, apart, strict=True)
        if share > APART
    ]


def apart_at_rest(
    surrogate: Surrogate, recipe: Recipe, source: MeasuredRecords
) -> FloatArray | None:
    """Return the deviation of positions of rest after different motions.

    The inputs of segments of the records, one window long each, are followed by one window of
    their mean. The result is the standard deviation of the last outputs over the segments,
    relative to that of the output in motion, shape (n_outputs,). It is None for networks other
    than state-space ones, since their memory is their window.

    Raises:
        RecipeError: the records cannot be divided as the recipe says.
    """
    network, n_in = surrogate.network, surrogate.window.n_in
    if not isinstance(network, StateSpace):
        return None
    moving, still = (
        network.features.along(
            surrogate.input_scaling.apply(inputs_beyond(recipe, source, n_in, SEQUENCES, factor))
        )
        for factor in (1.0, 0.0)
    )
    outputs, states = network.run(moving)
    rest, _ = network.run(still, states)
    size = np.maximum(outputs.std(axis=(0, 1), dtype=np.float64), np.finfo(np.float32).tiny)
    return np.asarray(rest[:, -1].std(axis=0, dtype=np.float64) / size)
