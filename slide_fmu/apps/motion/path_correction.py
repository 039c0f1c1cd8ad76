"""A path is corrected with an FMU, and may be compared with the reference model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from slide_fmu.apps.motion.compensation import Compensated, compensate
from slide_fmu.apps.motion.coordinates import coordinates_of
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import Judged, Margins, judge, margins_of, what_margins_are
from slide_fmu.apps.motion.path import read_path
from slide_fmu.apps.motion.set_points import MotionCurve, write_curve, write_inputs
from slide_fmu.apps.motion.solve import reference_of
from slide_fmu.apps.motion.task import PathTask, at_parameters, limits_of
from slide_fmu.core.figures import optional
from slide_fmu.core.progress import Stages, quiet_stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True, kw_only=True)
class PathErrors:
    """PathErrors are errors of a path before and after its correction, in the outputs' unit.

    ``times_less`` is None if the RMS error became zero.
    """

    rms_before: float
    rms_after: float
    largest_before: float
    largest_after: float
    times_less: float | None


@dataclass(frozen=True, kw_only=True)
class CorrectedFigures:
    """CorrectedFigures are the figures of a corrected path, for JSON files.

    Attributes:
        task: the task as in its file.
        unit: unit of the outputs, and so of all errors.
        margin_is: description of the margins.
        reference: errors by the reference model, if requested.
    """

    fmu: str
    task: PathTask
    unit: str
    margin_is: str
    predicted: PathErrors
    largest_margin: float
    known: float
    largest_condition: float
    largest_correction: tuple[float, ...]
    limits_used: Mapping[str, float]
    reference: PathErrors | None = optional()


@dataclass(frozen=True, eq=False)
class Corrected:
    """Corrected is a path task with its answer.

    Attributes:
        surrogate, task, limits, found: the surrogate, the task, its limits, and the result.
        margins: what the margins of predictions are.
        true_before, true_after: errors of the path and of the corrected one by the reference
            model, (count, n_outputs); None if not requested.
    """

    surrogate: Surrogate
    task: PathTask
    limits: Limits
    found: Compensated
    margins: Margins
    true_before: FloatArray | None = None
    true_after: FloatArray | None = None

    @property
    def margin(self) -> FloatArray:
        """The largest expected error of the prediction on the corrected path, (count,)."""
        return self._judged.margins[self.found.predictor.lead :]

    @cached_property
    def _judged(self) -> Judged:
        inputs = self.found.predictor.inputs(self.found.motion)
        return judge(self.surrogate, inputs[None], self.margins)[0]

    def figures(self) -> CorrectedFigures:
        """Return the figures."""
        found = self.found
        step = self.surrogate.window.step
        reference = None
        if self.true_before is not None and self.true_after is not None:
            reference = _compared(self.true_before, self.true_after)
        return CorrectedFigures(
            fmu=self.surrogate.name,
            task=self.task,
            unit=self.surrogate.outputs[0].unit,
            margin_is=what_margins_are(self.surrogate, self.margins),
            predicted=_compared(found.before, found.after),
            largest_margin=float(self.margin.max()),
            known=float(np.mean(self._judged.known[found.predictor.lead :])),
            largest_condition=float(found.condition.max()),
            largest_correction=tuple(np.abs(found.motion - found.path).max(axis=0).tolist()),
            limits_used=self.limits.used(found.motion[0], found.motion, step),
            reference=reference,
        )


def _compared(before: FloatArray, after: FloatArray) -> PathErrors:
    """Return both errors as distances."""
    one, other = (np.linalg.norm(error, axis=1) for error in (before, after))
    rms = [float(np.sqrt(np.mean(distance**2))) for distance in (one, other)]
    return PathErrors(
        rms_before=rms[0],
        rms_after=rms[1],
        largest_before=float(one.max()),
        largest_after=float(other.max()),
        times_less=rms[0] / rms[1] if rms[1] > 0 else None,
    )


def correct(
    fmu: Path, task: PathTask, verify: bool = False, bar: Stages = quiet_stages
) -> Corrected:
    """Correct the path of a task with an FMU.

    Args:
        fmu: an FMU of slide-fmu.
        task: the path.
        verify: whether to simulate the reference model along the path and along the corrected one.
        bar: opens the progress of a stage.

    Raises:
        FmuError: the file is not an FMU of slide-fmu.
        MotionError: the task does not fit the FMU, or has no answer.
        LoadError: the reference model is not installed here.
        SimulationError: it could not be simulated.
    """
    released, provenance = read_fmu(fmu)
    surrogate = at_parameters(released, task.parameters)
    coordinates = coordinates_of(surrogate.inputs)
    limits = limits_of(task.limits, coordinates)
    path = read_path(task.path, coordinates, surrogate)
    motion, wished = path.motion, path.wished
    margins = margins_of(released, provenance)
    terms = limits, wished, task.knots, bar("corrections"), margins
    found = compensate(surrogate, motion, *terms)
    corrected = Corrected(surrogate, task, limits, found, margins)
    if not verify:
        return corrected
    parameters, progress = task.parameters, bar("reference model")
    simulated, errors = reference_of(fmu, provenance, released, parameters, progress), []
    for tried in (found.path, found.motion):
        outputs = simulated(found.predictor.inputs(tried))[found.predictor.lead + 1 :]
        errors.append(outputs + found.rigid(tried) - found.target)
    return Corrected(surrogate, task, limits, found, margins, *errors)


def write_corrected(corrected: Corrected, path: Path, rate: float | None = None) -> str | None:
    """Write the corrected path as CSV, at the times of its samples from 0 on; return a remark.

    Without a rate, rows are the inputs at the surrogate's step; else see ``write_curve``.
    """
    surrogate, motion = corrected.surrogate, corrected.found.motion
    coordinates = corrected.found.predictor.coordinates
    if rate is None:
        write_inputs(surrogate, coordinates, motion, path)
        return None
    curve = MotionCurve(coordinates, motion, surrogate.window.step, corrected.limits)
    return write_curve(surrogate, curve, rate, path)
