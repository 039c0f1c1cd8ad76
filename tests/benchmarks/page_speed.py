"""A step of the page's library, in Node, beside the same step inside the native library.

    python tests/benchmarks/page_speed.py --json -

Every round lets Node run the trajectories that the FMUs carry, and repeats the native step in C
(``timing.py``, without FMI): ``native`` by the best kernel of this processor, ``narrow`` by that
for vectors of four numbers, which is what WebAssembly has. Given are the least times of all rounds
in microseconds, since other programs may be at work: ``step`` with its outputs, and
``step_and_read`` with error estimates and bounds too, where there are any. In Node a step sets the
inputs and reads the results by value references, as the page does. ``ratio`` is Node over native,
``narrow_ratio`` Node over narrow.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from figures_out import measure_and_write
from timing import Part, TimedSurrogate, part_times, repeats

from slide_fmu.core.progress import Stages
from slide_fmu.fmu.export import read_fmu
from tests.apps.page.node import run_task, task_of_fmu

FMUS = Path(__file__).parents[2] / "fmus"
PARTS = {"step": Part.STEP, "step_and_read": Part.STEP_AND_READ}
LOOPS = 40


def page_times(fmu: Path, rounds: int) -> dict[str, float]:
    """Return the seconds of a step in Node, by what is read after it.

    Raises:
        RuntimeError: Node failed, with what it said.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        task = task_of_fmu(fmu, folder)
        outputs = [output["reference"] for output in task["facts"]["outputs"]]
        told = [o[what] for what in ("estimate", "bound") for o in task["facts"]["outputs"]]
        known = [reference for reference in told if reference is not None]
        timed = {"step": outputs, "step_and_read": [*outputs, *known]}
        result = run_task({**task, "rounds": rounds, "timed": timed}, folder)
    if result.returncode != 0:
        raise RuntimeError(result.stderr)
    return dict(json.loads(result.stdout)["seconds"])


def native_times(timed: TimedSurrogate) -> dict[str, float]:
    """Return the seconds of a step inside C, likewise."""
    return {
        name: min(part_times(timed, part, LOOPS, repeats(timed, part)))
        for name, part in PARTS.items()
    }


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Return times and ratios of every FMU."""
    found: dict[str, Any] = {}
    show = bar("FMUs")
    for number, fmu in enumerate(arguments.fmus):
        surrogate = read_fmu(fmu)[0]
        inside = {"native": TimedSurrogate(surrogate), "narrow": TimedSurrogate(surrogate, True)}
        least = {where: dict.fromkeys(PARTS, 1.0) for where in ("node", *inside)}
        for _ in range(arguments.rounds):
            times = {where: native_times(timed) for where, timed in inside.items()}
            times["node"] = page_times(fmu, arguments.runs)
            for where, parts in times.items():
                for part, seconds in parts.items():
                    least[where][part] = min(least[where][part], seconds)
        found[fmu.stem] = {
            part: {
                **{where: 1e6 * seconds[part] for where, seconds in least.items()},
                "ratio": least["node"][part] / least["native"][part],
                "narrow_ratio": least["node"][part] / least["narrow"][part],
            }
            for part in PARTS
        }
        show(number + 1, len(arguments.fmus))
    return found


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmus", type=Path, nargs="*", default=sorted(FMUS.glob("*/*.fmu")))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--runs", type=int, default=100, help="of a trajectory in each round")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
