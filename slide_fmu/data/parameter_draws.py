"""This module draws physical parameters of trajectories as points of a Sobol sequence.

A Sobol sequence fills the box of the ranges evenly with any number of points.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.parameters import Parameter
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import BEYOND_ATTEMPTS, STREAMS, Stream
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import LoadError, SimulationError

PARAMETERS = 8
"""No stream of trajectories has this number: the values have seeds of their own."""
LEARNT = STREAMS["train"], STREAMS["beyond"]
"""Trajectories of these streams are learnt from, beyond the ranges too where a recipe asks."""


def drawn_parameters(
    recipe: Recipe, stream: Stream, index: int, attempt: int = 0
) -> dict[str, float]:
    """Draw the parameters of trajectory ``index``, from 0, of a stream, by name.

    The result depends on the arguments alone; it is empty without parameters in the recipe. A
    further ``attempt`` has the same values, unless the system has failed ``BEYOND_ATTEMPTS`` times
    on values beyond the ranges: then they are drawn within.
    """
    values = _drawn(recipe, stream, index, beyond=stream.number in LEARNT)
    if attempt >= BEYOND_ATTEMPTS and _leave(recipe, values):
        return _drawn(recipe, stream, index, beyond=False)
    return values


def leaves_ranges(recipe: Recipe, stream: Stream, index: int, attempt: int = 0) -> bool:
    """Tell whether a parameter of a trajectory is beyond its range, as a recipe may ask for."""
    if not any(table.beyond for table in recipe.parameters.values()):
        return False
    return _leave(recipe, drawn_parameters(recipe, stream, index, attempt))


def case_at(case: Case, values: dict[str, float]) -> Case:
    """Return a case with values of its parameters, whose system can be made.

    Raises:
        SimulationError: the system cannot be made with them.
    """
    at_values = case.at(values)
    try:
        _ = at_values.system
    except LoadError as error:  # it could be made with the start values
        raise SimulationError(str(error)) from error
    return at_values


def with_values(words: str, values: dict[str, float]) -> str:
    """Return an error message with the values of the parameters, if there are some."""
    listed = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    return f"{words} (with {listed})" if values else words


def _drawn(recipe: Recipe, stream: Stream, index: int, beyond: bool) -> dict[str, float]:
    parameters = recipe.physical()
    if not parameters:
        return {}
    seeds = np.random.SeedSequence(stream.seed, spawn_key=(PARAMETERS, stream.number))
    from scipy.stats import qmc  # takes as long as all else that a worker imports

    sequence = qmc.Sobol(len(parameters), seed=np.random.default_rng(seeds))
    if index > 0:  # scipy takes no 0
        sequence.fast_forward(index)
    shares = sequence.random(1)[0]
    return {
        parameter.name: _value(
            parameter, share, recipe.parameters[parameter.name].beyond if beyond else 0.0
        )
        for parameter, share in zip(parameters, shares.tolist(), strict=True)
    }


def _leave(recipe: Recipe, values: dict[str, float]) -> bool:
    ranges = {parameter.name: (parameter.low, parameter.high) for parameter in recipe.physical()}
    return any(not ranges[name][0] <= value <= ranges[name][1] for name, value in values.items())


def _value(parameter: Parameter, share: float, beyond: float) -> float:
    """Return the value at a share, from 0 to 1, of a range; evenly in the transformed value.

    The range is wider by the part ``beyond`` of it at both ends. Rounding does not leave the
    range.
    """
    first, last = parameter.beyond(beyond) if beyond else (parameter.low, parameter.high)
    low, high = (float(parameter.scaled(end)) for end in (first, last))
    value = float(parameter.unscaled(low + share * (high - low)))
    return value if beyond else min(max(value, first), last)


def as_row(values: dict[str, float]) -> FloatArray:
    """Return the values of parameters, (n_parameters,), in their order."""
    return np.array(list(values.values()), dtype=np.float64)
