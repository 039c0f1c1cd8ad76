"""A path is read, corrected with an FMU, and may be compared with the reference model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.apps.motion.compensation import CompensatedPath, compensate
from slide_fmu.apps.motion.coordinates import Coordinate, coordinates_of
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import Margins, Reliability, judge, margins_of, what_margins_are
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.set_points import MotionCurve, write_curve, write_inputs
from slide_fmu.apps.motion.solve import reference_of
from slide_fmu.apps.motion.task import PathTask, at_parameters, limits_of
from slide_fmu.core.figures import optional
from slide_fmu.core.progress import Stages, quiet_stages
from slide_fmu.core.signals import FloatArray, axis_positions
from slide_fmu.fmu.export import read_fmu
from slide_fmu.record_files.reading import read_record
from slide_fmu.record_files.record import Record, RecordError
from slide_fmu.surrogate.surrogate import Surrogate

LEAST_SAMPLES = 4
"""Smallest number of samples of a path, so that corrections can be cubic splines."""

MOST_SAMPLES = 1200
"""Largest number of samples of a path: memory grows with the square."""


ON_CIRCLE = 0.05
"""Tolerance of the radius of cosine and sine of an angle, relative to it: they are rounded."""


@dataclass(frozen=True, eq=False)
class SampledPath:
    """A SampledPath has samples at the step of a surrogate.

    Attributes:
        motion: coordinates, (count, n_coordinates).
        wished: wished outputs, (count, n_outputs); None if the file has none.
    """

    motion: FloatArray
    wished: FloatArray | None


def read_path(name: str, coordinates: tuple[Coordinate, ...], surrogate: Surrogate) -> SampledPath:
    """Read a path from a CSV, Parquet, HDF5, MAT or NumPy file; between samples are cubic splines.

    An angle has columns for its cosine and its sine, like set points.

    Raises:
        MotionError: the file cannot be read, lacks a column of an input, has only some of the
            outputs, has values that are not numbers, has times that do not rise, has too few or
            too many samples, or has columns that are not cosine and sine of an angle.
    """
    inputs, outputs = ([s.name for s in of] for of in (surrogate.inputs, surrogate.outputs))
    step = surrogate.window.step
    try:
        record = read_record(name, inputs, others=True)
    except RecordError as error:
        raise MotionError(str(error).replace("next to the recipe", "next to the task")) from error
    time = record.time
    if not np.all(np.diff(time) > 0):
        sample = int(np.argmax(np.diff(time) <= 0)) + 1
        raise MotionError(
            f"{name}: the time {time[sample]:g} s of sample {sample} comes after "
            f"{time[sample - 1]:g} s; expected times that rise: correct the file"
        )
    wished_outputs = [output for output in outputs if output in record.columns]
    if wished_outputs and len(wished_outputs) < len(outputs):
        raise MotionError(
            f"{name} has columns for {wished_outputs}; expected one for each of the outputs "
            f"{outputs}, or for none: add the others"
        )
    count = int((time[-1] - time[0]) / step + 0.5) + 1
    if not LEAST_SAMPLES <= count <= MOST_SAMPLES:
        raise MotionError(
            f"{name} takes {time[-1] - time[0]:g} s, which are {count} samples of {step:g} s; "
            f"expected {LEAST_SAMPLES} to {MOST_SAMPLES}: correct the times, or divide the path"
        )
    at = time[0] + step * np.arange(count)
    later = (
        step if surrogate.hold == "zero_order" else 0.0
    )  # their outputs belong to the end of a step
    wished = _sampled(record, wished_outputs, at + later) if wished_outputs else None
    motion = np.stack(axis_positions(surrogate.inputs, _sampled(record, inputs, at)), axis=1)
    _require_circles(record, inputs, coordinates)
    return SampledPath(motion, wished)


def _require_circles(
    record: Record, inputs: list[str], coordinates: tuple[Coordinate, ...]
) -> None:
    """Refuse columns of an angle that are not its cosine and sine, times the radius."""
    names = iter(inputs)
    for coordinate in coordinates:
        cosine = next(names)
        if coordinate.radius is None:
            continue
        sine = next(names)
        radius = np.hypot(record.columns[cosine], record.columns[sine])
        away = np.abs(radius - coordinate.radius)
        if away.max() > ON_CIRCLE * coordinate.radius:
            sample = int(np.argmax(away))
            raise MotionError(
                f"{record.path}: {cosine!r} and {sine!r} in sample {sample} lie "
                f"{radius[sample]:.4g} from 0; expected cosine and sine of an angle, "
                f"{coordinate.radius:.4g} from 0: correct the columns"
            )


def _sampled(record: Record, names: list[str], at: FloatArray) -> FloatArray:
    """Interpolate columns at times in s, (N,): shape (N, n_names); the end values hold."""
    values = np.stack([record.columns[name] for name in names], axis=1)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise MotionError(
            f"{record.path}: {names[column]!r} in sample {row} is no number; expected numbers "
            "throughout: correct the file"
        )
    within = np.clip(at, record.time[0], record.time[-1])
    return np.asarray(CubicSpline(record.time, values, bc_type="natural")(within))


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
class PathSolution:
    """A PathSolution is a path task with its answer.

    Attributes:
        surrogate, task, limits, compensated: the surrogate, the task, its limits, and the result.
        margins: what the margins of predictions are.
        true_before, true_after: errors of the path and of the corrected one by the reference
            model, (count, n_outputs); None if not requested.
    """

    surrogate: Surrogate
    task: PathTask
    limits: Limits
    compensated: CompensatedPath
    margins: Margins
    true_before: FloatArray | None = None
    true_after: FloatArray | None = None

    @property
    def margin(self) -> FloatArray:
        """The largest expected error of the prediction on the corrected path, (count,)."""
        return self._judged.margins[self.compensated.predictor.lead :]

    @cached_property
    def _judged(self) -> Reliability:
        inputs = self.compensated.predictor.inputs(self.compensated.motion)
        return judge(self.surrogate, inputs[None], self.margins)[0]

    def figures(self) -> CorrectedFigures:
        """Return the figures."""
        compensated = self.compensated
        corrections = np.abs(compensated.motion - compensated.path).max(axis=0)
        step = self.surrogate.window.step
        reference = None
        if self.true_before is not None and self.true_after is not None:
            reference = _compared(self.true_before, self.true_after)
        return CorrectedFigures(
            fmu=self.surrogate.name,
            task=self.task,
            unit=self.surrogate.outputs[0].unit,
            margin_is=what_margins_are(self.surrogate, self.margins),
            predicted=_compared(compensated.before, compensated.after),
            largest_margin=float(self.margin.max()),
            known=float(np.mean(self._judged.known[compensated.predictor.lead :])),
            largest_condition=float(compensated.condition.max()),
            largest_correction=tuple(corrections.tolist()),
            limits_used=self.limits.used(compensated.motion[0], compensated.motion, step),
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
) -> PathSolution:
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
    compensated = compensate(surrogate, motion, *terms)
    corrected = PathSolution(surrogate, task, limits, compensated, margins)
    if not verify:
        return corrected
    parameters, progress = task.parameters, bar("reference model")
    simulated, errors = reference_of(fmu, released, parameters, progress), []
    for tried in (compensated.path, compensated.motion):
        outputs = simulated(compensated.predictor.inputs(tried))[compensated.predictor.lead + 1 :]
        errors.append(outputs + compensated.rigid(tried) - compensated.target)
    return PathSolution(surrogate, task, limits, compensated, margins, *errors)


def write_corrected(corrected: PathSolution, path: Path, rate: float | None = None) -> str | None:
    """Write the corrected path as CSV, at the times of its samples from 0 on; return a remark.

    Without a rate, rows are the inputs at the surrogate's step; else see ``write_curve``.
    """
    surrogate, motion = corrected.surrogate, corrected.compensated.motion
    coordinates = corrected.compensated.predictor.coordinates
    if rate is None:
        write_inputs(surrogate, coordinates, motion, path)
        return None
    curve = MotionCurve(coordinates, motion, surrogate.window.step, corrected.limits)
    return write_curve(surrogate, curve, rate, path)
