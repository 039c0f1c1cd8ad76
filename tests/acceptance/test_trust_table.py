"""The table of the released bounds in ``docs/results.md`` has the figures that the FMUs carry."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.fmu.export import read_fmu

ROOT = Path(__file__).parents[2]
RELEASED = ("duffing", "slider_crank", "robot_6r")
"""The FMUs of the table's columns."""


def _percent(values: list[float], digits: int) -> str:
    return f"{', '.join(f'{100 * value:.{digits}f}' for value in values)} %"


def _rows(fmu: str) -> list[str]:
    """Return the cells of an FMU, from top to bottom."""
    _, provenance = read_fmu(ROOT / "fmus" / fmu / f"{fmu}.fmu")
    assert provenance is not None
    found = provenance["measured"]["validation"]
    bound: dict[str, Any] = found["in range"]["error_bound"]
    other: dict[str, Any] = found["kinds that were held out"]["error_bound"]
    harm, outputs = other["harm"], bound["outputs"]
    covered = [output["coverage"] for output in outputs]
    plain = bound["plain"]["coverage"] if "plain" in bound else covered  # held inputs: the same
    plainly = bound.get("plain", bound)
    return [
        _percent(covered, 1),
        _percent(plain, 1),
        f"{100 * bound['untrusted']:.2g} %",
        f"{100 * plainly['untrusted']:.2g} %",
        _percent([output["coverage_of_worst_trajectories"] for output in outputs], 1),
        ", ".join(f"{output['width']:.2f}" for output in outputs),
        _percent([output["skill"] for output in outputs], 0),
        f"{100 * bound['flagged']:.2g} %",
        _percent([output["coverage"] for output in other["outputs"]], 1),
        _percent([harm["harmful_flagged"]], 0),
        f"{100 * harm['harmful_unnoticed']:.2g} %",
        _percent([harm["harmless_flagged"]], 0),
    ]


def test_table_of_the_released_bounds_has_the_figures_of_the_fmus() -> None:
    text = (ROOT / "docs" / "results.md").read_text("utf-8")
    table = text.split("## Error bounds")[1].split("| --- | --- | --- | --- |\n")[1]
    rows = [line.strip("| ").split(" | ") for line in table.split("\n\n")[0].splitlines()]
    columns = [list(column) for column in zip(*[row[1:] for row in rows], strict=True)]
    assert columns == [_rows(fmu) for fmu in RELEASED]
