"""What is wrong with records, and what one should know about them before learning from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.records.alike import alike_inputs, groups_of_records
from slide_fmu.records.column_findings import column_findings
from slide_fmu.records.finding import Finding
from slide_fmu.records.record import Record
from slide_fmu.records.period_cuts import whole_periods
from slide_fmu.records.periods import find_period
from slide_fmu.records.timing import clock_unit_findings, time_findings

ENOUGH_PERIODS = 3
"""So many different periods have one to learn from, one to choose by and one to test with."""
SEVERAL_PERIODS = (
    'split by whole periods (data.by = "period"), so that none is learnt from and tested with'
)
FEW_PERIODS = (
    "record other inputs too: what is tested was learnt from, and the measured error says nothing "
    "about other inputs"
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
    found += _alike_findings(records, tuple(inputs) or names)
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


def _alike_findings(records: Sequence[Record], names: tuple[str, ...]) -> list[Finding]:
    """Remark records that have the same inputs."""
    if len(records) < 2:
        return []
    alike = alike_inputs([record.chosen(names) for record in records])
    numbers = groups_of_records(alike, len(records))
    found = []
    for number in range(max(numbers) + 1):
        paths = [r.path for r, own in zip(records, numbers, strict=True) if own == number]
        if len(paths) > 1:
            found.append(
                Finding(
                    "alike",
                    "remarked",
                    paths[0],
                    ", ".join(names),
                    f"the inputs are those of {', '.join(paths[1:])}, wholly or in part",
                    "other inputs in each file, so that nothing is tested that was learnt from",
                    'divide by whole records (data.by = "record"), of which those that are alike '
                    'stay together; or each by itself (data.by = "each", as it is with physical '
                    "parameters) if they run together",
                )
            )
    return found


def _period_findings(record: Record, names: tuple[str, ...]) -> list[Finding]:
    """Remark inputs that repeat a period."""
    values = record.chosen(names)
    period = find_period(values)
    if period is None:
        return []
    number = len({one.number for one in whole_periods([values], period.samples)})
    return [
        Finding(
            "period",
            "remarked",
            record.path,
            ", ".join(names),
            f"{100 * period.share:.0f} % of the record repeat a period of {period.samples} "
            f"samples, and {number} of them are different",
            "inputs that do not come again",
            SEVERAL_PERIODS if number >= ENOUGH_PERIODS else FEW_PERIODS,
        )
    ]
