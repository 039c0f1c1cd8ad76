"""The reference is simulated under inputs that are known as functions of time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from slide_fmu.data.draws import Draw
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Motion, System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate_motions
from slide_fmu.validation.calls import MeasuredMotion
from slide_fmu.validation.input_courses import InputCourse, course_of
from slide_fmu.validation.smooth_inputs import fine_truths


def finest(case: Case) -> System | None:
    """Return the reference with its own fine step; None if it has none."""
    try:
        return case.reference_as_it_runs()
    except LoadError:
        return None


def reference_motions(
    surrogate: Surrogate,
    case: Case,
    every: Sequence[InputCourse],
    fine: System | None,
    samples: Sequence[tuple[int, int]],
) -> Iterator[MeasuredMotion | SimulationError]:
    """Simulate the reference under inputs, from rest on, all at once where it offers that.

    Args:
        surrogate: the surrogate that is measured.
        case: what it was made from.
        every: the inputs.
        fine: the reference with its own fine step; without it the model knows samples alone, and
            what it is measured on follows from these.
        samples: of each of the inputs, number of samples, and that of the first one that counts.

    Yields:
        The motion of each, or why it could not be simulated.
    """
    step, courses, times = case.recipe.window.step, list(every), 1
    if fine is not None:
        times = case.finer_steps
        truths = fine_truths(fine, courses, [count * times for count, _ in samples])
    else:
        drawn = [
            Draw(0, 1.0, None, inputs(step * np.arange(count, dtype=np.float64)), first)
            for inputs, (count, first) in zip(every, samples, strict=True)
        ]
        courses = [course_of(one, surrogate.inputs, step, surrogate.planned) for one in drawn]
        truths = simulate_motions(case.reference, [Motion(one.inputs) for one in drawn])
    for course, truth, (_, first) in zip(courses, truths, samples, strict=True):
        if isinstance(truth, SimulationError):
            yield truth
        else:
            yield MeasuredMotion(course, truth, step / times, first * step)


def reference_motion(
    surrogate: Surrogate,
    case: Case,
    inputs: InputCourse,
    fine: System | None,
    samples: tuple[int, int],
) -> MeasuredMotion:
    """Simulate the reference under one input, as ``reference_motions`` does.

    Raises:
        SimulationError: the reference could not be simulated.
    """
    (motion,) = reference_motions(surrogate, case, [inputs], fine, [samples])
    if isinstance(motion, SimulationError):
        raise motion
    return motion
