"""An FMU is measured, or simulated alone, under inputs from a file of the user."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.core.figures import optional
from slide_fmu.core.files import write_whole
from slide_fmu.core.progress import Stages
from slide_fmu.core.search_path import find_file
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.pipeline.apps import check_origins
from slide_fmu.pipeline.measurement import require_another, usual_level
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.record_files.inputs import InputTable, read_inputs
from slide_fmu.validation.calls import ErrorLevels
from slide_fmu.validation.measure import Meter, your_rows
from slide_fmu.validation.own_view import FileRun, simulated
from slide_fmu.validation.row import Call, Row
from slide_fmu.validation.validate import require_same_origin
from slide_fmu.validation.your_inputs import JudgingPart


@dataclass(frozen=True, kw_only=True)
class YourInputsFigures:
    """These are the figures of an FMU under a file of inputs.

    Attributes:
        inputs: name of the file.
        sha256: its hash.
        judging: the part of it that was measured, in words.
        begin_s, end_s: begin and end of this part in s, as the file has its times.
        remark: what of the file was learnt from, if anything.
        rows: the part in all calls and at all communication steps.
    """

    inputs: str
    sha256: str
    judging: str
    begin_s: float
    end_s: float
    remark: str | None = optional()
    rows: tuple[Row, ...]


def measure_inputs(fmu: Path, case: Case, file: Path, bar: Stages) -> YourInputsFigures:
    """Measure an FMU against its reference under the inputs of a file.

    The whole file counts, unless the FMU has learnt from a part of it: then only the part behind.
    Errors count as harmful relative to the usual level that the FMU carries.

    Args:
        fmu: the FMU.
        case: the case of its recipe (``released_case``).
        file: the file of inputs.
        bar: opens the progress of a stage.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        StageError: it is found under the name of its own reference, or its records have changed.
        RecordError: the file of inputs cannot be read, or leaves the ranges of the inputs.
        LoadError: there is no reference that can be simulated.
        CoSimulationError, SimulationError: FMU or reference fail.
    """
    surrogate, provenance = read_fmu(fmu)
    check_origins(surrogate, provenance)
    require_another(fmu, case.recipe)
    require_same_origin(case.source, dict(provenance or {}), str(fmu))
    known = _learnt_from(case.recipe, find_file(str(file)))
    table = read_inputs(str(file), surrogate.inputs, known.columns if known else {})
    table.require_in_range()
    part, remark = _judging_part(known, table)
    usual = usual_level(provenance)
    with unpacked(fmu) as files:
        levels = ErrorLevels(np.zeros(len(surrogate.outputs)), usual)
        rows = your_rows(Meter(files, surrogate, levels), case, [part], bar)
    start = float(table.record.time[0])
    return YourInputsFigures(
        inputs=file.name,
        sha256=table.record.digest,
        judging=part.words,
        begin_s=start + part.begin,
        end_s=start + table.duration,
        remark=remark,
        rows=tuple(rows),
    )


def _learnt_from(recipe: Recipe, file: Path) -> Recorded | None:
    """Return the kind of a recipe that learns most of a file; None if none does."""
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    kinds = [kind for kinds in recipe.tables_of_kinds().values() for kind in kinds]
    learnt = [kind for kind in kinds if isinstance(kind, Recorded) and kind.digest == digest]
    return max(learnt, key=lambda kind: kind.learnt, default=None)


def _judging_part(kind: Recorded | None, table: InputTable) -> tuple[JudgingPart, str | None]:
    """Return the part of a file that a kind does not learn, and a remark if that is not all."""
    name = Path(table.record.path).name
    if kind is None:
        return JudgingPart(name, table, 0.0), None
    if kind.judges:
        return JudgingPart.of(kind, table), f"the FMU has learnt from the rest of {name}"
    return JudgingPart(name, table, 0.0), (
        f"the FMU has learnt from the whole file {name}, so these figures are no test of what it "
        "promises for others"
    )


def simulate_inputs(fmu: Path, file: Path, call: Call, step: float | None) -> FileRun:
    """Run an FMU along the inputs of a file; values beyond the ranges are allowed.

    Args:
        fmu: an FMU of slide-fmu.
        file: the file of inputs.
        call: ``plain`` or ``known``.
        step: the communication step in s; the FMU's own if None.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        RecordError: the file of inputs cannot be read.
        CoSimulationError: the FMU reports an error, or takes no such step.
        ValueError: the inputs are shorter than a step.
    """
    surrogate, _ = read_fmu(fmu)
    table = read_inputs(str(file), surrogate.inputs)
    with unpacked(fmu) as files:
        return simulated(files, surrogate, table, call, step or files.step)


def write_outputs(made: FileRun, path: Path) -> None:
    """Write times, inputs, outputs and what the FMU says of them as CSV.

    Raises:
        ValueError: the path does not end in ``.csv``.
        OSError: the file cannot be written.
    """
    if path.suffix.lower() != ".csv":
        raise ValueError(f"{str(path)!r}; expected a file that ends in .csv: rename it")
    rows = np.stack([made.times, *made.columns.values()], axis=1)
    lines = [",".join(["time", *made.columns])]
    lines += [",".join(f"{value:.9g}" for value in row) for row in rows.tolist()]
    write_whole(path, ("\n".join(lines) + "\n").encode("utf-8"))
