"""Print the table of the released FMUs for the README: ``python fmus/table.py``.

The errors are the relative RMSE of the worst output: of the plain call under inputs as in the
training, of the plain call under smooth inputs where inputs are held over each step, and with
inputs which are known to the end of each step.
"""

from __future__ import annotations

from pathlib import Path

from slide_fmu.fmu.export import read_fmu

COLUMNS = {
    "rough": "plain call",
    "smooth_if_held": "plain call, smooth inputs",
    "known_to_step_end": "inputs known to the step's end",
}
"""Figures of the plain call by their names, with the titles of their columns."""
SMALLEST = 1e-5
"""Errors below this part are not told apart."""


def row_of(fmu: Path) -> str:
    """Return the row of one FMU; an error that was not measured is left out."""
    _, provenance = read_fmu(fmu)
    found = (provenance or {})["measured"].get("plain_call")
    outputs = found["outputs"] if found else []
    measured = [[one[name] for one in outputs if one[name] is not None] for name in COLUMNS]
    errors = [_shown(max(each)) if each else "" for each in measured]
    name = fmu.stem
    return f"| [`{name}`](fmus/{name}/README.md) | {' | '.join(errors)} |"


def _shown(error: float) -> str:
    return f"{100 * error:.3g} %" if error >= SMALLEST else f"below {100 * SMALLEST:g} %"


def main() -> None:
    """Print the table."""
    print(f"| FMU | {' | '.join(COLUMNS.values())} |\n| --- {'| --- ' * len(COLUMNS)}|")
    for fmu in sorted(Path(__file__).parent.glob("*/*.fmu")):
        print(row_of(fmu))


if __name__ == "__main__":
    main()
