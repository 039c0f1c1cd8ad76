"""What an FMU is worth where held inputs change between its own steps.

    python tests/benchmarks/held_between.py fmus/duffing/duffing.fmu --json -

Random values are held for a time (``every``, in the FMU's own steps) while the importer goes by
communication steps (``H``, likewise); levels are held for 0.3 to 2 s and change at communication
points. The truth is the reference at the communication step, with inputs held over it. Errors
count at all communication points, also between own steps, where the mean of an input acts.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import HELD_BETWEEN

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.calls import ErrorLevels, InputsLabel, MeasuredMotion
from slide_fmu.validation.input_courses import Stairs
from slide_fmu.validation.measure import Meter

CASES = ((1.0, 1.0), (1.0, 0.5), (1.0, 0.25), (0.7, 0.7), (0.25, 0.25), (0.8, 0.05), (0.74, 0.37))
"""Times for which values are held, and communication steps, in own steps. Outputs of the last two
are interpolated."""
LEVELS = (0.25, 0.7)
"""Communication steps under levels that are held for long."""
SECONDS, BURN_IN, LONG = 60.0, 10.0, (0.3, 2.0)


def held(case: Case, every: float | None, step: float, rng: np.random.Generator) -> FloatArray:
    """Return values at the begins of communication steps, (n, n_inputs); every: in s, or long."""
    count, inputs = round(SECONDS / step), case.system.inputs
    if every is None:
        lengths = np.maximum(1, rng.uniform(*LONG, count) / step).astype(int)
    else:
        lengths = np.diff(np.ceil(np.arange(count + 1) * every / step - 1e-6)).astype(int)
    low, high = (np.array([getattr(s, name) for s in inputs]) for name in ("low", "high"))
    values = rng.uniform(low, high, (len(lengths), len(inputs)))
    return np.asarray(np.repeat(values, lengths, axis=0)[:count])


def rows_of_fmu(fmu: Path, bar: Stages) -> list[dict[str, Any]]:
    """Measure one FMU whose inputs are held."""
    surrogate, provenance = read_fmu(fmu)
    case = case_of(recipe_of_provenance(provenance, str(fmu)))
    own, progress = surrogate.window.step, bar(surrogate.name)
    cases = [(every, part) for every, part in CASES] + [(None, part) for part in LEVELS]
    found = []
    with unpacked(fmu) as files:
        for number, (every, part) in enumerate(cases):
            progress(number, len(cases))
            step = part * own
            rng = np.random.default_rng([HELD_BETWEEN, number])
            rows = held(case, None if every is None else every * own, step, rng)
            truth = simulate(case.system_with_step(step), rows).outputs
            motion = MeasuredMotion(Stairs(step, rows), truth, step, BURN_IN)
            meter = Meter(files, surrogate, ErrorLevels(truth.mean(axis=0), None))
            label = InputsLabel("held", "between")
            (row,) = meter.rows({label: [motion]}, [("plain", 1 / part)])
            found.append(
                {
                    "held_for_s": None if every is None else every * own,
                    "step_s": step,
                    "relative_rmse": row.error,
                    "covered": row.covered,
                    "trusted": row.trusted,
                }
            )
    progress(len(cases), len(cases))
    return found


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all FMUs."""
    return {fmu.stem: rows_of_fmu(fmu, bar) for fmu in arguments.fmus}


def main() -> None:
    """Measure the FMUs that the command line names."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n", maxsplit=1)[0])
    parser.add_argument("fmus", nargs="+", type=Path)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
