"""Print how many times its 95 % bound an error was in measured rows, while ``trusted`` was true.

Run: ``python -m tests.benchmarks.over_bounds``. It reads the figures that the released FMUs carry,
and prints the table of ``docs/trust.md``.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from slide_fmu.fmu.export import read_fmu
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.validation.row import AS_SET, SEARCH, Row
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE

FMUS = Path(__file__).parents[2] / "fmus"
GROUPS = (IN_RANGE, AS_SET, HELD_OUT, BEYOND, SEARCH)
HEAD = (
    "| FMU | inputs | plain call at the FMU's step | at a quarter of it | known inputs |",
    "| --- | --- | --- | --- | --- |",
)


def table() -> list[str]:
    """Return the lines of the table, for all released FMUs with a bound."""
    lines = list(HEAD)
    for path in sorted(FMUS.glob("*/*.fmu")):
        surrogate, provenance = read_fmu(path)
        if surrogate.bound is None:
            continue
        measured = FmuDescription.of(surrogate, provenance).measured
        assert measured is not None
        for group in GROUPS:
            rows = [row for row in measured.rows if row.group == group]
            if rows:
                lines.append(_line(path.stem, group, rows, surrogate.window.step))
    return lines


def _line(name: str, group: str, rows: list[Row], step: float) -> str:
    """Return the line of an FMU and a group of inputs: the largest ratio of each call."""
    calls = (("plain", step), ("plain", step / 4), ("known", step))
    cells = [
        _largest(row for row in rows if row.call == call and abs(row.step_s - length) < 1e-9)
        for call, length in calls
    ]
    return f"| `{name}` | {group} | {' | '.join(cells)} |"


def _largest(rows: Iterable[Row]) -> str:
    """Return the largest ratio of rows, a hyphen where none has a trusted sample."""
    ratios = [row.over_bound for row in rows if row.over_bound is not None]
    return f"{max(ratios):.3g}" if ratios else "-"


if __name__ == "__main__":
    print("\n".join(table()))
