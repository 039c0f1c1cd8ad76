"""What an export costs as a whole process, from the shell's point of view.

    python tests/benchmarks/export_time.py fmus/robot_6r/robot_6r.fmu --json -

Every run is a process of its own that exports the FMU again, in each form in turn. Given are the
smallest, the median and the largest time by form, in seconds, and that of a process which only
starts Python and prints the subcommands (``help``). One run of each before does not count.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from figures_out import write_figures

FORMS = {"fmi2": ("--fmi", "2"), "fmi3": ("--fmi", "3"), "fmi2 with sources": ("--source",)}


def seconds_of(*arguments: object) -> float:
    """Wall time of one call of the console script.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    command = [sys.executable, "-m", "slide_fmu", *map(str, arguments)]
    begin = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begin


def measure(fmu: Path, rounds: int) -> dict[str, Any]:
    """Times by form."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / fmu.name
        calls: dict[str, tuple[object, ...]] = {
            name: ("export", fmu, "-o", copy, *form) for name, form in FORMS.items()
        }
        calls["help"] = ("--help",)
        for call in calls.values():
            seconds_of(*call)
        times: dict[str, list[float]] = {name: [] for name in calls}
        for _ in range(rounds):
            for name, call in calls.items():
                times[name].append(seconds_of(*call))
    summary = {
        name: {"smallest": min(found), "median": statistics.median(found), "largest": max(found)}
        for name, found in times.items()
    }
    return {"fmu": str(fmu), "rounds": rounds, "seconds": summary}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    write_figures(measure(arguments.fmu, arguments.rounds), arguments.json)


if __name__ == "__main__":
    main()
