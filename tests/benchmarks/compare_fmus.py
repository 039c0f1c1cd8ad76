"""Compares two FMUs of the same surrogate: largest difference of their outputs, and their speed.

    python tests/benchmarks/compare_fmus.py OLD.fmu NEW.fmu --json -

Both FMUs take the same inputs, drawn by the excitation of the recipe that the new FMU names, with
a seed that no training saw. The difference of an output is given over the width of its range. The
time is that of set, doStep and get through fmpy; the FMUs take turns, so that other work on the
machine slows both alike. Only what both FMUs have is compared; their reference model is not run.
"""

from __future__ import annotations

import argparse
import statistics
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import write_figures
from seeds import COMPARE_FMUS

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import Run, run_fmu
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of


def unseen_inputs(fmu: Path, steps: int, seed: int) -> FloatArray:
    """Inputs of the recipe's excitation, shape (steps, n_inputs), in the inputs' units."""
    _, provenance = read_fmu(fmu)
    recipe = recipe_of_provenance(provenance, str(fmu))
    duration = steps * recipe.window.step
    recipe = recipe.model_copy(
        update={"data": recipe.data.model_copy(update={"duration": duration, "burn_in": 0.0})}
    )
    drawn = draw(recipe, case_of(recipe).reference, Stream(TEST, seed, (1.0, 1.0), duration), 0)
    return drawn.inputs[:steps]


def compare(old: Path, new: Path, steps: int, rounds: int, seed: int) -> dict[str, Any]:
    """Drive both FMUs in turns and compare them."""
    surrogate, _ = read_fmu(new)
    rows = unseen_inputs(new, steps, seed)
    inputs = {signal.name: rows[:, k] for k, signal in enumerate(surrogate.inputs)}
    names = [signal.name for signal in surrogate.outputs]
    widths = np.array([signal.high - signal.low for signal in surrogate.outputs])
    runs: dict[str, list[Run]] = {"old": [], "new": []}
    with unpacked(old) as before, unpacked(new) as after:
        fmus: dict[str, UnpackedFmu] = {"old": before, "new": after}
        for _ in range(rounds):
            for name, fmu in fmus.items():
                runs[name].append(run_fmu(fmu, inputs, names, step=surrogate.window.step))
    difference = np.abs(runs["old"][0].values - runs["new"][0].values).max(axis=0) / widths
    times = {
        name: 1e6 * statistics.median(float(np.median(run.seconds)) for run in found)
        for name, found in runs.items()
    }
    return {
        "old": str(old),
        "new": str(new),
        "steps": steps,
        "largest_difference_over_range": dict(zip(names, difference.tolist(), strict=True)),
        "set_step_get_microseconds": times,
        "new_over_old": times["new"] / times["old"],
        "bytes": {"old": old.stat().st_size, "new": new.stat().st_size},
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--seed", type=int, default=COMPARE_FMUS)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    figures = compare(
        arguments.old, arguments.new, arguments.steps, arguments.rounds, arguments.seed
    )
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
