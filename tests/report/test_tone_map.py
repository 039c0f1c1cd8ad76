"""One table shows error, coverage and motions by frequency and amplitude of tones."""

from __future__ import annotations

from slide_fmu.report.row_tables import card_table
from slide_fmu.report.table import ReportTable
from slide_fmu.report.tone_map import tone_maps, tone_table
from slide_fmu.validation.row import ALL, TONES, Row, ToneCell
from tests.report.made_rows import MEASURED, row, without_bound


def tone(hz: tuple[float, float], amplitude: tuple[float, float], **more: object) -> Row:
    cell = ToneCell(hz=hz, amplitude=amplitude)
    return row(f"tones of {hz[0]:g} Hz up to {amplitude[1]}", TONES, tones=cell, **more)


SMALL, LARGE = (0.1, 0.5), (0.5, 1.0)
ROWS = [
    *MEASURED,
    row(ALL, TONES, 0.02),
    tone((1.0, 2.0), SMALL, error=0.001),
    tone((1.0, 2.0), SMALL, error=0.5, steps=4.0),
    tone((2.0, 5.0), SMALL, error=0.03, covered=0.8),
    tone((2.0, 5.0), LARGE, error=0.0412345, covered=0.7, trajectories=7),
]


def test_table_has_error_coverage_and_motions_of_each_cell() -> None:
    table = tone_table(ROWS)
    assert table.heading == ("amplitude, part of half the range", "1 to 2 Hz", "2 to 5 Hz")
    assert table.rows == (
        ("50 % to 100 %", "", "4.1 %, 70 % (7)"),
        ("10 % to 50 %", "0.1 %, 95 % (12)", "3 %, 80 % (12)"),
    )
    assert "in the plain call at 20 ms" in table.title
    assert "bound covers" in table.title


def test_report_shows_the_same_cells_with_their_colours() -> None:
    (shown,) = tone_maps(ROWS)
    assert tuple(shown.columns) == tone_table(ROWS).heading[1:]
    texts = [["" if cell is None else cell.text for cell in cells] for cells in shown.cells]
    assert texts == [list(line[1:]) for line in tone_table(ROWS).rows]
    levels = [cell.level for cells in shown.cells for cell in cells if cell is not None]
    assert (max(levels), min(levels)) == (1.0, 0.0)


def test_cells_are_no_rows_of_the_table_of_kinds() -> None:
    names = [line[0] for line in card_table(ROWS).rows]
    assert TONES in names
    assert not any("tones of" in name for name in names)
    assert card_table(ROWS).rows[-1][-1] == "valid in 1 of 2 cells"


def test_kind_of_cells_with_too_few_motions_tells_the_most_of_a_cell() -> None:
    few = [tone((1.0, 2.0), SMALL, trajectories=3), tone((2.0, 5.0), SMALL, trajectories=4)]
    whole = row(ALL, TONES, trajectories=7)
    (line,) = card_table([whole, *few]).rows
    assert (line[1], line[-1]) == ("7", "too few motions in each cell to tell (at most 4 of 12)")
    assert card_table([without_bound(inputs=ALL, group=TONES)]).rows[0][-1] != line[-1]


def test_without_tones_there_is_no_table_and_without_a_bound_no_coverage() -> None:
    assert tone_table(MEASURED) == ReportTable.of((), ())
    assert tone_maps(MEASURED) == []
    cell = ToneCell(hz=(1.0, 2.0), amplitude=SMALL)
    table = tone_table([without_bound(inputs="tones", group=TONES, tones=cell)])
    assert table.rows[0][1] == "1 % (12)"
    assert "covers" not in table.title
