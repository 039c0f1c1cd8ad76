"""What an error bound gains by further kinds of input, and what they cost in range.

    python tests/benchmarks/further_kinds.py FMU --json -

The bound of a released FMU is learnt twice with the networks that it has: once as its recipe says,
once without ``bound.excitation``. Data are made again as the recipe says, or those of a run are
taken (``--data runs/NAME/trajectories``). Both bounds are measured
on the same fresh trajectories, in range and of the kinds that are held out, beside the finest
reference model. Both are calibrated by the same trajectories.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from figures_out import measure_and_write
from seeds import FURTHER_KINDS

from slide_fmu.bounds.error_bound import fit_bound
from slide_fmu.core.figures import plain
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream
from slide_fmu.data.generation import generate
from slide_fmu.data.trajectories import Split
from slide_fmu.data.unseen import unseen_motions
from slide_fmu.excitation.kinds import names_of
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import FURTHER, Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.trust import TrustOutputs
from tests.benchmarks.bound_measures import harm_of, output_bound
from tests.trajectories import read_split

PARTS = "bound", "calibration", FURTHER
NETWORKS = ("train", "validation", "estimator", "estimator_validation", "companion")
"""Trajectories of the networks are not made again, but for one of each."""


class Run(NamedTuple):
    """Inputs (N, n_inputs) and absolute errors (M, n_outputs) of the last M samples, of a kind."""

    inputs: FloatArray
    errors: FloatArray
    kind: str


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", type=Path, help="FMU with an error bound, as its recipe says")
    parser.add_argument("--trajectories", type=int, default=60)
    parser.add_argument("--seed", type=int, default=FURTHER_KINDS)
    parser.add_argument("--data", type=Path, help="trajectories of a run of its recipe")

    def measure(given: argparse.Namespace, stages: Stages) -> dict[str, Any]:
        surrogate, found = read_fmu(given.fmu)
        recipe = recipe_of_provenance(found, str(given.fmu))
        mixes = {"in range": recipe, "held out": recipe.with_held_out_kinds()}
        recipe.with_further_kinds()  # refused where there are none
        with tempfile.TemporaryDirectory() as folder:
            trajectories = given.data or _made(recipe, Path(folder), stages)
            splits = [read_split(recipe, trajectories, name) for name in PARTS]
            bounds = {
                "with further kinds": _learnt(surrogate, recipe, splits, Path(folder), stages),
                "without": _learnt(surrogate, recipe, splits[:2], Path(folder), stages),
            }
        runs = {
            name: _runs(surrogate, mix, given.seed + number, given.trajectories, stages)
            for number, (name, mix) in enumerate(mixes.items())
        }
        usual = np.quantile(np.concatenate([run.errors for run in runs["in range"]]), 0.95, axis=0)
        return {
            "trajectories": given.trajectories,
            "seed": given.seed,
            **{
                how: {name: _figures(one, runs[name], usual) for name in mixes}
                for how, one in bounds.items()
            },
        }

    measure_and_write(parser, measure)


def _made(recipe: Recipe, folder: Path, stages: Stages) -> Path:
    few = recipe.data.model_copy(update={**dict.fromkeys(NETWORKS, 1), "beyond": 0})
    trajectories = folder / "trajectories"
    generate(
        case_of(recipe.model_copy(update={"data": few})),
        trajectories,
        None,
        stages("trajectories"),
    )
    return trajectories


def _learnt(
    surrogate: Surrogate, recipe: Recipe, splits: Sequence[Split], folder: Path, stages: Stages
) -> Surrogate:
    assert surrogate.bound is not None
    assert recipe.bound is not None
    place, device = folder / f"head_{len(splits)}.pt", torch.device("cpu")
    torch.set_num_threads(1)
    companion = surrogate.bound.companion
    bound, _ = fit_bound(
        surrogate, companion, splits, recipe.bound, place, device, stages("error bound")
    )
    return replace(surrogate, bound=bound)


def _runs(
    surrogate: Surrogate, recipe: Recipe, seed: int, count: int, stages: Stages
) -> list[Run]:
    """Simulate fresh trajectories of a recipe's kinds; samples count that a bound counts for."""
    assert surrogate.bound is not None
    stream = Stream(TEST, seed, (1.0, 1.0), recipe.measured_duration())
    names, found = names_of(recipe.data.excitation), []
    filled = max(surrogate.window.n_in, surrogate.bound.filling_length)
    for motion in unseen_motions(
        recipe,
        case_of(recipe).reference,
        stream,
        count,
        stages("fresh trajectories"),
    ):
        errors = np.abs(surrogate.predict_newest(motion.inputs) - motion.outputs[1:])
        first = max(filled, motion.burn_in)
        found.append(Run(motion.inputs, errors[first:], names[motion.kind]))
    return found


def _figures(surrogate: Surrogate, runs: Sequence[Run], usual: FloatArray) -> dict[str, Any]:
    told = []
    for run in runs:
        trust = surrogate.trust(run.inputs)
        bounds = trust.bounds()
        last = slice(len(bounds) - len(run.errors), None)
        flags = trust.in_domain[last].astype(float), trust.trusted()[last].astype(float)
        told.append(TrustOutputs(bounds[last], np.zeros(len(run.errors)), *flags))
    kinds = {run.kind for run in runs}
    errors = [run.errors for run in runs]
    return {
        "outputs": [
            plain(
                output_bound(
                    surrogate.outputs[i].name,
                    [e[:, i] for e in errors],
                    [t.bounds[:, i] for t in told],
                )
            )
            for i in range(len(usual))
        ],
        "harm": plain(harm_of(errors, told, usual)),
        "covered_by_kind": {
            kind: float(
                np.mean(
                    [
                        np.mean(run.errors <= one.bounds)
                        for run, one in zip(runs, told, strict=True)
                        if run.kind == kind
                    ]
                )
            )
            for kind in sorted(kinds)
        },
    }


if __name__ == "__main__":
    main()
