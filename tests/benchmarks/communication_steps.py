"""What an FMU is worth at any communication step: error, coverage, width, trust, in both calls.

    python tests/benchmarks/communication_steps.py fmus/*/*.fmu --trajectories 20 --json -
    python tests/benchmarks/communication_steps.py FMU --steps 2h,h,h/4,0.001,0.01

The motions are unseen ones of the recipe, all kinds together, as in a card. Rows are those of a
report (``slide_fmu/validation/row.py``): ``width`` is the mean bound over that of the call
``known`` at H = h, shares are those after ``error_bound_filled`` = 1. Errors are known at
communication points that are also samples of the truth, finer ones where inputs are held.
``step_cost.py`` prints what steps cost.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from figures_out import measure_and_write
from step_cost import length_of

from slide_fmu.core.progress import Stages
from slide_fmu.cosim.run import unpacked
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.validation.calls import ErrorLevels
from slide_fmu.validation.measure import motions_between, motions_by_kind
from slide_fmu.validation.meter import Calls, Meter
from slide_fmu.validation.row import ALL, Row
from slide_fmu.validation.task import IN_RANGE, UNSEEN_SEED, Task
from slide_fmu.validation.validate import validate

STEPS = "2h,h,h/2,h/4,h/8,0.001,0.01"


def rows_of_fmu(fmu: Path, arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure one FMU in both calls, at all steps."""
    surrogate, provenance = read_fmu(fmu)
    case = case_of(recipe_of_provenance(provenance, str(fmu)))
    task = Task(UNSEEN_SEED, arguments.trajectories)
    validation = validate(fmu, surrogate, case, task, bar(surrogate.name), 1)
    own = surrogate.window.step
    lengths = {step: length_of(step, own) for step in arguments.steps.split(",")}
    plain: Calls = [("plain", own / length) for length in lengths.values() if length]
    with unpacked(fmu) as files:
        levels = ErrorLevels(validation.mean, validation.usual_error())
        meter = Meter(files, surrogate, levels)
        held = surrogate.hold == "zero_order"
        kinds = (motions_between(validation, case) if held else {}) or motions_by_kind(validation)
        rows = meter.rows_by_kind(IN_RANGE, kinds, [("known", 1.0), *plain])
    every = [row for row in rows if row.inputs == ALL]
    of_known = [output.width for row in every if row.call == "known" for output in row.outputs]
    return {"step_s": own, "rows": [figures(row, rows, of_known) for row in every]}


def figures(row: Row, rows: list[Row], of_known: list[float | None]) -> dict[str, Any]:
    """Return the figures of a row of all kinds, and the least covered kind at this step."""
    same = [r for r in rows if (r.call, r.steps) == (row.call, row.steps) and r.inputs != ALL]
    kinds = {r.inputs: r.covered for r in same if r.covered is not None}
    worst = min(kinds, key=lambda name: kinds[name] or 0.0) if kinds else None
    widths = [
        None if o.width is None or not known else o.width / known
        for o, known in zip(row.outputs, of_known, strict=True)
    ]
    return {
        "call": row.call,
        "step_s": row.step_s,
        "steps": row.steps,
        "relative_rmse": [output.relative_rmse for output in row.outputs],
        "covered": [output.covered for output in row.outputs],
        "least_covered_kind": None if worst is None else [worst, kinds[worst]],
        "width": widths,
        "trusted": row.trusted,
        "harmful": row.harmful,
        "silent": row.silent,
    }


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all FMUs."""
    return {fmu.stem: rows_of_fmu(fmu, arguments, bar) for fmu in arguments.fmus}


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmus", nargs="+", type=Path)
    parser.add_argument("--steps", default=STEPS, help="communication steps, in s or as h/4")
    parser.add_argument("--trajectories", type=int, default=20, help="unseen motions of each FMU")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
