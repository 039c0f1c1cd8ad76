"""The surrogate and its error estimator are trained, and kept in the run folder."""

from __future__ import annotations

from typing import Any

from slide_fmu.pipeline.job import Job, versions
from slide_fmu.recipe.systems import recipe_system


def train_surrogate(job: Job, threads: int = 1) -> dict[str, Any]:
    """Train surrogate and error estimator, and keep them in the run folder.

    Networks of this size gain little from a second thread of the processor, and lose much when
    another program needs it; with one, every machine sums in the same order.

    Returns:
        Best validation error by stage (scaled units), parameters, seed.

    Raises:
        StoreError: trajectories are missing.
        TrainingError: a training diverged.
    """
    import torch

    from slide_fmu.learn.fit import fit_surrogate

    system = recipe_system(job.recipe)
    torch.set_num_threads(threads)

    folder = job.folder
    fit = fit_surrogate(job.recipe, system, folder.store, folder.checkpoints, job.bar)
    job.folder.save_surrogate(fit.surrogate, job.recipe, fit.histories, versions())
    return {
        "validation_error": {n: min(h.validation_error) for n, h in fit.histories.items()},
        "parameters": fit.surrogate.network.count_parameters(),
        "seed": job.recipe.training.seed,
    }
