"""The functions that the standards define, by their official headers."""

from __future__ import annotations

import re
from pathlib import Path

import fmpy


def functions(fmi: int) -> list[str]:
    """Names of all functions of FMI 2.0 or 3.0."""
    folder = Path(fmpy.__file__).parent / "c-code"
    text = "".join(
        (folder / f"fmi{fmi}{kind}.h").read_text() for kind in ("FunctionTypes", "Functions")
    )
    return sorted(set(re.findall(rf"\b(fmi{fmi}\w+)TYPE\s*\(", text)))
