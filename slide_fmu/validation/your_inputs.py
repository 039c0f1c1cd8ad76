"""An FMU is measured under the user's own inputs, of which a file holds what it will see.

One file is one observation: its errors resemble each other, and another drive may have others. Of
a file that a recipe names, only the part behind the learnt one is measured. Inputs that move go
straight from sample to sample of the file. Inputs that are held have over each communication step
the value that the file has at its begin: so an importer sets them, for the model too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, moves
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.record_files.inputs import SLACK, InputTable
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.calls import InputsLabel, MeasuredMotion
from slide_fmu.validation.input_courses import InputCourse, Stairs
from slide_fmu.validation.reference_motion import finest, reference_motion
from slide_fmu.validation.row import YOURS


@dataclass(frozen=True, eq=False)
class JudgingPart:
    """A JudgingPart is the part of a file of inputs by which an FMU is judged.

    Attributes:
        words: the part, for people.
        table: the inputs.
        begin: time in s from the first sample of the file on, from which outputs count.
    """

    words: str
    table: InputTable
    begin: float

    @classmethod
    def of(cls, kind: Recorded, table: InputTable, name: str | None = None) -> JudgingPart:
        """Return the part of a file that the trainings of its kind never see."""
        return cls(kind.judging(name), table, kind.learnt * table.duration)


@final
@dataclass(frozen=True, eq=False)
class FromFile:
    """FromFile are the inputs of a file from some time on; before the file they are constant.

    Attributes:
        table: the inputs.
        begin: time in s from the first sample of the file on; negative before it.
    """

    table: InputTable
    begin: float

    def __call__(self, times: FloatArray) -> FloatArray:
        return self.table.at(self.begin + times)


def course_from(table: InputTable, begin: float, step: float, count: int) -> InputCourse:
    """Return the inputs of a file from some time on, over ``count`` communication steps in s."""
    course = FromFile(table, begin)
    if moves(table.signals):
        return course
    return Stairs(step, course(step * np.arange(count, dtype=np.float64)))


def judging_parts(recipe: Recipe, surrogate: Surrogate) -> list[JudgingPart]:
    """Return the parts of a recipe's files that judge its FMU.

    Raises:
        ValueError: a file cannot be read, or lacks an input.
    """
    files = [k for k in recipe.data.excitation if isinstance(k, Recorded) and k.judges]
    names = [kind.name for kind in files]
    called = [k.name if names.count(k.name) == 1 else k.path for k in files]
    signals = tuple(surrogate.inputs)
    return [
        JudgingPart.of(kind, kind.table(signals), name)
        for kind, name in zip(files, called, strict=True)
    ]


def your_motions(
    surrogate: Surrogate,
    case: Case,
    parts: Sequence[JudgingPart],
    steps: float,
    progress: Progress,
) -> dict[InputsLabel, MeasuredMotion]:
    """Simulate the reference under parts of files, so that all their samples count.

    Motions begin earlier by as long as model, window and error bound remember, with what the file
    has there; where it has nothing, inputs rest at its first values, as those of an FMU do.

    Args:
        surrogate: the surrogate that is measured.
        case: what it was made from.
        parts: the parts of files.
        steps: number of communication steps in the surrogate's own step.
        progress: called with the number of motions that are done, and of all.

    Raises:
        SimulationError: the reference could not be simulated; the message names the file.
        ValueError: a part is shorter than a sample.
    """
    angle = any(signal.angle is not None for signal in surrogate.inputs)
    fine = None if surrogate.planned or angle else finest(case)
    motions: dict[InputsLabel, MeasuredMotion] = {}
    progress(0, len(parts))
    for part in parts:
        try:
            motion = _motion(surrogate, case, part, fine, steps)
        except SimulationError as error:
            raise SimulationError(
                f"{YOURS}, {part.words}: the reference could not be simulated, so nothing can be "
                f"promised for them: {error}; correct the file, or leave it out",
                error.time,
            ) from error
        motions[InputsLabel(YOURS, part.words)] = motion
        progress(len(motions), len(parts))
    return motions


def _motion(
    surrogate: Surrogate, case: Case, part: JudgingPart, fine: System | None, steps: float
) -> MeasuredMotion:
    recipe, step = case.recipe, case.recipe.window.step
    filling = 0 if surrogate.bound is None else surrogate.bound.filling_length
    burn_in = round(recipe.data.burn_in / step)
    lead = max(burn_in + 1, surrogate.network.memory_length, filling)
    # the samples of the motion are multiples of the step from the first sample of the file on
    start = math.floor(part.begin / step + SLACK) - lead
    count = math.floor(part.table.duration / step + SLACK) - start
    if count <= lead:
        raise ValueError(
            f"{YOURS}, {part.words}: {part.table.duration - part.begin:.4g} s; expected at least "
            f"a sample of the FMU, {step:g} s"
        )
    inputs = course_from(part.table, start * step, step / steps, math.ceil(count * steps))
    return reference_motion(surrogate, case, inputs, fine, (count, lead))
