"""Error and coverage under lasting tones, over frequency and amplitude: one table everywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal
from slide_fmu.core.web.charts import HeatCell, HeatMap
from slide_fmu.report.row_tables import CALLS, call_of, length_of
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.row import Row, ToneCell

TITLE = "Lasting tones in one input"

MEANING = (
    "A tone in one input at a time, the others constant, {call} at {step}. A cell has the "
    "relative RMSE of the worst output, {covered}and in brackets the number of motions."
)

COVERED = "the share of the errors that the 95 % bound covers, "


def tone_table(rows: Sequence[Row]) -> ReportTable:
    """Return error, coverage and number of motions by amplitude and frequency of tones.

    They are those of the call by which an FMU is judged, at its own step. The table is empty where
    no tones were measured.
    """
    cells = _cells(rows)
    if not cells:
        return ReportTable.of((), ())
    bands, amplitudes = _bands(cells), _amplitudes(cells)
    heading = ("amplitude, part of half the range", *(_band(hz) for hz in bands))
    lines = (
        (_part(amplitude), *(_text(cells.get((hz, amplitude))) for hz in bands))
        for amplitude in amplitudes
    )
    return ReportTable.of(heading, lines, f"{TITLE}: {_meaning(cells)}")


def tone_maps(rows: Sequence[Row]) -> list[HeatMap]:
    """Return the same table with colours by the error; none where no tones were measured."""
    cells = _cells(rows)
    if not cells:
        return []
    bands, amplitudes = _bands(cells), _amplitudes(cells)
    errors = np.log([max(row.error, np.finfo(float).tiny) for row in cells.values()])
    low, width = errors.min(), max(float(np.ptp(errors)), 1e-9)

    def cell(row: Row | None) -> HeatCell | None:
        if row is None:
            return None
        level = (np.log(max(row.error, np.finfo(float).tiny)) - low) / width
        return HeatCell(_text(row), float(level), row.inputs)

    return [
        HeatMap(
            TITLE,
            _meaning(cells),
            "frequency",
            "part of half the range",
            [_band(hz) for hz in bands],
            [_part(amplitude) for amplitude in amplitudes],
            [[cell(cells.get((hz, amplitude))) for hz in bands] for amplitude in amplitudes],
        )
    ]


Ends = tuple[float, float]


def _cells(rows: Sequence[Row]) -> dict[tuple[Ends, Ends], Row]:
    """Return the rows of cells by their ranges of frequency and amplitude."""
    call = call_of(rows)
    return {
        _place(row.tones): row for row in rows if row.tones is not None and row.is_at(call, 1.0)
    }


def _place(cell: ToneCell) -> tuple[Ends, Ends]:
    return cell.hz, cell.amplitude


def _bands(cells: dict[tuple[Ends, Ends], Row]) -> list[Ends]:
    return sorted({hz for hz, _ in cells})


def _amplitudes(cells: dict[tuple[Ends, Ends], Row]) -> list[Ends]:
    """Return the ranges of amplitudes, the largest on top."""
    return sorted({amplitude for _, amplitude in cells}, reverse=True)


def _band(hz: Ends) -> str:
    return f"{decimal(hz[0])} to {decimal(hz[1])} Hz"


def _part(amplitude: Ends) -> str:
    return " to ".join(percent(end) for end in amplitude)


def _text(row: Row | None) -> str:
    if row is None:
        return ""
    covered = "" if row.covered is None else f", {percent(row.covered)}"
    return f"{percent(float(f'{row.error:.2g}'))}{covered} ({row.trajectories})"


def _meaning(cells: dict[tuple[Ends, Ends], Row]) -> str:
    row = next(iter(cells.values()))
    bounded = any(one.covered is not None for one in cells.values())
    return MEANING.format(
        call=CALLS[row.call].within, step=length_of(row), covered=COVERED if bounded else ""
    )
