"""Accuracy and cost of a recipe over several training seeds: every seed, mean and spread.

    python tests/benchmarks/seed_study.py training/duffing_paper_code.toml --seeds 3 --json -

Data are generated once, in ``runs/<name>``. Every seed trains a surrogate (and error estimator) of
its own, which is exported and run beside the reference FMU on unseen trajectories. ``--train``
compares recipes on the same number of trajectories, ``--surrogate-only`` leaves out the error
estimator (give both a ``--runs`` of their own).
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import write_figures

from slide_fmu import pipeline
from slide_fmu.cli import UNSEEN_SEED, progress_bars
from slide_fmu.data.sampling import recipe_system
from slide_fmu.fmu.export import export_fmu
from slide_fmu.learn.fit import fit_surrogate
from slide_fmu.recipe import Recipe
from slide_fmu.validation import validate


def study(arguments: argparse.Namespace, bar: pipeline.Bar) -> dict[str, Any]:
    """Train and validate every seed."""
    torch.set_num_threads(1)
    job = pipeline.open_job(arguments.recipe, arguments.runs, bar)
    job = dataclasses.replace(job, recipe=adapted(job.recipe, arguments))
    pipeline.generate_data(job, None, False)
    seeds = []
    for seed in range(arguments.seeds):
        recipe = pipeline.with_training_seed(job.recipe, seed)
        begin = time.process_time()
        with tempfile.TemporaryDirectory() as checkpoints:  # what was trained before costs nothing
            fit = fit_surrogate(
                recipe,
                recipe_system(recipe),
                job.folder.store,
                Path(checkpoints),
                lambda stage, seed=seed: stage_progress(bar(f"{stage}, seed {seed}")),
            )
        seconds = time.process_time() - begin
        fmu = job.folder.path / f"{recipe.name}_seed_{seed}.fmu"
        origin = pipeline.provenance(dataclasses.replace(job, recipe=recipe), pipeline.versions())
        export_fmu(fit.surrogate, fmu, provenance=origin)
        measured = {
            name: validate(fmu, fit.surrogate, recipe, task, quiet).figures()
            for name, task in pipeline.tasks(
                recipe, arguments.seed, arguments.trajectories
            ).items()
        }
        cost = {
            "parameters": fit.surrogate.network.count_parameters(),
            "training_cpu_seconds": seconds,
        }
        seeds.append({"training_seed": seed, **cost, **measured})
        plain = {"training_seed", *cost}
    names = [name for name in seeds[0] if name not in plain]
    return {
        "recipe": job.recipe.name,
        "trajectories": job.recipe.data.train,
        "simulated_seconds": job.recipe.data.train * job.recipe.data.duration,
        "training_cpu_seconds": statistics(np.array([s["training_cpu_seconds"] for s in seeds])),
        "summary": {name: summary([seed[name] for seed in seeds]) for name in names},
        "seeds": seeds,
    }


def adapted(recipe: Recipe, arguments: argparse.Namespace) -> Recipe:
    """The recipe with the number of trajectories and the networks that were asked for."""
    data: dict[str, Any] = {}
    if arguments.train is not None:
        data["train"] = arguments.train
    if arguments.surrogate_only:
        data |= {"estimator": 0, "estimator_validation": 0}
        recipe = recipe.model_copy(update={"estimator": None})
    return recipe.model_copy(update={"data": recipe.data.model_copy(update=data)})


def quiet(done: int, total: int) -> None:
    """No progress: validations are short beside the trainings."""


def stage_progress(advance: pipeline.Advance) -> Any:
    """Progress of a training on a bar."""
    return lambda done, total, best: advance(done, total, f"validation RMSE {best:.3g}")


def summary(seeds: list[dict[str, Any]]) -> dict[str, Any]:
    """Median, mean, standard deviation and extremes over the seeds, by output."""
    result: dict[str, Any] = {}
    for index, output in enumerate(seeds[0]["outputs"]):
        for key in ("rmse", "relative_rmse"):
            values = np.array([s["outputs"][index][key] for s in seeds])
            result[f"{output['name']}_{key}"] = statistics(values)
    if seeds[0]["error_estimate"] is not None:
        for key in ("mean_relative_deviation", "p95_relative_deviation"):
            result[key] = statistics(np.array([s["error_estimate"][key] for s in seeds]))
    return result


def statistics(values: Any) -> dict[str, float]:
    """Plain statistics of a vector."""
    return {
        "median": float(np.median(values)),
        "mean": float(np.mean(values)),
        "standard_deviation": float(np.std(values, ddof=1)) if len(values) > 1 else 0.0,
        "smallest": float(np.min(values)),
        "largest": float(np.max(values)),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--seeds", type=int, choices=range(1, 100), default=3, metavar="N")
    parser.add_argument("--train", type=int, help="trajectories to learn from; the recipe's")
    parser.add_argument("--surrogate-only", action="store_true", help="no error estimator")
    parser.add_argument("--trajectories", type=int, help="the recipe's if not given")
    parser.add_argument("--seed", type=int, default=UNSEEN_SEED, help="of the trajectories")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    with progress_bars() as bar:
        figures = study(arguments, bar)
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
