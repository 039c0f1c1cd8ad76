"""Surrogates on kinds of input as users drive machines, which no training or tuning ever sees.

    python tests/benchmarks/user_kinds.py FMU [--surrogate PATH] --json -

The kinds are drawn by generators of their own (``force_kinds.py``, ``crank_kinds.py``,
``joint_kinds.py``), each on two levels: moderate ones within the amplitudes of the training, or
within the machine's limits of speed and acceleration; harsh ones within the declared ranges. The
truth is the reference system of the FMU's recipe, as in ``slide-fmu validate``. Other surrogates,
also such as have no bound yet, are measured on the same samples, by the usual errors of the FMU.
Samples count when all windows are full. Each trajectory is simulated from two more initial states:
its response is ``unique`` if they all end in the same motion. Tables go to standard error.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import USER_KINDS
from user_kind_figures import figures_of, run_of, samples_needed, table_of
from user_kind_truths import Plan, machine_of, truths_of

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import Provenance, load, read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.console import print_table
from slide_fmu.report.progress_display import Messages
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.task import IN_RANGE


def measure(given: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all surrogates on the same trajectories."""
    released, found = read_fmu(given.fmu)
    recipe = recipe_of_provenance(found, str(given.fmu))
    usual = usual_errors(released, found or {}, str(given.fmu))
    surrogates = {str(given.fmu): released}
    for path in given.surrogate:
        surrogates[str(path)] = checked(load(file_of(path)), released, path)
    plan = Plan(given.seed, given.trajectories, given.control, given.duration)
    truths = truths_of(recipe, plan, given.store, given.workers, bar("true outputs"))
    first = first_sample(recipe, list(surrogates.values()), given.duration)
    measured = {}
    for path, surrogate in surrogates.items():
        advance, runs = bar(f"surrogate {path}"), []
        for done, truth in enumerate(truths, start=1):
            runs.append(run_of(surrogate, truth, first))
            advance(done, len(truths))
        measured[path] = figures_of(surrogate, runs, usual)
        print_table(table_of(measured[path]), Messages(file=sys.stderr, highlight=False))
    return {
        "fmu": str(given.fmu),
        "reference": dict(recipe.system.reference),
        **vars(plan),
        "first_sample": first,
        "usual_errors": usual.tolist(),
        "surrogates": measured,
    }


def usual_errors(surrogate: Surrogate, found: Provenance, source: str) -> FloatArray:
    """Return the 95 % quantile of each output's errors in range, as the FMU's figures give it."""
    figures = found.get("measured", {}).get("validation", {}).get(IN_RANGE)
    if figures is None:
        raise SystemExit(
            f"{source} has no figures of errors in range; expected a measured FMU: write it by "
            "slide-fmu run"
        )
    by_name = {output["name"]: output["usual_level"] for output in figures["outputs"]}
    return np.array([by_name[signal.name] for signal in surrogate.outputs])


def file_of(path: Path) -> Path:
    """Return the surrogate file of a run folder, or the file itself."""
    return path / "surrogate.slide" if path.is_dir() else path


def checked(other: Surrogate, released: Surrogate, path: Path) -> Surrogate:
    """Return a surrogate that has the step, inputs and outputs of the FMU; refuse any other."""
    about = [
        (s.window.step, [i.name for i in s.inputs], [o.name for o in s.outputs])
        for s in (other, released)
    ]
    if about[0] != about[1]:
        raise SystemExit(
            f"{path} has the step, inputs and outputs {about[0]}; expected {about[1]}, as in the "
            "FMU: name a surrogate of the same system"
        )
    return other


def first_sample(recipe: Recipe, surrogates: list[Surrogate], duration: float) -> int:
    """Return the first sample that is measured, where the windows of all surrogates are full."""
    step = recipe.window.step
    lead = round(machine_of(recipe).lead / step)
    needed = max(samples_needed(surrogate) for surrogate in surrogates)
    if needed >= lead + round(duration / step):
        raise SystemExit(
            f"duration = {duration:g} s, after {lead * step:g} s; expected more, since a "
            f"surrogate needs {needed * step:g} s before its outputs count: set --duration"
        )
    return max(lead, needed) + 1


def parser() -> argparse.ArgumentParser:
    """Return the reader of the command line."""
    found = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    found.add_argument("fmu", type=Path, help="released FMU with its recipe and its figures")
    found.add_argument(
        "--surrogate",
        type=Path,
        action="append",
        default=[],
        help="another FMU, surrogate file or run folder, once or several times",
    )
    found.add_argument("--trajectories", type=int, default=4, help="of each kind and level")
    found.add_argument("--control", type=int, default=12, help="trajectories in range")
    found.add_argument("--duration", type=float, default=20.0, help="measured time of each, in s")
    found.add_argument("--seed", type=int, default=USER_KINDS)
    found.add_argument("--store", type=Path, help="folder that keeps the true outputs")
    found.add_argument("--workers", type=int, default=2, help="processes that simulate; 0: none")
    return found


if __name__ == "__main__":
    measure_and_write(parser(), measure)
