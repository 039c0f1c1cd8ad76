"""Print the table of the released FMUs for the README: ``python fmus/table.py``.

The errors are those of the first output, relative RMSE: first that of the plain call, then that of
inputs which are known to the end of each step.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.fmu.export import read_fmu

SMALLEST = 1e-5
"""Errors below this part are not told apart."""


def row_of(fmu: Path) -> str:
    """Return the row of one FMU; an error that was not measured is left out."""
    _, provenance = read_fmu(fmu)
    found = (provenance or {})["measured"].get("plain_call")
    output: dict[str, Any] = found["outputs"][0] if found else {}
    plain = output.get("smooth")
    cells = [output.get("rough") if plain is None else plain, output.get("known_to_step_end")]
    errors = ["" if error is None else _shown(error) for error in cells]
    name = fmu.stem
    return f"| [`{name}`](fmus/{name}/README.md) | {' | '.join(errors)} |"


def _shown(error: float) -> str:
    return f"{100 * error:.3g} %" if error >= SMALLEST else f"below {100 * SMALLEST:g} %"


def main() -> None:
    """Print the table."""
    print("| FMU | plain call | inputs known to the step's end |\n| --- | --- | --- |")
    for fmu in sorted(Path(__file__).parent.glob("*/*.fmu")):
        print(row_of(fmu))


if __name__ == "__main__":
    main()
