"""What is wrong with records, and what one should know about them before learning from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.systems.record.column_findings import column_findings
from slide_fmu.systems.record.finding import Finding
from slide_fmu.systems.record.measured import Record
from slide_fmu.systems.record.periods import find_period, groups_of_periods
from slide_fmu.systems.record.timing import clock_unit_findings, time_findings

SEVERAL_PERIODS = (
    "split by whole periods, so that none is learnt from and tested with; one period that comes "
    "again and again tells nothing about others"
)
ONE_PERIOD = (
    "record other inputs too: it is one period that comes again and again, so that what is tested "
    "was learnt from, and the measured error says nothing about other inputs"
)


def examine(
    records: Sequence[Record], inputs: Sequence[str] = (), outputs: Sequence[str] = ()
) -> tuple[Finding, ...]:
    """Examine records of the same columns: what is wrong with them, in the order of the files.

    Args:
        records: at least one.
        inputs: columns that are inputs, in which repeated periods are looked for.
        outputs: columns that are outputs. Where neither is named, all columns are examined, and
            repeated periods are looked for in all together.

    Returns:
        The findings; those of severity ``"refused"`` must be mended before anything is learnt.

    Raises:
        RecordError: a record lacks a column that is named.
    """
    names = (*inputs, *outputs) or tuple(records[0].columns)
    found: list[Finding] = []
    for record in records:
        record.chosen(names)
        found += time_findings(record)
        for name in names:
            found += column_findings(record, name)
        found += _period_findings(record, tuple(inputs) or names)
    found += clock_unit_findings(records)
    found += [finding for name in names for finding in _constant(records, name)]
    return tuple(found)


def _constant(records: Sequence[Record], name: str) -> list[Finding]:
    """Refuse a column that has one value in all records."""
    values = [record.columns[name] for record in records]
    known = [column[np.isfinite(column)] for column in values]
    known = [column for column in known if len(column)]
    if not known:
        return []
    low, high = min(float(c.min()) for c in known), max(float(c.max()) for c in known)
    if low < high:
        return []
    return [
        Finding(
            "constant",
            "refused",
            records[0].path,
            name,
            f"the value is {records[0].with_unit(name, low)} in all samples",
            "a signal that moves",
            "leave the column out, or check its sensor",
        )
    ]


def _period_findings(record: Record, names: tuple[str, ...]) -> list[Finding]:
    """Remark inputs that repeat a period."""
    values = record.chosen(names)
    period = find_period(values)
    if period is None:
        return []
    whole = len(values) // period.samples * period.samples
    alike = (
        np.isfinite(values).all() and not groups_of_periods(values[:whole], period.samples).any()
    )
    return [
        Finding(
            "period",
            "remarked",
            record.path,
            ", ".join(names),
            f"{100 * period.share:.0f} % of the record repeat a period of {period.samples} "
            "samples",
            "inputs that do not come again",
            ONE_PERIOD if alike else SEVERAL_PERIODS,
        )
    ]
