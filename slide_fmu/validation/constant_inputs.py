"""Constant inputs are motions to corners of the box of inputs, and to points inside of it.

From the middle of their ranges all inputs go to a point and stay there until the input window
holds nothing of the way. The last part of that rest is scored.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.readable import decimal
from slide_fmu.core.signals import FloatArray, within_ranges
from slide_fmu.core.units import behind
from slide_fmu.data.draws import TEST, Draw
from slide_fmu.excitation.box import Box, at_points, corners_of_box, points_inside
from slide_fmu.excitation.channels import ChannelKind
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import RandomStates, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.calls import InputsLabel, MeasuredMotion
from slide_fmu.validation.input_courses import course_of
from slide_fmu.validation.row import CONSTANT

INSIDE = 8
"""Number of measured points inside of the box."""

LATER, WAY, SCORED = 3.0, 0.25, 1.0
"""Durations in input windows: how long a point is held, how long the way to it takes, and how much
is scored at the end. A whole window is scored, since a network starts anew with every window and
its error depends on the time since then."""

CORNERS, STEADY = "at the corners of the inputs' ranges", "inside of the inputs' ranges"


def constant_motions(
    surrogate: Surrogate, case: Case, progress: Progress
) -> dict[InputsLabel, list[MeasuredMotion]]:
    """Simulate the reference at constant inputs; nothing where the inputs are never held.

    Inputs of planned motions and angles are never held. Points at which the reference fails are
    named.
    """
    recipe = case.recipe
    if not _holds_inputs(surrogate, recipe):
        return {}
    system, count = case.reference, len(surrogate.inputs)
    groups = {CORNERS: corners_of_box(count), STEADY: points_inside(count, INSIDE)}
    done, total = 0, sum(len(points) for points in groups.values())
    by_label: dict[InputsLabel, list[MeasuredMotion]] = {}
    progress(0, total)
    for name, points in groups.items():
        motions, failed = list[MeasuredMotion](), list[str]()
        for point in at_points(surrogate.inputs, points):
            try:
                motions.append(_rest_at(surrogate, recipe, system, point))
            except SimulationError as error:
                failed.append(f"{_named(surrogate, point)}: {error}")
            done += 1
            progress(done, total)
        by_label[InputsLabel(CONSTANT, name, tuple(failed))] = motions
    return by_label


def _holds_inputs(surrogate: Surrogate, recipe: Recipe) -> bool:
    """Tell whether a recipe moves every input on its own, or holds all of them."""
    if surrogate.planned:
        return False
    if any(signal.angle is not None for signal in surrogate.inputs):
        return False
    return any(isinstance(kind, ChannelKind | Box) for kind in recipe.data.excitation)


def _rest_at(
    surrogate: Surrogate, recipe: Recipe, system: System, point: FloatArray
) -> MeasuredMotion:
    """Go to a point, and count the outputs when all rests there."""
    step = recipe.window.step
    window = max(surrogate.memory_length, round(recipe.data.burn_in / step))
    start = np.mean([[s.low, s.high] for s in surrogate.inputs], axis=1)
    part = np.clip(np.arange(-1.0, (WAY + LATER) * window) / max(1.0, WAY * window), 0, 1)
    inputs = within_ranges(system.inputs, start + part[:, None] * (point - start))  # rounding
    initial = None
    if isinstance(system, RandomStates):
        initial = system.random_state(np.random.default_rng(TEST), inputs[0])
    truth = simulate(system, inputs, initial).outputs
    drawn = Draw(0, 1.0, initial, inputs, 0)
    first = len(truth) - max(1, round(SCORED * window))
    return MeasuredMotion(
        course_of(drawn, surrogate.inputs, step, False), truth, step, first * step
    )


def _named(surrogate: Surrogate, point: FloatArray) -> str:
    pairs = zip(surrogate.inputs, point, strict=True)
    return ", ".join(
        f"{signal.name} = {decimal(value, 4)}{behind(signal.unit)}" for signal, value in pairs
    )
