"""A file of the user's own inputs gives a first recipe ranges, a kind of training, and a judge."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from slide_fmu.core.signals import LARGEST, Signal
from slide_fmu.core.units import NO_UNIT
from slide_fmu.propose.first_look import MakeTables
from slide_fmu.recipe.default_excitation import KindTable
from slide_fmu.recipe.your_inputs import table_of_inputs
from slide_fmu.record_files.inputs import read_inputs
from slide_fmu.systems.declared import SignalTables

Seen = dict[str, tuple[float, float]]
"""Least and greatest value of inputs in a file, by name."""


def seen_in_file(file: Path, inputs: SignalTables) -> Seen:
    """Return the least and the greatest value of each input in a file.

    Raises:
        RecordError: the file cannot be read, lacks an input, or has a fault (``read_inputs``).
    """
    signals = [
        Signal(name, table.unit or NO_UNIT, -LARGEST, LARGEST) for name, table in inputs.items()
    ]
    values = read_inputs(str(file), signals).values
    return {
        signal.name: (float(column.min()), float(column.max()))
        for signal, column in zip(signals, values.T, strict=True)
    }


def require_in_ranges(file: Path, inputs: Iterable[Signal]) -> str:
    """Refuse a file that leaves the ranges of inputs; return a sentence on what it is for.

    Raises:
        RecordError: the message has the input, its farthest value and the remedy.
    """
    table = read_inputs(str(file), tuple(inputs))
    table.require_in_range()
    return (
        f"{file.name} lasts {table.duration:.4g} s: the training learns from its first half, and "
        "its second half judges the FMU, as 'your inputs'"
    )


def with_file(tables: MakeTables, file: str, step: float) -> Sequence[KindTable]:
    """Return the tables of the excitation for a step in s, with a file of inputs among them."""
    others = tables(step)
    return [*others, table_of_inputs(file, others)]
