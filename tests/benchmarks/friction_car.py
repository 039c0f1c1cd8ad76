"""The quarter car with friction by the defaults of network and training: error, sizes, cost.

    python tests/benchmarks/friction_car.py --seeds 3 --json -

A seed draws data and starts. Errors are relative RMSE of the surrogate, sample by sample, on
trajectories that no training saw; with several seeds, median and range of them.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import measure_and_write

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw
from slide_fmu.data.generation import generate
from slide_fmu.fitting.network import Fit
from slide_fmu.fitting.preparation import Work
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from tests.friction_car import friction_recipe

TRAJECTORIES = 20
"""So many unseen trajectories are measured."""


def learn(recipe: Recipe, bar: Stages) -> Fit:
    """Make data and train, in a folder that does not stay."""
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "data.zarr"
        with ThreadPoolExecutor(1) as pool:
            generate(case_of(recipe), store, pool, bar("trajectories"))
        return fit_surrogate(Work(case_of(recipe), store, Path(folder) / "states", bar))


def errors(fit: Fit, recipe: Recipe) -> FloatArray:
    """Relative RMSE of every output on unseen trajectories, shape (n_outputs,)."""
    system, settled = case_of(recipe).system, recipe.window.n_in
    stream = Stream(TEST, recipe.data.seed, (1.0, 1.0), 2 * recipe.data.duration)
    misses, references = [], []
    for index in range(TRAJECTORIES):
        motion = simulate_draw(system, draw(recipe, system, stream, index))
        reference = motion.outputs[1:][settled:]
        misses.append(fit.surrogate.predict_newest(motion.inputs)[settled:] - reference)
        references.append(reference)
    whole = np.concatenate(references)
    found: FloatArray = rms(np.concatenate(misses)) / rms(whole - whole.mean(axis=0))
    return found


def measure(seed: int, arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Learn and measure one seed."""
    recipe = friction_recipe(
        data={"seed": seed, "train": arguments.train}, training={"seed": seed}
    )
    begin = time.process_time()
    fit = learn(recipe, bar)
    seconds = time.process_time() - begin
    history, cell = fit.histories["surrogate"], fit.surrogate.network.cell  # type: ignore[attr-defined]
    return {
        "seed": seed,
        "relative_rmse": errors(fit, recipe).tolist(),
        "validation_error": min(history.validation_error),
        "states": len(cell.a),
        "units": len(cell.w),
        "parameters": fit.surrogate.network.count_parameters(),
        "sizes_tried": [asdict(size) for size in history.sizes],
        "remark": history.remark,
        "cpu_seconds": seconds,
    }


def study(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Learn and measure every seed."""
    torch.set_num_threads(1)
    found = [
        measure(seed, arguments, bar)
        for seed in range(arguments.seed, arguments.seed + arguments.seeds)
    ]
    all_errors = np.array([one["relative_rmse"] for one in found])
    return {
        "outputs": [signal.name for signal in case_of(friction_recipe()).system.outputs],
        "relative_rmse_median": np.median(all_errors, axis=0).tolist(),
        "relative_rmse_range": [all_errors.min(axis=0).tolist(), all_errors.max(axis=0).tolist()],
        "seeds": found,
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, choices=range(1, 100), default=3, metavar="N")
    parser.add_argument("--seed", type=int, default=0, help="the first of them")
    parser.add_argument("--train", type=int, default=24, help="trajectories to learn from")
    measure_and_write(parser, study)


if __name__ == "__main__":
    main()
