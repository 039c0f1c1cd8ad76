"""This module reads the columns of records that a user names as inputs and outputs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from slide_fmu.propose.draft_signals import Ranges
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.record_files.reading import read_records
from slide_fmu.record_files.record import (
    MissingColumnsError,
    NoTimesError,
    Record,
    RecordError,
)

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
    inputs, found = tuple(options.inputs), list(record.columns)
    outputs = options.outputs or tuple(name for name in found if name not in inputs)
    both = [name for name in inputs if name in outputs]
    if both:
        raise RecipeError(f"--input {both[0]} is an output too; expected one of both: remove one")
    if not inputs or not outputs:
        raise RecipeError(
            f"{record.path} has the columns {found}; expected which of them are inputs, and at "
            "least one that is an output: give --input NAME, and --output NAME for those that the "
            "surrogate shall have"
        )
    return inputs, outputs
