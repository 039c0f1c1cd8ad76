"""The paper's test of the Duffing oscillator on a moving base, and how good it can get at best.

    python tests/benchmarks/paper_protocol.py runs/duffing_paper_code/duffing_paper_code.fmu

Simulations as long as the input window start from random initial states; the output window at
their end is scored. Initial states are not among the network's inputs: ``floor`` is the standard
deviation that they leave in the scored samples under one and the same input, the least RMSE of any
function of the inputs.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write

from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Stages
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.systems.base import State
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.task import UNSEEN_SEED

FLOOR_INPUTS, STATES = 100, 16
"""Inputs and initial states under each of them from which the floor is measured."""


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """RMSE of the output window, and its floor, in the output's unit."""
    surrogate, found = read_fmu(arguments.fmu)
    recipe = recipe_of_provenance(found, str(arguments.fmu))
    if recipe.data.burn_in:
        raise SystemExit(
            f"recipe {recipe.name!r}: data.burn_in = {recipe.data.burn_in:g}; expected 0, as the "
            "paper's simulations start in the states that are not known"
        )
    system, window = case_of(recipe).system, surrogate.window
    stream = Stream(TEST, arguments.seed, (1.0, 1.0), window.n_in * window.step)
    scored = slice(window.n_truncated + 1, None)
    errors, references, variances = [], [], []
    advance = bar("simulations of one window")
    for index in range(arguments.simulations):
        drawn = draw(recipe, system, stream, index)
        outputs = simulate(system, drawn.inputs, drawn.initial).outputs[scored]
        errors.append(surrogate.predict_windows(drawn.inputs[None])[0] - outputs)
        references.append(outputs)
        if index < FLOOR_INPUTS:
            rng = np.random.default_rng((arguments.seed, index))
            last = drawn.initial.last_input
            ends = []
            for _ in range(STATES):
                random = system.random_state(rng)
                start = State(random.coordinates, random.velocities, last)
                ends.append(simulate(system, drawn.inputs, start).outputs[scored])
            variances.append(np.var(ends, axis=0, ddof=1))
        advance(index + 1, arguments.simulations)
    error = np.concatenate(errors)
    return {
        "recipe": recipe.name,
        "simulations": arguments.simulations,
        "scored_samples": window.n_out,
        "rmse": rms(error).tolist(),
        "floor": np.sqrt(np.mean(variances, axis=(0, 1))).tolist(),
        "newest_rmse": rms(np.array(errors)[:, -1]).tolist(),
        "newest_floor": np.sqrt(np.mean(variances, axis=0)[-1]).tolist(),
        "rms_reference": rms(np.concatenate(references)).tolist(),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--simulations", type=int, default=512)
    parser.add_argument("--seed", type=int, default=UNSEEN_SEED, help="of the simulations")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
