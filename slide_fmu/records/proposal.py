"""This module proposes a first recipe for measured records."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.core.units import require_unit
from slide_fmu.propose.draft_signals import Ranges, names_of, proposed_name, require_name, widened
from slide_fmu.propose.proposal import InitOptions, Proposal
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftSignal
from slide_fmu.record_files.reading import read_records
from slide_fmu.record_files.record import (
    MissingColumnsError,
    NoTimesError,
    Record,
    RecordError,
)
from slide_fmu.records.clock import clock_of_record, neat_step
from slide_fmu.records.division import By
from slide_fmu.records.findings import examine
from slide_fmu.records.model import PAIRINGS, recognises
from slide_fmu.records.pairing import answer_of
from slide_fmu.records.preparation import Pairing, longest_piece
from slide_fmu.records.recipe_text import RecordDraft, record_recipe_text
from slide_fmu.records.repeats import same_inputs
from slide_fmu.records.rules import KIND
from slide_fmu.records.sizing import with_fitting_window
from slide_fmu.systems.declared import SignalTable

NO_TIMES = "none"
"""With this name as the column of times, the times in the files are not used."""


@dataclass(frozen=True)
class RecordOptions:
    """RecordOptions are the options of a user for a recipe of records.

    Attributes:
        paths: the files, at least one.
        inputs: ranges of inputs by the names of their columns; None for the measured range.
        outputs: columns that are outputs; all others if empty.
        step: sample step in s of files without times, else the step to resample to.
        time: column of times; found if None; where it is ``NO_TIMES``, the step counts alone.
        name: name of the recipe; the name of the first file if None.
        folder: folder of the new recipe; paths of files are relative to it.
    """

    paths: tuple[str, ...]
    inputs: Ranges = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    step: float | None = None
    time: str | None = None
    name: str | None = None
    folder: Path = Path()


def read_chosen(options: RecordOptions) -> tuple[tuple[Record, ...], dict[str, float | str]]:
    """Read the files, and return the keys with which a recipe reads them again.

    Columns that are not named are read only where no output is named.

    Raises:
        RecipeError: the times are not to be used, and no step is given.
        RecordError: a file cannot be read, or lacks a column.
    """
    try:
        return _read(options)
    except MissingColumnsError as error:
        named = {"--input": options.inputs, "--output": options.outputs, "--time": (options.time,)}
        wrong = [
            f"{option} COLUMN in place of {option} {name}"
            for option, names in named.items()
            for name in names
            if name in error.missing
        ]
        raise RecordError(f"{error}; {', '.join(wrong)}") from error


def _read(options: RecordOptions) -> tuple[tuple[Record, ...], dict[str, float | str]]:
    named = (*options.inputs, *options.outputs)
    read = partial(read_records, options.paths, named, others=not options.outputs)
    if options.time == NO_TIMES:
        if options.step is None:
            raise RecipeError(
                f"--time {NO_TIMES} without --step; expected the sample step in s of a record "
                "whose times are not used: add --step SECONDS"
            )
        return read(step=options.step), {"sample_step": options.step}
    try:
        return read(time=options.time), {} if options.time is None else {"time": options.time}
    except NoTimesError as error:
        if options.step is None:
            raise RecordError(
                f"{error}; with slide-fmu init: --time NAME, or --step SECONDS"
            ) from error
        return read(step=options.step), {"sample_step": options.step}


def chosen_columns(
    options: RecordOptions, record: Record
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the columns of inputs, and the columns of outputs.

    Raises:
        RecipeError: a column is both, or inputs or outputs are missing.
    """
    inputs, columns = tuple(options.inputs), list(record.columns)
    outputs = options.outputs or tuple(name for name in columns if name not in inputs)
    both = [name for name in inputs if name in outputs]
    if both:
        raise RecipeError(f"--input {both[0]} is an output too; expected one of both: remove one")
    if not inputs or not outputs:
        raise RecipeError(
            f"{record.path} has the columns {columns}; expected which of them are inputs, and at "
            "least one that is an output: give --input NAME, and --output NAME for those that the "
            "surrogate shall have"
        )
    return inputs, outputs


HELD = 0.5
"""Inputs count as held if more than this part of their samples equals the sample before."""
ENOUGH = 20_000
"""Least number of samples of different inputs in records for an error estimator."""
MANY = 10
"""From this number of records on, they are divided as wholes."""


def propose_from_options(options: InitOptions) -> Proposal | None:
    """Propose a recipe for the records that the options name; None where they name a model.

    The kind that the user gives decides, or else the endings of the names.

    Raises:
        LoadError, RecipeError: as of ``propose_record``.
        ValueError: the options hold some that are for models only.
    """
    models = options.model, *options.further
    if options.kind != KIND and (options.kind is not None or not all(map(recognises, models))):
        return None
    given: dict[str, object] = {
        "hold": options.hold,
        "fmu-step": options.fmu_step,
        "chain": options.chain,
        "loop": " ".join(options.loops) or None,
        "jumps": "" if options.jumps else None,
        "band": "" if options.bands else None,
    }
    for name, value in given.items():
        if value is not None:
            raise ValueError(
                f"{f'--{name} {value}'.strip()} for records; expected none: a record has its "
                "inputs as they were measured"
            )
    return propose_record(
        RecordOptions(
            models,
            options.inputs,
            options.outputs,
            options.step,
            options.time,
            options.name,
            options.folder,
        )
    )


def propose_record(options: RecordOptions) -> Proposal:
    """Propose a recipe for records, which are read and examined.

    Raises:
        LoadError: the records cannot be used as the recipe says.
        RecipeError: a file cannot be read or used, inputs or outputs are no columns of it, the
            name is not allowed for a recipe, or the records are too short for the memory of the
            machine.
    """
    require_name(options.name)
    try:
        return _proposed(options)
    except RecordError as error:
        raise RecipeError(str(error)) from error


def _proposed(options: RecordOptions) -> Proposal:
    records, parameters = read_chosen(options)
    names = chosen_columns(options, records[0])
    findings = examine(records, *names)
    refused = [finding.message for finding in findings if finding.severity == "refused"]
    if refused:
        raise RecordError("\n".join(refused))
    step, step_origin = _step(options, records[0])
    acts = _acts(records, names)
    if acts.pairing != PAIRINGS[acts.hold]:
        parameters["pairing"] = acts.pairing
    remarks = [finding.message for finding in findings]
    inputs = tuple(_signal(records, n, options.inputs.get(n), acts, remarks) for n in names[0])
    outputs = tuple(_signal(records, n, None, None, remarks) for n in names[1])
    _require_different((*names[0], *names[1]), (*inputs, *outputs))
    numbers = same_inputs([record.chosen(names[0]) for record in records])
    different = int(numbers.max()) + 1
    by, by_origin = _division(len(records), different < len(numbers))
    whole = all(np.isfinite(record.chosen(names[1])).all() for record in records)
    name = proposed_name(options.paths[0], options.name)
    draft = RecordDraft(
        name,
        f"{name}: inputs {names_of(inputs)}, outputs {names_of(outputs)}, from measured records",
        inputs,
        outputs,
        step,
        step_origin,
        tuple(Path(os.path.relpath(path, options.folder)).as_posix() for path in options.paths),
        by,
        by_origin,
        whole and different >= ENOUGH,
        parameters,
    )
    draft, more = with_fitting_window(draft, options.paths)
    return Proposal(record_recipe_text(draft), draft, (*remarks, *more))


def _division(records: int, comes_again: bool) -> tuple[By, str]:
    """Return the division of records, and its reason."""
    if records >= MANY and not comes_again:
        return "record", "There are many records: each of them is in one part as a whole."
    origin = "The records are cut in the order of time: training first, test last."
    if comes_again:
        origin += " Samples of inputs that come again are in one part, if enough others are left."
    return "block", origin


def _step(options: RecordOptions, record: Record) -> tuple[float, str]:
    if options.step is not None:
        return options.step, "The sample step in s that was given."
    clock = clock_of_record(record)
    return neat_step(
        clock, clock.longest(len(record.time))
    ), "The sample step in s of the first file."


class InputBehaviour(NamedTuple):
    """An InputBehaviour has hold and pairing of inputs, with the evidence for both."""

    hold: Hold
    pairing: Pairing
    origin: str


def _acts(
    records: Sequence[Record], names: tuple[tuple[str, ...], tuple[str, ...]]
) -> InputBehaviour:
    """Find hold and pairing of inputs by a linear fit of the first record's longest piece."""
    inputs, outputs = longest_piece(records[0], *names)
    answer = answer_of(inputs, outputs)
    pairing = None if answer is None else answer.pairing
    still = len(inputs) > 1 and bool(np.all(np.mean(np.diff(inputs, axis=0) == 0, axis=0) > HELD))
    if pairing == "later" or (pairing is None and still):
        return InputBehaviour(
            "zero_order",
            "later",
            "The input is held between samples, since outputs answer one sample later."
            if pairing
            else "The input is held between samples, since most of them equal the one before.",
        )
    return InputBehaviour(
        "first_order",
        "same",
        "The input moves between samples, as measured ones do"
        + (", and outputs answer it at once." if pairing else "."),
    )


def _signal(
    records: Sequence[Record],
    column: str,
    given: tuple[float, float] | None,
    acts: InputBehaviour | None,
    remarks: list[str],
) -> DraftSignal:
    """Return a signal with its range: given or measured, and a little wider for outputs."""
    low, high = _measured(records, column)
    origin = "What was measured."
    if given is not None:
        (low, high), origin = given, "The range was given."
    elif acts is None:
        low, high = widened(low, high)
        origin = "What was measured, and a little more at both ends."
    name = re.sub(r"[^\w.\[\]]+", "_", column).strip("_") or "signal"
    unit = records[0].units[column] or None
    try:
        require_unit(name, unit or "1")
    except ValueError:
        remarks.append(
            f"column {column!r} has the unit {unit!r}, which FMI does not know: the recipe says "
            '"1"; give another one there, such as "mm" or "kN"'
        )
        unit = "1"
    start = min(max(_start(records[0], column), low), high)
    table = SignalTable(
        unit=unit,
        range=(low, high),
        start=start,
        hold=None if acts is None else acts.hold,
        column=None if name == column else column,
    )
    return DraftSignal(name, table, origin, "" if acts is None else acts.origin)


def _require_different(columns: Sequence[str], signals: Sequence[DraftSignal]) -> None:
    """Refuse columns whose names differ only in characters that no signal can have."""
    known: dict[str, str] = {}
    for column, signal in zip(columns, signals, strict=True):
        if signal.name in known:
            raise RecordError(
                f"columns {known[signal.name]!r} and {column!r} would both be the signal "
                f"{signal.name!r}; expected names that differ in letters or digits: rename one"
            )
        known[signal.name] = column


def _start(record: Record, column: str) -> float:
    """Return the start value: the median of all measured values."""
    return float(f"{np.median(_finite(record, column)):.3g}")


def _measured(records: Sequence[Record], column: str) -> tuple[float, float]:
    """Return the least and largest value of a column, rounded outwards to three digits."""
    values = np.concatenate([_finite(record, column) for record in records])
    low, high = float(values.min()), float(values.max())
    unit = 10.0 ** (math.floor(math.log10(high - low)) - 2)
    return _neat(math.floor(low / unit) * unit), _neat(math.ceil(high / unit) * unit)


def _finite(record: Record, column: str) -> FloatArray:
    """Return the values of a column that are numbers; others count as gaps."""
    values = record.columns[column]
    return np.asarray(values[np.isfinite(values)])


def _neat(value: float) -> float:
    return float(f"{value:.12g}")
