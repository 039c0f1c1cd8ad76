"""This module makes the source of data of kind "record" from measured records."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import final

import numpy as np

from slide_fmu.core.file_kinds import RECORD_FORMATS
from slide_fmu.core.search_path import find_file
from slide_fmu.core.signals import FloatArray, Hold, Signal, hold_of
from slide_fmu.core.units import are_other
from slide_fmu.record_files.record import MissingColumnsError, Record, RecordError
from slide_fmu.records.filling import filled
from slide_fmu.records.findings import OF_FILE, examine, messages, require_sound
from slide_fmu.records.keys import RecordKeys
from slide_fmu.records.noise_record import Noise, noise_at_rest, remarks_on_noise
from slide_fmu.records.pairing import check_pairing
from slide_fmu.records.preparation import Pairing, Piece, Preparation, prepared
from slide_fmu.records.repeats import same_inputs
from slide_fmu.systems.base import Source
from slide_fmu.systems.declared import SignalTable, SignalTables
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.specification import Specification

HOLD: Hold = "first_order"
"""Measured inputs are samples of signals that move, unless the recipe gives another hold."""
PAIRINGS: dict[Hold, Pairing] = {"first_order": "same", "zero_order": "later"}
"""The pairing follows from the hold of the inputs, unless the recipe names one."""


@final
class MeasuredRecords(Source):
    """Measured records of one system, cut where samples are missing, with one even step.

    Attributes:
        pieces: pieces without gaps, in the order of the files.
        files: names of the files, by the file number of the pieces.
        digests: SHA-256 of each file, by the same number.
        identity: SHA-256 of each file as numbers, shape (number of files, 32).
        numbers: numbers of the inputs of all pieces end to end, shape (sum of N,); the same where
            inputs are the same (``slide_fmu.records.repeats``).
        faults: those of the remarks that are about faults of the files, which may pass for
            properties of the machine.
        noise_record: outputs that were recorded at rest; None without a noise record.
    """

    sampled_only = True
    answered_in = "slide_fmu.records.answers"

    def __init__(
        self,
        signals: tuple[tuple[Signal, ...], tuple[Signal, ...]],
        pieces: tuple[Piece, ...],
        records: tuple[Record, ...],
        remarks: tuple[str, ...],
        faults: tuple[str, ...] = (),
        noise_record: Noise | None = None,
    ) -> None:
        self.inputs, self.outputs = signals
        self.step = pieces[0].trajectory.step
        self.pieces, self.remarks, self.faults = pieces, remarks, faults
        self.noise_record = noise_record
        self.noise_at_rest = None if noise_record is None else noise_record.pieces
        self.lacks_outputs = not all(
            np.isfinite(piece.trajectory.outputs).all() for piece in pieces
        )
        self.numbers = same_inputs([piece.trajectory.inputs for piece in pieces])
        self.files = tuple(Path(record.path).name for record in records)
        self.digests = tuple(record.digest for record in records)
        rows = [list(bytes.fromhex(digest)) for digest in self.digests]
        self.identity: FloatArray = np.array(rows, dtype=np.float64)


def make(specification: Specification) -> MeasuredRecords:
    """Read, examine and prepare the records that a specification names.

    The columns of its signals are read; the step is its own.

    Raises:
        LoadError: a file cannot be read, signals, parameters or columns do not fit, or a record
            has a fault that must be corrected first.
    """
    _require_parameters(specification)
    at_rest = [] if specification.noise_record is None else [specification.noise_record]
    paths = (specification.model, *specification.further)
    times = tuple(
        _modified(what, path)
        for what, group in (("record", paths), ("noise record", at_rest))
        for path in group
    )
    return _made(specification.to_json(), times)


@lru_cache(maxsize=2)
def _made(text: str, _times: tuple[int, ...]) -> MeasuredRecords:
    """Read the records; again only if the specification or a file has changed since."""
    specification = Specification.from_json(text)
    names = _columns(specification.inputs), _columns(specification.outputs)
    try:
        paths = (specification.model, *specification.further)
        records = _keys(specification).read(paths, (*names[0], *names[1]))
        return _prepared(specification, records, names)
    except MissingColumnsError as error:
        given = {"inputs": specification.inputs, "outputs": specification.outputs}
        keys = [
            f'system.{what}.{name}.column = "COLUMN"'
            for what, tables in given.items()
            for name, column in zip(tables, _columns(tables), strict=True)
            if column in error.missing
        ]
        raise LoadError("; in the recipe: ".join([str(error), *keys[:1]])) from error
    except RecordError as error:
        raise LoadError(str(error)) from error


def _keys(specification: Specification) -> RecordKeys:
    return RecordKeys.of(specification.parameters, f"record {specification.model!r}")


def _prepared(
    specification: Specification,
    records: tuple[Record, ...],
    names: tuple[tuple[str, ...], tuple[str, ...]],
) -> MeasuredRecords:
    inputs, outputs = (
        tuple(_completed(what, *pair, records[0]).signal(what, pair[0]) for pair in tables.items())
        for what, tables in (("input", specification.inputs), ("output", specification.outputs))
    )
    hold = hold_of(inputs)
    keys = _keys(specification)
    pairing, step = keys.pairing or PAIRINGS[hold], specification.sample_step()
    preparation = Preparation(*names, step, hold, pairing, rest=keys.rest)
    findings = examine(records, *names)
    require_sound(findings)
    whole = [filled(record, *names, hold) for record in records]
    of_response = check_pairing(whole, preparation)
    require_sound(of_response)
    findings = (*findings, *of_response)
    made = prepared(whole, preparation)
    remarks = (*messages(findings), *made.remarks)
    faults = messages(finding for finding in findings if finding.kind in OF_FILE)
    noise = _noise(specification, records, names[1])
    if noise is not None:
        remarks = (*remarks, *remarks_on_noise(noise, records, names[1]))
    return MeasuredRecords((inputs, outputs), made.pieces, records, remarks, faults, noise)


def _noise(
    specification: Specification, records: tuple[Record, ...], outputs: tuple[str, ...]
) -> Noise | None:
    """Read the noise record, if the specification names one."""
    if specification.noise_record is None:
        return None
    (record,) = _keys(specification).read([specification.noise_record], outputs)
    return noise_at_rest(record, records, outputs, specification.sample_step())


def _columns(tables: SignalTables) -> tuple[str, ...]:
    return tuple(table.column or name for name, table in tables.items())


def _completed(what: str, name: str, table: SignalTable, record: Record) -> SignalTable:
    """Fill in the unit of a signal from its column, and the hold of an input, where missing.

    Outputs have no hold.
    """
    unit = record.units[table.column or name] or None
    if are_other(table.unit, unit):
        raise RecordError(
            f"{what} {name!r} is in {table.unit} in the recipe, and in {unit} in {record.path}; "
            "expected the unit of the record, since values are not converted"
        )
    return table.over(SignalTable(unit=unit, hold=HOLD if what == "input" else None))


def _require_parameters(specification: Specification) -> None:
    model = specification.model
    for what in ("inputs", "outputs"):
        if not getattr(specification, what):
            raise LoadError(
                f"record {model!r}: the recipe names no {what}; expected at least one column: add "
                f"a table system.{what}.NAME with its range"
            )


def _modified(what: str, path: str) -> int:
    try:
        return find_file(path).stat().st_mtime_ns
    except OSError as error:
        raise LoadError(f"{what} {path!r}: {error}") from error


def recognises(model: str) -> bool:
    """Tell whether a model is a record, by its name."""
    return Path(model).suffix.lower() in RECORD_FORMATS
