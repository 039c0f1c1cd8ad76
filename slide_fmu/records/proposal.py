"""This module proposes a first recipe for measured records."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.core.units import require_unit
from slide_fmu.propose.draft_signals import Ranges, names_of, proposed_name, require_name, widened
from slide_fmu.propose.proposal import InitOptions, Proposal, RefusedProposalError
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftSignal
from slide_fmu.record_files.record import (
    MissingColumnsError,
    NoTimesError,
    Record,
    RecordError,
)
from slide_fmu.records.clock import clock_of, clock_of_record, neat_step
from slide_fmu.records.division import By
from slide_fmu.records.filling import filled, runs_of
from slide_fmu.records.findings import MOST_GAPS, Finding, examine, messages
from slide_fmu.records.keys import REST, RecordKeys
from slide_fmu.records.model import HOLD, PAIRINGS, recognises
from slide_fmu.records.pairing import answer_of
from slide_fmu.records.preparation import Pairing, longest_piece
from slide_fmu.records.recipe_text import FEW_SAMPLES, Mend, RecordDraft, record_recipe_text
from slide_fmu.records.repeats import connected, same_inputs
from slide_fmu.records.rest import begins_at_rest
from slide_fmu.records.rules import KIND
from slide_fmu.records.sizing import NoWindowError, with_fitting_window
from slide_fmu.systems.declared import Parameter, SignalTable
from slide_fmu.systems.errors import LoadError

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
        read: further keys of ``system.parameters`` that say how files are read.
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
    read: Mapping[str, Parameter] = field(default_factory=dict)


def read_chosen(options: RecordOptions) -> tuple[tuple[Record, ...], dict[str, Parameter]]:
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


def _read(options: RecordOptions) -> tuple[tuple[Record, ...], dict[str, Parameter]]:
    if options.time == NO_TIMES:
        if options.step is None:
            raise RecipeError(
                f"--time {NO_TIMES} without --step; expected the sample step in s of a record "
                "whose times are not used: add --step SECONDS"
            )
        return _read_with(options, {"sample_step": options.step})
    try:
        return _read_with(options, {} if options.time is None else {"time": options.time})
    except NoTimesError as error:
        if options.step is None:
            raise RecordError(
                f"{error}; with slide-fmu init: --time NAME, or --step SECONDS"
            ) from error
        return _read_with(options, {"sample_step": options.step})


def _read_with(
    options: RecordOptions, clock: dict[str, Parameter]
) -> tuple[tuple[Record, ...], dict[str, Parameter]]:
    """Read the files with the keys of the options and of their clock; return all keys too."""
    parameters = {**clock, **options.read}
    keys = RecordKeys.of(parameters, f"--read of {options.paths[0]}")
    names = (*options.inputs, *options.outputs)
    return keys.read(options.paths, names, others=not options.outputs), parameters


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
MANY_GAPS, MOST_LOST, SINGLY = 10, 0.05, 2
"""Samples count as lost singly in at least so many gaps of a record, which take at most this part
of it, and most of which have at most so many samples."""

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
            options.read,
        )
    )


def propose_record(options: RecordOptions) -> Proposal:
    """Propose a recipe for records, which are read and examined.

    Raises:
        LoadError: the records cannot be used as the recipe says.
        RefusedProposalError: the records are read, but cannot be used as they are; the error has
            a recipe whose comments say what would have to change.
        RecipeError: a file cannot be read, inputs or outputs are no columns of it, or the name is
            not allowed for a recipe.
    """
    require_name(options.name)
    try:
        records, parameters = read_chosen(options)
        names = chosen_columns(options, records[0])
        fill = None if "fill" in options.read else _lost_singly(records, [*names[0], *names[1]])
        if fill is None:
            return _proposed(options, records, parameters, names)
        options = replace(options, read={**options.read, "fill": fill})
        records, parameters = read_chosen(options)
        proposal = _proposed(options, records, parameters, names)
        remark = (
            f"samples are lost singly, so that the recipe says fill = {fill}: up to so many in a "
            "row are filled, and count as measured. Without the key the record is cut there"
        )
        return replace(proposal, remarks=(remark, *proposal.remarks))
    except RecordError as error:
        raise RecipeError(str(error)) from error


def _lost_singly(records: Sequence[Record], names: Sequence[str]) -> int | None:
    """Return how many samples in a row are to be filled where many are lost singly, else None."""
    lost, known = list[int](), 0
    for record in records:
        if not (np.diff(record.time) > 0).any() or not np.isfinite(record.time).all():
            return None  # such a record is refused
        clock = clock_of_record(record)
        lost += [round(gap.length / clock.step) - 1 for gap in clock.gaps]
        missing = np.any(~np.isfinite(record.chosen(tuple(names))), axis=1)
        lost += [end - begin for begin, end in runs_of(np.asarray(missing))]
        known += len(record.time)
    if len(lost) < MANY_GAPS * len(records) or sum(lost) > MOST_LOST * known:
        return None
    usual = math.ceil(np.quantile(lost, MOST_GAPS))
    return usual if 0 < usual <= SINGLY else None


def _proposed(
    options: RecordOptions,
    records: tuple[Record, ...],
    parameters: dict[str, Parameter],
    names: tuple[tuple[str, ...], tuple[str, ...]],
) -> Proposal:
    findings = examine(records, *names)
    refused = [finding for finding in findings if finding.severity == "refused"]
    if refused:
        mended = _mended(records, findings)
        draft, _ = _draft(options, mended, names, parameters)
        raise _refusal(draft, "\n".join(messages(refused)), findings)
    whole = tuple(filled(record, *names, HOLD) for record in records)
    draft, remarks = _draft(options, whole, names, parameters)
    try:
        draft, more = with_fitting_window(draft, options.paths)
    except NoWindowError as error:
        raise _refusal(draft, str(error), findings, error.remaining) from error
    except LoadError as error:
        raise _refusal(draft, str(error), findings) from error
    return Proposal(record_recipe_text(draft), draft, (*remarks, *more))


def _refusal(
    draft: RecordDraft,
    reason: str,
    findings: Sequence[Finding],
    remaining: float | None = None,
) -> RefusedProposalError:
    """Return the error of records that cannot be used as they are, with the draft's recipe."""
    keys = {key: value for finding in findings for key, value in finding.keys.items()}
    step = max((finding.step for finding in findings if finding.step), default=None)
    text = record_recipe_text(replace(draft, mend=Mend(reason, keys, remaining, step)))
    return RefusedProposalError(reason, text)


def _mended(records: Sequence[Record], findings: Sequence[Finding]) -> tuple[Record, ...]:
    """Return records without the numbers that stand for missing values, as far as they show."""
    codes = {(f.path, f.column): f.keys["missing"] for f in findings if "missing" in f.keys}
    return tuple(
        replace(
            record,
            columns={
                name: np.where(values == codes.get((record.path, name)), np.nan, values)
                for name, values in record.columns.items()
            },
        )
        for record in records
    )


def _draft(
    options: RecordOptions,
    records: tuple[Record, ...],
    names: tuple[tuple[str, ...], tuple[str, ...]],
    parameters: dict[str, Parameter],
) -> tuple[RecordDraft, list[str]]:
    """Return what a recipe says on the records, and remarks on their units."""
    step, step_origin = _step(options, records[0])
    acts = _acts(records, names)
    if acts.pairing != PAIRINGS[acts.hold]:
        parameters = {"pairing": acts.pairing, **parameters}
    remarks: list[str] = []
    if all(_rests(record, names) for record in records):
        parameters = {**parameters, "start": REST}
        remarks.append(
            'every file begins at rest, so that the recipe says start = "rest": no sample is lost '
            "as a lead before its first one; remove the key if the machine moved before"
        )
    inputs = tuple(_signal(records, n, options.inputs.get(n), acts, remarks) for n in names[0])
    outputs = tuple(_signal(records, n, None, None, remarks) for n in names[1])
    _require_different((*names[0], *names[1]), (*inputs, *outputs))
    inputs_of_records = [record.chosen(names[0]) for record in records]
    numbers = same_inputs(inputs_of_records)
    different = int(numbers.max()) + 1
    groups = _groups([len(one) for one in inputs_of_records], numbers)
    by, by_origin = _division(groups, different < len(numbers))
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
        None if whole and different >= ENOUGH else FEW_SAMPLES,
        parameters,
    )
    return draft, remarks


def _groups(lengths: Sequence[int], numbers: NDArray[np.intp]) -> int:
    """Count groups of records that have no inputs in common, by the numbers of all inputs."""
    count = len(lengths)
    of_sample = np.repeat(np.arange(count), lengths)
    groups = connected(of_sample, count + numbers, count + int(numbers.max()) + 1)[:count]
    return len(np.unique(groups))


def _division(groups: int, comes_again: bool) -> tuple[By, str]:
    """Return the division of records of so many groups of inputs, and its reason."""
    if groups >= MANY:
        reason = "There are many records: each of them is in one part as a whole"
        again = ", with the inputs that come again in it" if comes_again else ""
        return "record", f"{reason}{again}."
    origin = (
        "The records are cut into blocks. Each part has up to five, spread over the records, as "
        "far as the memory of the machine leaves room (data.blocks)."
    )
    if comes_again:
        origin += " Samples of inputs that come again are in one part, if enough others are left."
    return "block", origin


def _step(options: RecordOptions, record: Record) -> tuple[float, str]:
    if options.step is not None:
        return options.step, "The sample step in s that was given."
    times = record.time[np.isfinite(record.time)]
    if not (np.diff(times) > 0).any():  # such a record is refused
        return 1.0, "The times of the first file do not say the step: write it in s."
    clock = clock_of(times)
    return neat_step(clock, clock.longest(len(times))), "The sample step in s of the first file."


def _rests(record: Record, names: tuple[tuple[str, ...], tuple[str, ...]]) -> bool:
    """Tell whether a record shows that it begins at rest."""
    inputs, outputs = (record.chosen(columns) for columns in names)
    gaps = np.flatnonzero(~np.isfinite(inputs).all(axis=1))
    whole = slice(0, int(gaps[0]) if len(gaps) else None)
    return len(inputs[whole]) > 0 and begins_at_rest(inputs[whole], outputs[whole])


class InputBehaviour(NamedTuple):
    """An InputBehaviour has hold and pairing of inputs, with the evidence for both."""

    hold: Hold
    pairing: Pairing
    origin: str


def _acts(
    records: Sequence[Record], names: tuple[tuple[str, ...], tuple[str, ...]]
) -> InputBehaviour:
    """Find hold and pairing of inputs by a linear fit of the first record's longest piece."""
    rises = np.isfinite(records[0].time).all() and (np.diff(records[0].time) > 0).any()
    if not rises:  # such a record is refused
        return InputBehaviour("first_order", "same", "The input moves between samples.")
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
    values = _finite(record, column)
    return float(f"{np.median(values):.3g}") if len(values) else 0.0


def _measured(records: Sequence[Record], column: str) -> tuple[float, float]:
    """Return the least and largest value of a column, rounded outwards to three digits."""
    values = np.concatenate([_finite(record, column) for record in records])
    if not len(values) or values.min() == values.max():  # such a column is refused
        middle = float(values[0]) if len(values) else 0.0
        return middle - 1.0, middle + 1.0
    low, high = float(values.min()), float(values.max())
    unit = 10.0 ** (math.floor(math.log10(high - low)) - 2)
    return _neat(math.floor(low / unit) * unit), _neat(math.ceil(high / unit) * unit)


def _finite(record: Record, column: str) -> FloatArray:
    """Return the values of a column that are numbers; others count as gaps."""
    values = record.columns[column]
    return np.asarray(values[np.isfinite(values)])


def _neat(value: float) -> float:
    return float(f"{value:.12g}")
