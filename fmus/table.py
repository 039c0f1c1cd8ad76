"""Print the table of the released FMUs for the README: ``python fmus/table.py``.

The errors are the relative RMSE of the worst output in the plain call, at the surrogate's own step
and at a shorter one: of inputs as in the training, and of smooth inputs.
"""

from __future__ import annotations

from pathlib import Path

from slide_fmu.core.measures import percent
from slide_fmu.fmu.export import read_fmu
from slide_fmu.report.row_tables import length_of
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.table import ReportTable, markdown
from slide_fmu.report.verdict import main_rows
from slide_fmu.validation.row import FINER, OF_TRAINING, SMOOTH, Row

HEADING = ("FMU", "h", "error at h", "at h/4", "smooth inputs at h", "at h/4", "trusted at h, h/4")
SMALLEST = 1e-5
"""Errors below this part are not told apart."""


def row_of(fmu: Path) -> tuple[str, ...]:
    """Return the cells of one FMU; an error that was not measured is left out."""
    _, provenance = read_fmu(fmu)
    measured = released_figures(provenance)
    rows = () if measured is None else measured.rows
    main = main_rows(rows, "plain")
    smooth = [row for row in rows if row.group == SMOOTH and row.inputs != OF_TRAINING]
    steps = (1.0, float(FINER))
    cells = [_error(some, count) for some in (main, smooth) for count in steps]
    shares = [row.trusted for row in main]
    trusted = ", ".join(percent(share) for share in shares if share is not None)
    step = length_of(main[0]) if main else ""
    return (f"[`{fmu.stem}`](fmus/{fmu.stem}/README.md)", step, *cells, trusted)


def _error(rows: list[Row], steps: float) -> str:
    """Return the error of the row at a number of steps in the own step."""
    found = next((row.error for row in rows if row.is_at("plain", steps)), None)
    if found is None:
        return ""
    return percent(found) if found >= SMALLEST else f"below {percent(SMALLEST)}"


def main() -> None:
    """Print the table."""
    fmus = sorted(Path(__file__).parent.glob("*/*.fmu"))
    print(markdown(ReportTable.of(HEADING, map(row_of, fmus))))


if __name__ == "__main__":
    main()
