"""Records from files are compared with an FMU, and its physical parameters are fitted to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slide_fmu.apps.calibrate.calibrate import calibrate, free_parameters, released_error
from slide_fmu.apps.calibrate.result import Calibration
from slide_fmu.core.files import write_whole
from slide_fmu.core.signals import FloatArray, Signal, on_circles
from slide_fmu.core.units import are_other
from slide_fmu.cosim.ssv import parameter_set
from slide_fmu.fmu.export import read_fmu
from slide_fmu.record_files.reading import read_records
from slide_fmu.record_files.record import MissingColumnsError, Record, RecordError
from slide_fmu.records.clock import clock_of_record
from slide_fmu.records.findings import examine, messages, require_sound
from slide_fmu.records.model import PAIRINGS
from slide_fmu.records.pairing import check_pairing
from slide_fmu.records.preparation import Pairing, Preparation, prepared
from slide_fmu.records.resampling import LONGER
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True)
class RecordFiles:
    """RecordFiles names the measured records and their columns.

    Attributes:
        paths: files of records with the same columns.
        inputs, outputs: columns by names of signals. Inputs that are not named have the column of
            their own name. If no output is named, outputs do too; otherwise the others do not
            count.
        time: column of times; None to find it.
        step: sample step in s of files without times.
        pairing: which output belongs to an input; by the hold of the inputs if None.
    """

    paths: tuple[str, ...]
    inputs: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    time: str | None = None
    step: float | None = None
    pairing: Pairing | None = None


@dataclass(frozen=True, eq=False)
class FittedCourse:
    """A FittedCourse is a record without gaps, next to the surrogate.

    Attributes:
        time: time in s since the begin of the record, (N,).
        measured, before, fitted: by name of each output, (N,) each: the record, and the surrogate
            at the start values and at the fitted values of the parameters.
    """

    time: FloatArray
    measured: Mapping[str, FloatArray]
    before: Mapping[str, FloatArray]
    fitted: Mapping[str, FloatArray]


def fitted_courses(
    fmu: Path, measured: RecordFiles, calibration: Calibration
) -> list[FittedCourse]:
    """Return the records of a calibration, from where the surrogate has seen a whole window.

    Arguments and errors are as in ``calibrate_fmu``, whose result is ``found``.
    """
    surrogate, _ = read_fmu(fmu)
    first = surrogate.network.memory_length
    names = [signal.name for signal in surrogate.outputs]

    def by_name(values: FloatArray) -> dict[str, FloatArray]:
        return {name: values[first:, index] for index, name in enumerate(names)}

    courses = []
    for driven, answers in zip(*_arrays(surrogate, measured)[:2], strict=True):
        time = np.asarray(surrogate.window.step * np.arange(1.0, len(answers) + 1))
        before, fitted = (
            by_name(surrogate.predict_newest(driven, values))
            for values in (calibration.fixed, calibration.values)
        )
        courses.append(FittedCourse(time[first:], by_name(answers), before, fitted))
    return [course for course in courses if len(course.time)]


def calibrate_fmu(
    fmu: Path, measured: RecordFiles, fixed: Mapping[str, float], seed: int
) -> tuple[Calibration, tuple[str, ...]]:
    """Fit the parameters of an FMU to records, resampled to its step.

    Args:
        fmu: an FMU of slide-fmu with parameters.
        measured: the records.
        fixed: values of parameters by name that are not fitted.
        seed: seed of the points at which the search begins.

    Returns:
        The result, and remarks about the records.

    Raises:
        FmuError: the file is not an FMU of slide-fmu.
        RecordError: a record cannot be read, lacks a column, has another unit or too long a step,
            or has a fault that must be corrected first.
        ValueError: as for ``calibrate``.
    """
    surrogate, provenance = read_fmu(fmu)
    free_parameters(surrogate, fixed)  # refused before long records are read
    inputs, outputs, remarks = _arrays(surrogate, measured)
    known = released_error(provenance, surrogate)
    calibration = calibrate(surrogate, inputs, outputs, fixed=fixed, own_error=known, seed=seed)
    return calibration, remarks


def write_parameters(calibration: Calibration, path: Path) -> None:
    """Write the values of all parameters as an SSV file, which sets them in an SSP.

    Raises:
        ValueError: the path does not end in ``.ssv``.
        OSError: the file cannot be written.
    """
    require_ssv(path)
    write_whole(path, parameter_set(calibration.values))


def require_ssv(path: Path) -> None:
    """Refuse a file name that importers do not recognise as a file of parameters."""
    if path.suffix != ".ssv":
        raise ValueError(f"parameters {str(path)!r}; expected a name ending in .ssv")


def _arrays(
    surrogate: Surrogate, measured: RecordFiles
) -> tuple[list[FloatArray], list[FloatArray], tuple[str, ...]]:
    """Return inputs and outputs of parts without gaps, and remarks about the records.

    They have the form of arguments of ``calibrate``.
    """
    inputs = _columns("input", surrogate.inputs, measured.inputs, every=True)
    outputs = _columns("output", surrogate.outputs, measured.outputs, every=False)
    pairing, step = measured.pairing or PAIRINGS[surrogate.hold], surrogate.window.step
    names = tuple(inputs.values()), tuple(outputs.values())
    preparation = Preparation(*names, step, surrogate.hold, pairing)
    try:
        records = read_records(
            measured.paths, (*names[0], *names[1]), time=measured.time, step=measured.step
        )
    except MissingColumnsError as error:
        given = {"--input": inputs, "--output": outputs}
        options = [
            f"{option} {name}=COLUMN"
            for option, columns in given.items()
            for name, column in columns.items()
            if column in error.missing
        ]
        raise RecordError("; ".join([str(error), *options])) from error
    remarks = _examined(records, preparation)
    _require_units(records[0], (*surrogate.inputs, *surrogate.outputs), {**inputs, **outputs})
    for record in records:
        _require_step(record, step)
    made = prepared(records, preparation)
    trajectories = [piece.trajectory for piece in made.pieces]
    driven = [on_circles(surrogate.inputs, trajectory.inputs) for trajectory in trajectories]
    answers = [_spread(trajectory.outputs[1:], outputs, surrogate) for trajectory in trajectories]
    return driven, answers, (*remarks, *made.remarks)


def _spread(values: FloatArray, measured: Mapping[str, str], surrogate: Surrogate) -> FloatArray:
    """Give every output a column, (N, n_outputs); outputs that were not measured are NaN."""
    columns = np.full((len(values), len(surrogate.outputs)), np.nan)
    columns[:, [signal.name in measured for signal in surrogate.outputs]] = values
    return columns


def _columns(
    what: str, signals: tuple[Signal, ...], named: Mapping[str, str], every: bool
) -> dict[str, str]:
    """Return the columns by names of signals, in the signals' order."""
    names = [signal.name for signal in signals]
    unknown = sorted(set(named) - set(names))
    if unknown:
        raise RecordError(
            f"--{what} names {unknown[0]!r}; expected one of the FMU's {what}s {names}: write "
            f"--{what} NAME=COLUMN"
        )
    return {name: named.get(name, name) for name in names if every or not named or name in named}


def _examined(records: tuple[Record, ...], preparation: Preparation) -> tuple[str, ...]:
    """Refuse records with faults that must be corrected, and return other findings.

    An input may rest, and an output with it, since nothing is trained here.
    """
    names = preparation.inputs, preparation.outputs
    findings = [*examine(records, *names), *check_pairing(records, preparation)]
    findings = [
        finding
        for finding in findings
        if not (finding.kind == "constant" and finding.column in preparation.inputs)
        and finding.kind not in ("noise", "set points")
    ]
    require_sound(findings)
    return messages(findings)


def _require_units(
    record: Record, signals: tuple[Signal, ...], columns: Mapping[str, str]
) -> None:
    """Refuse columns in another unit than their signals; those without a unit count as right."""
    for signal in signals:
        column = columns.get(signal.name)
        unit = record.units[column] if column is not None else ""
        if are_other(unit, signal.unit):
            raise RecordError(
                f"{record.path}: column {column!r} is in {unit}; expected {signal.unit}, the "
                f"FMU's unit of {signal.name!r}: convert the column and its header"
            )


def _require_step(record: Record, step: float) -> None:
    """Refuse a record whose step is longer than the FMU's."""
    own = clock_of_record(record).step
    if own > LONGER * step:
        raise RecordError(
            f"{record.path}: sample step {own:.6g} s; expected at most {step:.6g} s, the FMU's "
            "step, since nothing is known between samples: record with a shorter step"
        )
