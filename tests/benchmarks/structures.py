"""Structures of networks that were tried for a recipe, on the same data and the same test.

    python tests/benchmarks/structures.py training/slider_crank.toml \
        --variants tests/benchmarks/variants/slider_crank.toml --json -

The file of variants has a table for each of them, which is merged into the recipe: of [network],
[training] and [data] (``train`` alone) what is other, and in ``without`` the dotted keys that are
taken away before. An empty table is the recipe itself. A variant of another family takes away
both tables first: ``without = ["network", "training"]``. A table [every] is merged into all
variants before their own, for example to train them all for a shorter time.

The recipe's data are generated once, in ``runs/<name>``. Every variant trains a surrogate without
error estimator and bound, which stays in ``runs/<name>/trainings`` for the next call, as long as
recipe and variant say the same (and the file format is the same): remove it to train anew with
other code.
Rows give what it cost, the relative RMSE against the recipe's reference model on unseen motions,
and medians of times inside C, all variants taking turns in one run: of one evaluation of the
network (``kernel_us``: layers, or both cells of a ping-pong step) and of the whole step, features
included (``step_us``).
"""

from __future__ import annotations

import argparse
import dataclasses
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import measure_and_write
from seeds import STRUCTURES
from studies import Trained, positive, simulated_seconds, surrogate_only, trained
from timing import Part, TimedSurrogate, part_times
from unseen import scored

from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.data.draws import TEST, Stream
from slide_fmu.data.unseen import UnseenMotion, unseen_motions
from slide_fmu.data.workplace import Workplace
from slide_fmu.pipeline.case_checks import check_case
from slide_fmu.pipeline.job import open_job
from slide_fmu.pipeline.stages import generate_data
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.recipes import whole_recipe

LOOP, LOOPS = 200, 20
"""Steps in one loop inside C, short enough to run undisturbed; loops in each round."""
WITHOUT, EVERY = "without", "every"
CHANGED = {"network", "training", "data", WITHOUT}
"""Keys that a variant may have."""
Table = dict[str, Any]


def read_variants(path: Path, tables: Table) -> dict[str, Recipe]:
    """The variants of a file by name, in its order, without error estimator and bound.

    Args:
        tables: of the recipe.
    """
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SystemExit(f"variants {str(path)!r} cannot be read ({error})") from error
    tables = without_bound(tables)
    if EVERY in found:
        tables = changed(EVERY, found.pop(EVERY), tables)
    if not found:
        raise SystemExit(f"variants {str(path)!r} has none; expected a table for each")
    return {name: variant_of(name, changes, tables) for name, changes in found.items()}


def without_bound(tables: Table) -> Table:
    """A recipe's tables without error bound, and without the search against it."""
    validation = dict(tables.get("validation", {}))
    validation.pop("adversarial", None)
    return {**{k: v for k, v in tables.items() if k != "bound"}, "validation": validation}


def variant_of(name: str, changes: Table, tables: Table) -> Recipe:
    """One variant of a recipe's tables."""
    try:
        recipe = whole_recipe(changed(name, changes, tables))
    except RecipeError as error:
        raise SystemExit(f"variant {name!r}: {error}") from error
    return surrogate_only(recipe)


def changed(name: str, changes: Table, tables: Table) -> Table:
    """A recipe's tables with the changes of a variant."""
    if not isinstance(changes, dict) or not set(changes) <= CHANGED:
        raise SystemExit(
            f"variant {name!r} = {changes}; expected a table with some of {sorted(CHANGED)}"
        )
    without, data = changes.get(WITHOUT, []), changes.get("data", {})
    if not (isinstance(without, list) and all(isinstance(place, str) for place in without)):
        raise SystemExit(
            f"variant {name!r}: without = {without!r}; expected a list of dotted keys"
        )
    if not (isinstance(data, dict) and set(data) <= {"train"}):
        raise SystemExit(
            f"variant {name!r}: data = {data!r}; expected train alone: all variants "
            "learn from the recipe's data"
        )
    base = tables
    for place in without:
        base = taken_away(base, place.split("."), f"variant {name!r}: without {place!r}")
    return merged(base, {key: value for key, value in changes.items() if key != WITHOUT})


def merged(table: Table, changes: Table) -> Table:
    """A table with nested changes."""
    result = dict(table)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = merged(result[key], value) if both else value
    return result


def taken_away(table: Table, keys: Sequence[str], place: str) -> Table:
    """A table without one of its nested keys."""
    first, *rest = keys
    if first not in table or (rest and not isinstance(table[first], dict)):
        raise SystemExit(f"{place}: no {first!r} in {sorted(table)}; expected a key of the recipe")
    if rest:
        return {**table, first: taken_away(table[first], rest, place)}
    return {key: value for key, value in table.items() if key != first}


def study(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Train what is not there yet, measure and time all variants."""
    torch.set_num_threads(1)
    job = open_job(arguments.recipe, arguments.runs, bar)
    variants = read_variants(arguments.variants, tomllib.loads(job.text))
    for recipe in variants.values():
        check_case(case_of(recipe))
    most = max(variants.values(), key=lambda recipe: recipe.data.train)
    generate_data(dataclasses.replace(job, case=job.case.with_recipe(most)), Workplace())
    found = trained(variants, job.folder, arguments.workers, bar)
    motions = motions_of(job.recipe, arguments, bar("test motions"))
    times = step_times([one.surrogate for one in found], arguments.rounds)
    return {
        "recipe": job.recipe.name,
        "reference": dict(job.recipe.system.reference),
        "seed": arguments.seed,
        "trajectories": len(motions),
        "outputs": [signal.name for signal in found[0].surrogate.outputs],
        "variants": [
            {"variant": name, **figures(one, motions), **time}
            for name, one, time in zip(variants, found, times, strict=True)
        ],
    }


def motions_of(
    recipe: Recipe, arguments: argparse.Namespace, advance: Progress
) -> list[UnseenMotion]:
    """Unseen motions with the reference model's outputs, the same for all variants."""
    duration = recipe.measured_duration()
    stream = Stream(TEST, arguments.seed, (1.0, 1.0), duration)
    count = recipe.unseen(arguments.trajectories)
    return list(unseen_motions(recipe, case_of(recipe).reference, stream, count, advance))


def figures(one: Trained, motions: Sequence[UnseenMotion]) -> dict[str, Any]:
    """A row of the table, without times per step."""
    parts = [scored(one.surrogate, motion) for motion in motions]
    errors, references = (np.concatenate(part) for part in zip(*parts, strict=True))
    return {
        "family": one.recipe.network.family,
        "parameters": one.surrogate.network.count_parameters(),
        "simulated_seconds": simulated_seconds(one.recipe),
        "training_cpu_seconds": one.cpu_seconds,
        "relative_rmse": (rms(errors) / rms(references)).tolist(),
    }


def step_times(surrogates: Sequence[Surrogate], rounds: int) -> list[dict[str, float]]:
    """Medians of the times inside C in microseconds, all surrogates taking turns."""
    kernels: list[list[float]] = [[] for _ in surrogates]
    steps: list[list[float]] = [[] for _ in surrogates]
    inside = [TimedSurrogate(surrogate) for surrogate in surrogates]
    for _ in range(rounds * LOOPS):
        for native, kernel, step in zip(inside, kernels, steps, strict=True):
            kernel += part_times(native, Part.NETWORK, 1, LOOP)
            step += part_times(native, Part.STEP, 1, LOOP)
    return [
        {"kernel_us": 1e6 * float(np.median(kernel)), "step_us": 1e6 * float(np.median(step))}
        for kernel, step in zip(kernels, steps, strict=True)
    ]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--variants", type=Path, required=True, help="TOML file")
    parser.add_argument(
        "--trajectories", type=positive, help="unseen ones; the recipe's if not given"
    )
    parser.add_argument("--seed", type=int, default=STRUCTURES, help="of the unseen motions")
    parser.add_argument("--rounds", type=positive, default=5, help="of the timing")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--workers", type=positive, default=1, help="trainings at the same time")
    measure_and_write(parser, study)


if __name__ == "__main__":
    main()
