"""A source is either a system or records: whoever needs to know which asks here, and only here."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.base import Source, System

Answer = TypeVar("Answer")
Other = TypeVar("Other")


def either(
    source: Source,
    system: Callable[[System], Answer],
    records: Callable[[MeasuredRecords], Other],
) -> Answer | Other:
    """Return the answer of a source to a question that systems and records answer differently.

    Args:
        source: a system, or records.
        system: answers for a system.
        records: answers for records.
    """
    if isinstance(source, MeasuredRecords):
        return records(source)
    assert isinstance(source, System)
    return system(source)


def no_answer(source: Source) -> None:
    """Answer nothing: the question has no meaning for such a source."""
