"""Accuracy and cost of a recipe over several training seeds: each, mean and standard deviation.

    python tests/benchmarks/seed_study.py training/duffing_paper_code.toml --seeds 3 --json -

Data are generated once, in ``runs/<name>``. Every seed trains a surrogate (and error estimator) of
its own, which is exported and run beside the reference FMU on unseen trajectories. What is trained
stays in ``runs/<name>/trainings`` for the next call, as long as recipe and file format are the
same: remove it to train anew with other code. ``--train`` compares recipes on the same number of
trajectories, ``--surrogate-only`` leaves out the error estimator. Several numbers after
``--train`` give one study each, all on the first trajectories of the same data: the learning
curve, which ``--picture`` draws over the simulated time.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import torch
from figures_out import write_figures
from matplotlib.figure import Figure
from studies import (
    Trained,
    positive,
    simulated_seconds,
    statistics,
    surrogate_only,
    trained,
    with_train,
)

from slide_fmu.cli.console import progress_bars
from slide_fmu.core.figures import plain
from slide_fmu.core.progress import Stages
from slide_fmu.data.workplace import Workplace
from slide_fmu.fmu.export import export_fmu
from slide_fmu.pipeline.job import checked, open_job, with_training_seed
from slide_fmu.pipeline.measurement import tasks
from slide_fmu.pipeline.stages import generate_data
from slide_fmu.recipe.case import case_of
from slide_fmu.validation.task import IN_RANGE, UNSEEN_SEED
from slide_fmu.validation.validate import validate


def studies(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Train and validate every seed on every number of trajectories."""
    torch.set_num_threads(1)
    job = checked(open_job(arguments.recipe, arguments.runs, bar))
    base = surrogate_only(job.recipe) if arguments.surrogate_only else job.recipe
    counts = sorted(set(arguments.train or [base.data.train]))
    case = job.case.with_recipe(with_train(base, counts[-1]))
    job = dataclasses.replace(job, case=case)
    generate_data(job, Workplace())
    recipes = {
        f"{count} trajectories, seed {seed}": with_training_seed(with_train(base, count), seed)
        for count in counts
        for seed in range(arguments.seeds)
    }
    done = iter(trained(recipes, job.folder, arguments.workers, bar))
    found = [study(list(islice(done, arguments.seeds)), arguments) for _ in counts]
    return {"recipe": job.recipe.name, "studies": found}


def study(trainings: Sequence[Trained], arguments: argparse.Namespace) -> dict[str, Any]:
    """All seeds on the same trajectories."""
    seeds = [seed_figures(one, arguments) for one in trainings]
    recipe = trainings[0].recipe
    chosen = tasks(recipe, arguments.seed, arguments.trajectories)
    return {
        "trajectories": recipe.data.train,
        "simulated_seconds": simulated_seconds(recipe),
        "training_cpu_seconds": statistics([seed["training_cpu_seconds"] for seed in seeds]),
        "summary": {name: summary([seed[name] for seed in seeds]) for name in chosen},
        "seeds": seeds,
    }


def seed_figures(training: Trained, arguments: argparse.Namespace) -> dict[str, Any]:
    """What one training costs and reaches."""
    recipe, surrogate = training.recipe, training.surrogate
    chosen = tasks(recipe, arguments.seed, arguments.trajectories)
    with tempfile.TemporaryDirectory() as place:
        fmu = export_fmu(surrogate, Path(place) / f"{recipe.name}.fmu")
        measured = {
            name: plain(validate(fmu, surrogate, case_of(recipe), task, quiet).figures())
            for name, task in chosen.items()
        }
    return {
        "training_seed": recipe.training.seed,
        "parameters": surrogate.network.count_parameters(),
        "training_cpu_seconds": training.cpu_seconds,
        **measured,
    }


def quiet(done: int, total: int) -> None:
    """No progress: validations are short beside the trainings."""


def summary(seeds: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Median, mean, standard deviation and extremes over the seeds, by output."""
    result: dict[str, Any] = {}
    for index, output in enumerate(seeds[0]["outputs"]):
        for key in ("rmse", "relative_rmse"):
            values = [s["outputs"][index][key] for s in seeds]
            result[f"{output['name']}_{key}"] = statistics(values)
    if seeds[0]["error_estimate"] is not None:
        for index, output in enumerate(seeds[0]["error_estimate"]["without_floor"]):
            for key in ("mean", "p95"):
                found = [s["error_estimate"]["without_floor"][index][key] for s in seeds]
                result[f"{output['name']}_estimate_{key}_deviation"] = statistics(found)
    return result


def draw_curve(figures: dict[str, Any], path: Path) -> None:
    """The learning curve as PNG: relative RMSE in range over the simulated time.

    Lines are medians over the seeds, bars go from the smallest to the largest.
    """
    found = figures["studies"]
    seconds = [study["simulated_seconds"] for study in found]
    figure = Figure(figsize=(6, 4.2), layout="constrained")
    ax = figure.subplots()
    for output in found[0]["seeds"][0][IN_RANGE]["outputs"]:
        key = f"{output['name']}_relative_rmse"
        errors = [study["summary"][IN_RANGE][key] for study in found]
        medians = [100 * error["median"] for error in errors]
        below = [100 * (error["median"] - error["smallest"]) for error in errors]
        above = [100 * (error["largest"] - error["median"]) for error in errors]
        ax.errorbar(seconds, medians, [below, above], marker="o", capsize=3, label=output["name"])
    ax.set(xscale="log", yscale="log", title=figures["recipe"])
    ax.set(xlabel="simulated time learnt from / s", ylabel="relative RMSE / %")
    ax.grid(alpha=0.3, which="both")
    ax.legend(fontsize=8)
    figure.savefig(path, dpi=130, metadata={"Software": None})


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--seeds", type=int, choices=range(1, 100), default=3, metavar="N")
    parser.add_argument(
        "--train",
        type=positive,
        nargs="+",
        metavar="N",
        help="trajectories to learn from, one study for each number; the recipe's if not given",
    )
    parser.add_argument("--surrogate-only", action="store_true", help="no error estimator")
    parser.add_argument("--trajectories", type=positive, help="the recipe's if not given")
    parser.add_argument("--seed", type=int, default=UNSEEN_SEED, help="of the trajectories")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--workers", type=positive, default=1, help="trainings at the same time")
    parser.add_argument("--picture", type=Path, help="PNG of the learning curve")
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    with progress_bars() as bar:
        figures = studies(arguments, bar)
    write_figures(figures, arguments.json)
    if arguments.picture is not None:
        draw_curve(figures, arguments.picture)


if __name__ == "__main__":
    main()
