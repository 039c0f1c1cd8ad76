"""This module fills single missing samples of records, where the user asks for it.

Lost rows of an even clock and values that are missing are filled alike. Outputs and inputs that
move smoothly follow cubic splines through the values that were measured, other inputs move along
straight lines or are held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.record_files.record import Record
from slide_fmu.records.clock import clock_of_record
from slide_fmu.records.faults import held_samples
from slide_fmu.records.resampling import moves_smoothly

FEWEST = 4
"""A cubic spline passes through at least this number of values."""


def lost_rows(record: Record) -> list[tuple[int, int]]:
    """Return the gaps that are filled: the sample before each, and how many samples are lost."""
    if not record.fill:
        return []
    clock = clock_of_record(record)
    lost = [(gap.sample, round(gap.length / clock.step) - 1) for gap in clock.gaps]
    return [(sample, count) for sample, count in lost if 0 < count <= record.fill]


def runs_of(missing: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return begin and end (excluded) of each run of missing values, shape (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]])))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def filled(record: Record, inputs: Sequence[str], outputs: Sequence[str], hold: Hold) -> Record:
    """Return a record with its short gaps filled, if its keys ask for it.

    An output that its sensor holds is filled between the samples at which it was read anew.

    Raises:
        RecordError: a time is not finite, or none rises.
    """
    if not record.fill:
        return record
    gaps = lost_rows(record)
    where = np.repeat([sample + 1 for sample, _ in gaps], [count for _, count in gaps])
    between = [
        np.linspace(record.time[sample], record.time[sample + 1], count + 2)[1:-1]
        for sample, count in gaps
    ]
    time = np.insert(record.time, where.astype(np.intp), np.concatenate([*between, []]))
    columns = {}
    for name, values in record.columns.items():
        known = np.where(np.isfinite(values), values, np.nan)
        most = record.fill
        if name in outputs:
            held = held_samples(known)
            if held is not None and held.longest <= record.fill:
                known[held.repeated], most = np.nan, 2 * held.longest + 1
        known = np.insert(known, where.astype(np.intp), np.nan)
        columns[name] = _filled(time, known, most, hold if name in inputs else None)
    first_line = 0 if gaps else record.first_line  # lines no longer count samples
    return replace(record, time=time, columns=columns, other_clocks={}, first_line=first_line)


def _filled(time: FloatArray, values: FloatArray, most: int, hold: Hold | None) -> FloatArray:
    """Fill the runs of at most ``most`` missing values between known ones, shape (N,)."""
    missing = np.isnan(values)
    inner = [
        (begin, end)
        for begin, end in runs_of(missing)
        if end - begin <= most and begin > 0 and end < len(values)
    ]
    if not inner:
        return values
    chosen = np.concatenate([np.arange(begin, end) for begin, end in inner])
    made, known = values.copy(), np.flatnonzero(~missing)
    if hold == "zero_order":
        made[chosen] = values[known[np.searchsorted(known, chosen) - 1]]
    elif len(known) >= FEWEST and (hold is None or moves_smoothly(time[known], values[known])):
        made[chosen] = CubicSpline(time[known], values[known])(time[chosen])
    else:
        made[chosen] = np.interp(time[chosen], time[known], values[known])
    return made
