"""How long a user waits for help, for the version, and for a completion of what was typed.

    python tests/benchmarks/start_up.py --json -

Every run is a process of its own that is started as the shells start it. Given are the smallest,
the median and the largest time of each, in seconds, and that of a Python which does nothing. One
run of each before does not count.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from figures_out import write_figures

TYPED = "slide-fmu va"
"""What is completed: it can only go on as ``slide-fmu validate``."""


@dataclass(frozen=True)
class Start:
    """A Start is a process: its arguments behind ``python``, and what its environment has more."""

    arguments: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)


def _completion(shell: str, **more: str) -> Start:
    """Return how a shell asks for a completion (``slide-fmu --show-completion``)."""
    return Start(("-m", "slide_fmu"), {"_SLIDE_FMU_COMPLETE": f"complete_{shell}", **more})


STARTS = {
    "python alone": Start(("-c", "pass")),
    "slide-fmu --help": Start(("-m", "slide_fmu", "--help")),
    "slide-fmu --version": Start(("-m", "slide_fmu", "--version")),
    "completion in bash": _completion("bash", COMP_WORDS=TYPED, COMP_CWORD="1"),
    "completion in zsh": _completion("zsh", _TYPER_COMPLETE_ARGS=TYPED),
    "completion in fish": _completion(
        "fish", _TYPER_COMPLETE_FISH_ACTION="get-args", _TYPER_COMPLETE_ARGS=TYPED
    ),
    "import slide_fmu": Start(("-c", "import slide_fmu")),
}
"""What is started, by its name for people."""


def started(start: Start) -> str:
    """Return what a process prints.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    done = subprocess.run(
        [sys.executable, *start.arguments],
        env={**os.environ, **start.environment},
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout


def _seconds(start: Start) -> float:
    begin = time.perf_counter()
    started(start)
    return time.perf_counter() - begin


def measure(rounds: int) -> dict[str, Any]:
    """Return the times by name; all take turns in each round."""
    times: dict[str, list[float]] = {name: [] for name in STARTS}
    for counted in range(rounds + 1):
        for name, start in STARTS.items():
            seconds = _seconds(start)
            if counted:
                times[name].append(seconds)
    summary = {
        name: {"smallest": min(found), "median": statistics.median(found), "largest": max(found)}
        for name, found in times.items()
    }
    return {"rounds": rounds, "seconds": summary}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    write_figures(measure(arguments.rounds), arguments.json)


if __name__ == "__main__":
    main()
