"""This module reads the keys of ``system.parameters`` that say how files of records are read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast, get_args

import numpy as np

from slide_fmu.record_files.reading import read_records
from slide_fmu.record_files.record import Record, RecordError
from slide_fmu.record_files.table import SECONDS, TextForm
from slide_fmu.records.faults import without_runs
from slide_fmu.records.preparation import Pairing
from slide_fmu.systems.declared import Parameter, require_known

REST = "rest"
"""The only value of the key ``start``."""
KEYS = (
    *("time", "time_unit", "sample_step", "pairing", "missing", "fill", "stuck"),
    *("separator", "decimal", "header", "start"),
)
"""Keys of ``system.parameters`` for records, as ``RecordKeys`` explains them."""


GUESSED = TextForm()
"""Without keys, the form of text files is guessed."""


@dataclass(frozen=True)
class RecordKeys:
    """RecordKeys say how the files of records are read.

    Attributes:
        time: column of times; found if None.
        time_unit: unit of times that have none; empty where it is to be found.
        sample_step: step in s of files without times; None where they have some.
        pairing: the output that answers an input; None where it follows from the hold of inputs.
        missing: numbers that stand for missing values.
        fill: up to this many missing samples in a row are filled; 0 for none.
        stuck: from so many equal values in a row on, they count as missing; 0 for never, None
            where a sensor that stands still is to be refused.
        rest: whether every file begins at rest (``start = "rest"``).
        form: how text files are written.
    """

    time: str | None = None
    time_unit: str = ""
    sample_step: float | None = None
    pairing: Pairing | None = None
    missing: tuple[float, ...] = ()
    fill: int = 0
    stuck: int | None = None
    rest: bool = False
    form: TextForm = GUESSED

    @classmethod
    def of(cls, parameters: Mapping[str, Parameter], label: str) -> RecordKeys:
        """Read the keys of a recipe or of options; the label names the record in messages.

        Raises:
            RecordError: a value is none that the key may have.
            LoadError: a key is unknown.
        """
        require_known(label, parameters, KEYS)
        time, pairing = parameters.get("time"), parameters.get("pairing")
        step, fill = parameters.get("sample_step"), parameters.get("fill", 0)
        start, stuck = parameters.get("start"), parameters.get("stuck")
        if time is not None and not isinstance(time, str):
            raise _wrong(label, "time", time, "the name of the column of times")
        if step is not None and not (_is_number(step) and 0 < float(step) < math.inf):
            raise _wrong(
                label, "sample_step", step, "the step in s of a file without times, above 0"
            )
        if pairing is not None and pairing not in get_args(Pairing):
            raise _wrong(label, "pairing", pairing, f"one of {list(get_args(Pairing))}")
        if isinstance(fill, bool) or not isinstance(fill, int) or fill < 0:
            raise _wrong(
                label, "fill", fill, "the most missing samples in a row that are filled, a number"
            )
        if stuck is not None and (
            isinstance(stuck, bool) or not isinstance(stuck, int) or stuck < 0 or stuck == 1
        ):
            expected = "the least number of equal values in a row that count as missing, or 0"
            raise _wrong(label, "stuck", stuck, expected)
        if start not in (None, REST):
            expected = f"{REST!r} where every file begins at rest; else remove the key"
            raise _wrong(label, "start", start, expected)
        unit = parameters.get("time_unit", "")
        if not isinstance(unit, str) or unit.lower() not in SECONDS:
            raise _wrong(label, "time_unit", unit, f"one of {[one for one in SECONDS if one]}")
        return cls(
            time,
            unit.lower(),
            None if step is None else float(step),
            cast("Pairing | None", pairing),
            _numbers(parameters.get("missing", ""), label),
            fill,
            stuck,
            start == REST,
            _form(parameters, label),
        )

    def read(
        self, paths: Sequence[str], names: Sequence[str], others: bool = False
    ) -> tuple[Record, ...]:
        """Read files, with NaN in the place of numbers that stand for missing values.

        Raises:
            RecordError: as of ``read_records``.
        """
        records = read_records(
            paths,
            names,
            others=others,
            time=self.time,
            step=self.sample_step,
            form=self.form,
            time_unit=self.time_unit,
        )
        return tuple(
            replace(self._without_missing(one), fill=self.fill, stuck=self.stuck)
            for one in records
        )

    def _without_missing(self, record: Record) -> Record:
        """Return a record with NaN in the place of codes, and of runs of one value."""
        columns = dict(record.columns)
        for name, values in record.columns.items():
            if self.missing:
                columns[name] = np.where(np.isin(values, self.missing), np.nan, values)
            if self.stuck:
                columns[name] = without_runs(columns[name], self.stuck)
        return replace(record, columns=columns)


def _form(parameters: Mapping[str, Parameter], label: str) -> TextForm:
    """Read the keys of text files."""
    separator, decimal = parameters.get("separator"), parameters.get("decimal")
    header = parameters.get("header")
    if separator is not None and not (isinstance(separator, str) and len(separator) == 1):
        raise _wrong(label, "separator", separator, "one sign, such as ',' or ';'")
    if decimal is not None and decimal not in (".", ","):
        raise _wrong(label, "decimal", decimal, "'.' or ','")
    if header is not None and (isinstance(header, bool) or not isinstance(header, int)):
        raise _wrong(label, "header", header, "the line of the names, counted from 1")
    return TextForm(separator, decimal, header)


def _is_number(value: Parameter) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _numbers(value: Parameter, label: str) -> tuple[float, ...]:
    """Return one number, or those of a text with commas between them."""
    try:
        if isinstance(value, str):
            return tuple(float(one) for one in value.split(",") if one.strip())
        return (float(value),)
    except ValueError as error:
        expected = "a number that stands for missing values, or several in a text, as '-9999, -1'"
        raise _wrong(label, "missing", value, expected) from error


def _wrong(label: str, key: str, value: Parameter, expected: str) -> RecordError:
    return RecordError(f"{label}: system.parameters.{key} = {value!r}; expected {expected}")
