"""The reference is simulated under inputs that are known as a function of time."""

from __future__ import annotations

import numpy as np

from slide_fmu.data.draws import Draw, drawn_outputs
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.validation.calls import MeasuredMotion
from slide_fmu.validation.input_courses import InputCourse, course_of
from slide_fmu.validation.smooth_inputs import fine_truth


def finest(case: Case) -> System | None:
    """Return the reference with its own fine step; None if it has none."""
    try:
        return case.reference_as_it_runs()
    except LoadError:
        return None


def reference_motion(
    surrogate: Surrogate,
    case: Case,
    inputs: InputCourse,
    fine: System | None,
    samples: tuple[int, int],
) -> MeasuredMotion:
    """Simulate the reference under some inputs, from rest on.

    Args:
        surrogate: the surrogate that is measured.
        case: what it was made from.
        inputs: the inputs.
        fine: the reference with its own fine step; without it the model knows samples alone, and
            what it is measured on follows from these.
        samples: number of samples, and that of the first sample that counts.

    Raises:
        SimulationError: the reference could not be simulated.
    """
    step, (count, first) = case.recipe.window.step, samples
    if fine is not None:
        times = case.finer_steps
        truth = fine_truth(fine, inputs, count * times)
        return MeasuredMotion(inputs, truth, step / times, first * step)
    rows = inputs(step * np.arange(count, dtype=np.float64))
    drawn = Draw(0, 1.0, None, rows, first)
    course = course_of(drawn, surrogate.inputs, step, surrogate.planned)
    return MeasuredMotion(course, drawn_outputs(case.reference, drawn), step, first * step)
