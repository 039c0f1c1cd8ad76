"""Constant inputs are motions to corners of the box of inputs, and to points inside of it.

From the middle of their ranges all inputs go to a point and stay there until the input window
holds nothing of the way. The last part of that rest is scored.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.measures import FEWEST
from slide_fmu.core.progress import Progress
from slide_fmu.core.readable import decimal
from slide_fmu.core.signals import FloatArray, within_ranges
from slide_fmu.core.units import behind
from slide_fmu.data.draws import TEST, Draw
from slide_fmu.excitation.box import Box, at_points, corners_of_box, points_inside
from slide_fmu.excitation.channels import ChannelKind
from slide_fmu.excitation.spectra import BandSines
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Motion, RandomStates, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import motions_at_once, simulate_motions
from slide_fmu.validation.calls import InputsLabel, MeasuredMotion
from slide_fmu.validation.input_courses import course_of
from slide_fmu.validation.row import CONSTANT

INSIDE, MOST_INSIDE = 8, 16
"""Numbers of measured points inside of the box; with its corners there are at least ``FEWEST``."""

LATER, WAY, SCORED = 2.0, 0.25, 1.0
"""Durations in input windows: how long a point is held, how long the way to it takes, and how much
is scored at the end. A whole window is scored, since a network starts anew with every window and
its error depends on the time since then."""

IN_BOX = "at the corners of the inputs' ranges and inside"


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
    corners = corners_of_box(count)
    inside = points_inside(count, MOST_INSIDE)[: max(INSIDE, FEWEST - len(corners))]
    points = at_points(surrogate.inputs, np.concatenate([corners, inside]))
    motions, failed = list[MeasuredMotion](), list[str]()
    progress(0, len(points))
    each = motions_at_once(system, 1) == 1
    ways = [_way_to(surrogate, recipe, system, point) for point in points]
    truths = simulate_motions(system, [Motion(one.inputs, one.initial) for one in ways])
    for done, (point, way, truth) in enumerate(zip(points, ways, truths, strict=True), start=1):
        if isinstance(truth, SimulationError):
            failed.append(f"{_named(surrogate, point)}: {truth}")
        else:
            motions.append(_at_rest(surrogate, recipe, way, truth))
        if each or done == len(points):
            progress(done, len(points))
    return {InputsLabel(CONSTANT, IN_BOX, tuple(failed)): motions}


def _holds_inputs(surrogate: Surrogate, recipe: Recipe) -> bool:
    """Tell whether a recipe moves every input on its own, or holds all of them."""
    if surrogate.planned:
        return False
    if any(signal.angle is not None for signal in surrogate.inputs):
        return False
    return any(isinstance(kind, ChannelKind | BandSines | Box) for kind in recipe.data.excitation)


def _way_to(surrogate: Surrogate, recipe: Recipe, system: System, point: FloatArray) -> Draw:
    """Return inputs that go to a point and stay there."""
    window = _window(surrogate, recipe)
    start = np.mean([[s.low, s.high] for s in surrogate.inputs], axis=1)
    part = np.clip(np.arange(-1.0, (WAY + LATER) * window) / max(1.0, WAY * window), 0, 1)
    inputs = within_ranges(system.inputs, start + part[:, None] * (point - start))  # rounding
    initial = None
    if isinstance(system, RandomStates):
        initial = system.random_state(np.random.default_rng(TEST), inputs[0])
    return Draw(0, 1.0, initial, inputs, 0)


def _at_rest(surrogate: Surrogate, recipe: Recipe, way: Draw, truth: FloatArray) -> MeasuredMotion:
    """Return the motion on a way, whose outputs, (N + 1, n_outputs), count when all rests."""
    step = recipe.window.step
    first = len(truth) - max(1, round(SCORED * _window(surrogate, recipe)))
    course = course_of(way, surrogate.inputs, step, False)
    return MeasuredMotion(course, truth, step, first * step)


def _window(surrogate: Surrogate, recipe: Recipe) -> int:
    """Return the number of samples after which nothing of a way is left."""
    return max(surrogate.memory_length, round(recipe.data.burn_in / recipe.window.step))


def _named(surrogate: Surrogate, point: FloatArray) -> str:
    pairs = zip(surrogate.inputs, point, strict=True)
    return ", ".join(
        f"{signal.name} = {decimal(value, 4)}{behind(signal.unit)}" for signal, value in pairs
    )
