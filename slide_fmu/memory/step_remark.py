"""A remark warns if a recipe's step changes the motion, or loses some of it between samples."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.core.measures import percent, relative_rmse, size_about
from slide_fmu.core.signals import FloatArray, hold_of, on_circles, within_ranges
from slide_fmu.data.draws import PROBE, PROBE_ATTEMPTS, Stream, draw
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate

FINER, FINE_SAMPLES = 4, 256
"""A step of the recipe is divided into the first number of parts, over the second number of
samples."""
COARSE = 0.1
"""Limit of errors between samples, relative to the output's standard deviation: above it, the step
is too coarse."""
SAME = 0.005
"""Outputs at the samples may differ by this fraction of their standard deviation where the system
is simulated more finely."""
OWN_CURVES = {"class", "object"}
"""Kinds of models that may draw curves of their own through samples. Finer samples are another
motion for them."""
TOO_COARSE = "between its samples"
"""These words stand in the remark on a step that is too coarse, in no other."""
STILL = 1e-6
"""An output that moves by less than this fraction of its range gives no information on the
step."""


def step_remark(case: Case) -> str | None:
    """Say that a recipe's step is too coarse, or changes the motion; None if it does neither.

    The system is simulated more finely along a motion of the recipe, and at the recipe's step
    along the same. There is no remark if the system cannot be made with another step, or if its
    outputs do not move.
    """
    recipe, step = case.recipe, case.recipe.window.step
    try:
        system = case.system_with_step(step / FINER)
    except LoadError:
        return None
    names, outputs, inputs = _finer_outputs(recipe, system)
    if not names:
        return None
    if recipe.system.kind not in OWN_CURVES:
        other = _another_motion(case, names, outputs, inputs)
        if other is not None:
            return other
    # inputs or their rates may jump at samples, and some outputs follow them at once
    errors = np.minimum(between_samples(outputs, FINER), after_jumps(outputs, FINER))
    lost = np.max(errors)
    if lost > COARSE:
        return (
            f"window.step = {step:g} s: {TOO_COARSE} {names[int(np.argmax(errors))]} "
            f"differs by {percent(lost)} of its standard deviation from a smooth curve through "
            f"them; expected at most {100 * COARSE:g} %: give a smaller step where what is "
            "between the samples counts"
        )
    return None


def _another_motion(
    case: Case, names: list[str], outputs: FloatArray, inputs: FloatArray
) -> str | None:
    """Say that the system moves in another way at the recipe's step than at a finer one.

    Outputs of some names and inputs are those at the finer step.
    """
    system, true = case.system, outputs[::FINER]
    columns = [k for k, signal in enumerate(system.outputs) if signal.name in names]
    own = simulate(system, inputs[FINER - 1 :: FINER]).outputs[:, columns]
    errors = relative_rmse(own - true, size_about(true))
    name, apart = names[int(np.argmax(errors))], float(np.max(errors))
    if apart <= SAME:
        return None
    moves = hold_of(case.system.inputs) == "first_order"
    cause = (
        'where the model holds its inputs over a step, write hold = "zero_order" for them, or '
        "let it move them linearly; else "
        if moves
        else ""
    )
    return (
        f"window.step = {case.recipe.window.step:g} s: {name} differs by {percent(apart)} of its "
        f"standard deviation from a simulation with steps of a quarter, under the same inputs; "
        f"expected at most {100 * SAME:g} %: {cause}let the model take smaller steps of its own"
    )


def between_samples(outputs: FloatArray, every: int) -> FloatArray:
    """Return the error of a cubic spline through every ``every``-th output, (N, n_outputs).

    It is the RMSE of each output, relative to its standard deviation, shape (n_outputs,).
    """
    time = np.arange((len(outputs) - 1) // every * every + 1)
    true = outputs[: len(time)]
    error = CubicSpline(time[::every], true[::every])(time) - true
    return relative_rmse(error, size_about(true))


def after_jumps(outputs: FloatArray, every: int) -> FloatArray:
    """Return the error of a line between two samples of outputs (N, n_outputs), without jumps.

    Inputs that are held jump at the samples, and outputs that follow at once jump too: this loses
    nothing. So the line begins with the first of ``every`` finer samples, at least 3, and ends
    with the last. The error is scaled as in ``between_samples``.
    """
    true = outputs[1 : (len(outputs) - 1) // every * every + 1]
    pieces = true.reshape(-1, every, true.shape[1])
    part = np.linspace(0.0, 1.0, every)[:, None]
    line = pieces[:, :1] + part * (pieces[:, -1:] - pieces[:, :1])
    return relative_rmse((line - pieces).reshape(true.shape), size_about(true))


def _finer_outputs(recipe: Recipe, system: System) -> tuple[list[str], FloatArray, FloatArray]:
    """Simulate a motion more finely: the first that does not fail and moves outputs.

    Only moving outputs are returned, their names and values, shape (N + 1, n_moving), with the
    inputs, shape (N, n_inputs); without any if no motion moves one.
    """
    failure = None
    ranges = np.array([signal.high - signal.low for signal in system.outputs])
    names, moved, inputs = list[str](), None, np.empty((0, len(system.inputs)))
    for attempt in range(PROBE_ATTEMPTS):
        inputs = _finer_inputs(recipe, system, attempt)
        try:
            outputs = simulate(system, inputs).outputs
        except SimulationError as error:
            failure = error
            continue
        moving = np.std(outputs, axis=0) > STILL * ranges
        names = [
            signal.name for signal, moves in zip(system.outputs, moving, strict=True) if moves
        ]
        moved = outputs[:, moving]
        if names:
            break
    if moved is None:
        assert failure is not None
        raise failure
    return names, moved, inputs


def _finer_inputs(recipe: Recipe, system: System, attempt: int) -> FloatArray:
    """Draw inputs of a recipe, with values between the samples by their hold."""
    duration = FINE_SAMPLES * recipe.window.step
    stream = Stream(PROBE, recipe.data.seed, (1.0, 1.0), duration)
    inputs = draw(recipe.without_loops(), system, stream, 0, attempt).inputs[:FINE_SAMPLES]
    if hold_of(system.inputs) == "zero_order":
        return np.repeat(inputs, FINER, axis=0)
    before = np.concatenate([inputs[:1], inputs[:-1]])
    parts = np.arange(1, FINER + 1)[:, None] / FINER
    finer = [b + parts * (a - b) for b, a in zip(before, inputs, strict=True)]
    return on_circles(system.inputs, within_ranges(system.inputs, np.concatenate(finer)))
