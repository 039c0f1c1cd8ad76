"""This module measures the error of an FMU at constant inputs, at corners of the box and inside.

From the middle of their ranges all inputs go to a point and stay there until the input window
holds nothing of the way. The last part of that rest is scored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Progress
from slide_fmu.core.readable import decimal
from slide_fmu.core.signals import FloatArray, within_ranges
from slide_fmu.core.units import behind
from slide_fmu.cosim.run import UnpackedFmu, run_fmu, unpacked
from slide_fmu.data.draws import TEST
from slide_fmu.excitation.box import Box, at_points, corners_of_box, points_inside
from slide_fmu.excitation.channels import ChannelKind
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import RandomStates, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.error_figures import BoxFigures, RestFigures, RestOutput
from slide_fmu.validation.results import Validation

INSIDE = 8
"""Number of measured points inside of the box."""

LATER, WAY, SCORED = 3.0, 0.25, 1.0
"""Durations in input windows: how long a point is held, how long the way to it takes, and how much
is scored at the end. A whole window is scored, since a network starts anew with every window and
its error depends on the time since then."""

TITLES = {
    "corners": "constant, at the corners of the inputs",
    "steady": "constant, inside of their ranges",
}
TEXT = (
    "All inputs go from the middle of their ranges to a point and stay there. Errors are measured "
    "at the rest, relative to the RMS of the reference about its mean on the motions in range."
)


@dataclass(frozen=True, eq=False)
class _Rest:
    """Errors and bounds at one point (bounds are NaN without one), (n, n_outputs) each."""

    error: FloatArray
    bound: FloatArray


def box_figures(
    fmu: Path, validation: Validation, case: Case, progress: Progress
) -> BoxFigures | None:
    """Measure an FMU at constant inputs; None where the inputs are never held.

    Inputs of measured records, planned motions and angles are never held.

    Args:
        fmu: the FMU, whose library is run.
        validation: its validation in range, whose reference gives the scale of errors.
        case: what it was made from.
        progress: hears how many points are done.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    surrogate, recipe = validation.surrogate, case.recipe
    if not _holds_inputs(surrogate, recipe):
        return None
    system = case.reference
    truth = np.concatenate([c.reference for c in validation.comparisons])
    size = np.maximum(rms(truth - truth.mean(axis=0)), np.finfo(np.float64).tiny)
    n_inputs, found = len(surrogate.inputs), dict[str, RestFigures]()
    groups = {"corners": corners_of_box(n_inputs), "steady": points_inside(n_inputs, INSIDE)}
    total = sum(len(points) for points in groups.values())
    progress(0, total)
    with unpacked(fmu) as files:
        done = 0
        for name, points in groups.items():
            rests, failed = list[_Rest](), list[str]()
            for point in at_points(surrogate.inputs, points):
                try:
                    rests.append(_rest_at(files, surrogate, recipe, system, point))
                except SimulationError as error:
                    failed.append(f"{_named(surrogate, point)}: {error}")
                done += 1
                progress(done, total)
            if rests:
                found[name] = RestFigures(
                    points=len(rests),
                    outputs=tuple(_outputs(surrogate, rests, size)),
                    failed=tuple(failed),
                )
    return BoxFigures(**found) if found else None


def _holds_inputs(surrogate: Surrogate, recipe: Recipe) -> bool:
    """Tell whether a recipe moves every input on its own, or holds all of them."""
    if surrogate.planned:
        return False
    if any(signal.angle is not None for signal in surrogate.inputs):
        return False
    return any(isinstance(kind, ChannelKind | Box) for kind in recipe.data.excitation)


def _rest_at(
    fmu: UnpackedFmu, surrogate: Surrogate, recipe: Recipe, system: System, point: FloatArray
) -> _Rest:
    """Go to a point, and return errors and bounds when all rests there.

    Raises:
        SimulationError: the reference could not be simulated.
    """
    window = max(surrogate.memory_length, round(recipe.data.burn_in / recipe.window.step))
    start = np.mean([[s.low, s.high] for s in surrogate.inputs], axis=1)
    part = np.clip(np.arange(-1.0, (WAY + LATER) * window) / max(1.0, WAY * window), 0, 1)
    inputs = within_ranges(system.inputs, start + part[:, None] * (point - start))  # rounding
    initial = None
    if isinstance(system, RandomStates):
        initial = system.random_state(np.random.default_rng(TEST), inputs[0])
    true = simulate(system, inputs, initial).outputs
    now = inputs  # inputs[k] is reached at t_k+1; one that moves is set to what it is at t_k
    if surrogate.hold == "first_order":
        now = np.concatenate([inputs[:1], inputs[:-1]])
    columns = {signal.name: now[:, i] for i, signal in enumerate(surrogate.inputs)}
    names = [signal.name for signal in surrogate.outputs]
    bounds = [] if surrogate.bound is None else [f"{name}_error_bound" for name in names]
    values = run_fmu(fmu, columns, [*names, *bounds], None, surrogate.window.step).values
    last = slice(-max(1, round(SCORED * window)), None)
    error = values[last, : len(names)] - true[last]
    bound = values[last, len(names) :] if bounds else np.full_like(error, np.nan)
    return _Rest(error, bound)


def _outputs(surrogate: Surrogate, rests: Sequence[_Rest], size: FloatArray) -> list[RestOutput]:
    error = np.concatenate([rest.error for rest in rests])
    bound = np.concatenate([rest.bound for rest in rests])
    covered = np.mean(np.abs(error) <= bound, axis=0)
    return [
        RestOutput(
            name=signal.name,
            unit=signal.unit,
            relative_rmse=float((rms(error) / size)[index]),
            largest_error=float(np.abs(error[:, index]).max()),
            covered=None if surrogate.bound is None else float(covered[index]),
        )
        for index, signal in enumerate(surrogate.outputs)
    ]


def _named(surrogate: Surrogate, point: FloatArray) -> str:
    pairs = zip(surrogate.inputs, point, strict=True)
    return ", ".join(
        f"{signal.name} = {decimal(value, 4)}{behind(signal.unit)}" for signal, value in pairs
    )
