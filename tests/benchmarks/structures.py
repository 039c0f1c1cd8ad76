"""Structures of networks that were tried for a recipe, on the same data and the same test.

    python tests/benchmarks/structures.py training/slider_crank.toml \
        --variants tests/benchmarks/variants/slider_crank.toml --json -

The file of variants has a table for each of them, which is merged into the recipe: of [network],
[training] and [data] (``train`` alone) what is other, and in ``without`` the dotted keys that are
taken away before. An empty table is the recipe itself. A variant of another family takes away
both tables first: ``without = ["network", "training"]``.

The recipe's data are generated once, in ``runs/<name>``. Every variant trains a surrogate without
error estimator, which stays in ``runs/<name>/structures`` for the next call, as long as recipe and
variant say the same (and the file format is the same): remove it to train anew with other code.
Rows give what it cost, the relative RMSE against the recipe's reference model on unseen motions,
and medians of times inside C, all variants taking turns in one run: of one evaluation of the
network (``kernel_us``: layers, or both cells of a ping-pong step) and of the whole step, features
included (``step_us``).
"""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import write_figures
from kernel_time import KernelTime
from pydantic import ValidationError
from seeds import STRUCTURES
from studies import first_trajectories, simulated_seconds, surrogate_only, trained
from unseen import Motion, scored, unseen_motions

from slide_fmu import pipeline
from slide_fmu.cli import progress_bars
from slide_fmu.data.sampling import TEST, Stream
from slide_fmu.errors import rms
from slide_fmu.payload import VERSION
from slide_fmu.recipe import Recipe
from slide_fmu.surrogate import Surrogate

LOOP, LOOPS = 200, 20
"""Steps in one loop inside C, short enough to run undisturbed; loops in each round."""
WITHOUT = "without"
CHANGED = {"network", "training", "data", WITHOUT}
"""Keys that a variant may have."""
LEARNT_FROM = ("window", "data", "network", "training")
"""Tables of the recipe that decide, with the model, what is learnt."""
Table = dict[str, Any]


@dataclass(frozen=True)
class Variant:
    """A structure to try: its name, and the recipe that it changes, without error estimator."""

    name: str
    recipe: Recipe

    def key(self) -> str:
        """Digest of what a training depends on, the code aside."""
        system = self.recipe.system.model_dump(mode="json", exclude={"reference"})
        tables = self.recipe.model_dump(mode="json", include=set(LEARNT_FROM))
        text = json.dumps([system, tables, VERSION], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True, eq=False)
class Finished:
    """A trained variant.

    Attributes:
        variant: what was trained.
        surrogate: the result.
        cpu_seconds: of the training.
    """

    variant: Variant
    surrogate: Surrogate
    cpu_seconds: float


def read_variants(path: Path, tables: Table, train: int | None) -> list[Variant]:
    """The variants of a file, in its order.

    Args:
        tables: of the recipe.
        train: number of trajectories to learn from, where a variant names none; the recipe's if
            None.
    """
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SystemExit(f"variants {str(path)!r} cannot be read ({error})") from error
    return [variant_of(name, changes, tables, train) for name, changes in found.items()]


def variant_of(name: str, changes: Table, tables: Table, train: int | None) -> Variant:
    """One variant of a recipe's tables."""
    if not isinstance(changes, dict) or not set(changes) <= CHANGED:
        raise SystemExit(
            f"variant {name!r} = {changes}; expected a table with some of {sorted(CHANGED)}"
        )
    if not set(changes.get("data", {})) <= {"train"}:
        raise SystemExit(
            f"variant {name!r}: data = {changes['data']}; expected train alone: all variants "
            "learn from the recipe's data"
        )
    base = dict(tables)
    for place in changes.get(WITHOUT, []):
        base = taken_away(base, place.split("."), f"variant {name!r}: without {place!r}")
    if train is not None:
        base = merged(base, {"data": {"train": train}})
    change = {key: value for key, value in changes.items() if key != WITHOUT}
    try:
        recipe = Recipe.model_validate(merged(base, change))
    except ValidationError as error:
        raise SystemExit(f"variant {name!r}: {error}") from error
    return Variant(name, surrogate_only(recipe))


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


def study(arguments: argparse.Namespace, bar: pipeline.Bar) -> dict[str, Any]:
    """Train what is not there yet, measure and time all variants."""
    torch.set_num_threads(1)
    job = pipeline.open_job(arguments.recipe, arguments.runs, bar)
    variants = read_variants(arguments.variants, tomllib.loads(job.text), arguments.train)
    pipeline.generate_data(job, None, False)
    folder = job.folder.path / "structures"
    found = [finished(variant, job.folder.store, folder, bar) for variant in variants]
    motions = motions_of(job.recipe, arguments, bar("test motions"))
    times = step_times([one.surrogate for one in found], arguments.rounds)
    return {
        "recipe": job.recipe.name,
        "reference": dict(job.recipe.system.reference),
        "seed": arguments.seed,
        "trajectories": len(motions),
        "outputs": [signal.name for signal in found[0].surrogate.outputs],
        "variants": [
            {**figures(one, motions), **time} for one, time in zip(found, times, strict=True)
        ],
    }


def finished(variant: Variant, whole: Path, folder: Path, bar: pipeline.Bar) -> Finished:
    """The variant as it was trained before, or as it is trained now.

    Args:
        whole: store of the recipe.
        folder: where trained variants stay.
    """
    base = folder / f"{variant.name}-{variant.key()}"
    kept, surrogate_file = base.with_suffix(".json"), base.with_suffix(".slide")
    if not kept.exists():
        store = first_trajectories(variant.recipe, whole, folder)
        surrogate, seconds = trained(variant.recipe, store, variant.name, bar)
        surrogate.save(surrogate_file)
        write_figures(
            {"training_cpu_seconds": seconds}, str(kept)
        )  # last: the sign that it is whole
    seconds = json.loads(kept.read_text(encoding="utf-8"))["training_cpu_seconds"]
    return Finished(variant, Surrogate.load(surrogate_file), seconds)


def motions_of(
    recipe: Recipe, arguments: argparse.Namespace, advance: pipeline.Advance
) -> list[Motion]:
    """Unseen motions with the reference model's outputs, the same for all variants."""
    duration = recipe.validation.duration or recipe.data.duration
    stream = Stream(TEST, arguments.seed, (1.0, 1.0), duration)
    count = arguments.trajectories or recipe.validation.trajectories
    return list(unseen_motions(recipe, stream, count, advance))


def figures(one: Finished, motions: Sequence[Motion]) -> dict[str, Any]:
    """A row of the table, without times per step."""
    parts = [scored(one.surrogate, motion) for motion in motions]
    errors, references = (np.concatenate(part) for part in zip(*parts, strict=True))
    return {
        "variant": one.variant.name,
        "family": one.variant.recipe.network.family,
        "parameters": one.surrogate.network.count_parameters(),
        "simulated_seconds": simulated_seconds(one.variant.recipe),
        "training_cpu_seconds": one.cpu_seconds,
        "relative_rmse": (rms(errors) / rms(references)).tolist(),
    }


def step_times(surrogates: Sequence[Surrogate], rounds: int) -> list[dict[str, float]]:
    """Medians of the times inside C in microseconds, all surrogates taking turns."""
    kernels: list[list[float]] = [[] for _ in surrogates]
    steps: list[list[float]] = [[] for _ in surrogates]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        inside = []
        for index, surrogate in enumerate(surrogates):
            surrogate.save(folder / f"{index}.slide")
            inside.append(KernelTime(folder / f"{index}.slide", folder))
        for _ in range(rounds * LOOPS):
            for timer, kernel, step in zip(inside, kernels, steps, strict=True):
                kernel.append(timer.kernel(LOOP))
                step.append(timer.step(LOOP))
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
    parser.add_argument("--train", type=int, help="trajectories to learn from; the recipe's")
    parser.add_argument("--trajectories", type=int, help="unseen ones; the recipe's if not given")
    parser.add_argument("--seed", type=int, default=STRUCTURES, help="of the unseen motions")
    parser.add_argument("--rounds", type=int, default=5, help="of the timing")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    with progress_bars() as bar:
        found = study(arguments, bar)
    write_figures(found, arguments.json)


if __name__ == "__main__":
    main()
