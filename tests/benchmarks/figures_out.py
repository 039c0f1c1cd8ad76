"""Where the benchmarks' figures go: one JSON text, to a file or to standard output."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from slide_fmu.cli.console import progress_bars


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


def measure_and_write(parser: argparse.ArgumentParser, measure: Callable[..., Any]) -> None:
    """Read the command line, measure while a bar shows the progress, and write the figures.

    Args:
        parser: what the command line may say, beside ``--json``.
        measure: takes the arguments and the bar, and returns the figures.
    """
    parser.add_argument("--json", default="-", help="where the figures go; - is stdout")
    arguments = parser.parse_args()
    with progress_bars() as bar:
        figures = measure(arguments, bar)
    write_figures(figures, arguments.json)
