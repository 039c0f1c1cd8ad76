"""Where the benchmarks' figures go: one JSON text, to a file or to standard output."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any


def write_figures(figures: dict[str, Any], place: str) -> None:
    """Write figures as JSON.

    Args:
        place: path of a file, or ``-`` for standard output.
    """
    text = json.dumps(figures, indent=2) + "\n"
    if place == "-":
        sys.stdout.write(text)
    else:
        Path(place).write_text(text, encoding="utf-8")
