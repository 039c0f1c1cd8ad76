"""This module does the stages up to the surrogate: window, data, training, test of stability.

Their jobs have been checked (``slide_fmu.pipeline.job.checked``), once for all stages.
"""

from __future__ import annotations

import datetime
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slide_fmu.bounds.known_start import known_start, start_origin
from slide_fmu.core.figures import optional
from slide_fmu.core.files import write_whole
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.data.workplace import Workplace
from slide_fmu.fitting.history import Curve, SizeTrial, explanations_of
from slide_fmu.memory.sizing import AnySizing, Sizing, require_window, size_window
from slide_fmu.memory.stability import AmplitudeTest, check_stability, require_stability
from slide_fmu.memory.step_remark import step_remark
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.pipeline.case_checks import guarded_case
from slide_fmu.pipeline.job import Job, checked, versions, with_values
from slide_fmu.pipeline.numbers import find_numbers, kept_curve, too_few_of_a_kind
from slide_fmu.pipeline.run_folder import TrainedSurrogate
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.report.quality import remark_on_training
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System

STABILITY_REPORT = "stability.html"


@dataclass(frozen=True, kw_only=True)
class DataFigures:
    """These are the figures of the data of a recipe.

    Attributes:
        trajectories: numbers of trajectories by their use.
        made_now: number that this program made in ``wall_time_s``.
        failed: number of failed trajectories, which were replaced.
        remark: remark on failed trajectories beyond the range.
    """

    trajectories: Mapping[str, int]
    simulated_time_s: float
    made_now: int
    failed: int
    remark: str | None
    wall_time_s: float
    seed: int
    learning_curve: Curve | None = optional()


@dataclass(frozen=True, kw_only=True)
class TrainingFigures:
    """These are the figures of a training.

    Attributes:
        validation_error: the best one by stage, in scaled units.
        parameters: number of the network's parameters.
        sizes_tried: sizes that a search has tried.
        explanations: one sentence for each choice of features, hidden units or sizes, on why it
            pays; empty without a search.
        remark: remark on the result.
    """

    validation_error: Mapping[str, float]
    parameters: int
    sizes_tried: tuple[SizeTrial, ...]
    explanations: tuple[str, ...]
    remark: str | None
    seed: int


@dataclass(frozen=True, eq=False)
class Training:
    """A Training is a trained surrogate with its recipe.

    Attributes:
        made_now: whether this program trained it; otherwise it was found.
    """

    trained: TrainedSurrogate
    recipe: Recipe
    made_now: bool

    def figures(self) -> TrainingFigures:
        """Return the figures of the training."""
        histories = self.trained.histories
        remarks = (
            *(history.remark for history in histories.values()),
            remark_on_training(self.recipe, histories["surrogate"]),
        )
        return TrainingFigures(
            validation_error={n: min(h.validation_error) for n, h in histories.items()},
            parameters=self.trained.surrogate.network.count_parameters(),
            sizes_tried=histories["surrogate"].sizes,
            explanations=explanations_of(histories),
            remark="; ".join(remark for remark in remarks if remark is not None) or None,
            seed=self.recipe.training.seed,
        )


def size_recipe(job: Job, seed: int | None = None, patience: float = math.inf) -> AnySizing:
    """Return the decay times of the recipe's system along its motions, with a seed or the data's.

    After the patience, in s, the remaining motions are left out.
    """
    progress = job.bar("window")
    progress(0, 1)  # a message at once, since slow systems need minutes
    sizing = size_case(job.case.source, job.case, seed, patience)
    progress(1, 1)
    return sizing


@asked_of_sources
def size_case(system: System, case: Case, seed: int | None, patience: float) -> AnySizing:
    """Size the window of a case, in a separate program if its system may crash."""
    return guarded_case(case, _sizing, seed, patience)


def _sizing(case: Case, seed: int | None, patience: float) -> Sizing:
    """Size the window; with physical parameters, at the corner with the longest memory."""
    of_corners = []
    for corner in case.corners():
        at = case.at_ends(corner)
        of_corners.append(size_window(at.recipe, at.system, seed, patience=TimeBudget(patience)))
    return max(of_corners, key=_memory)


def _memory(sizing: Sizing) -> tuple[bool, float]:
    """Sort key of sizings: refused windows last, then by longest decay time in s."""
    times = sizing.measured.times
    met = times[np.isfinite(times)]
    return sizing.refusal is not None, max(sizing.needed, float(met.max(initial=0.0)))


def remark_on_step(case: Case) -> str | None:
    """Say that a recipe's step is too coarse, or changes the motion; else None."""
    return step_of_case(case.source, case)


@asked_of_sources
def step_of_case(system: System, case: Case) -> str | None:
    """Return ``remark_on_step``, in a separate program if the system may crash."""
    return guarded_case(case, step_remark)


def check_window(job: Job) -> AnySizing:
    """Compute the decay times, and refuse a window that is too short.

    Raises:
        ShortWindowError: the window is too short for the system.
    """
    sizing = job.sizing or size_recipe(job)
    require_window(job.recipe, sizing)
    return sizing


def choose_numbers(job: Job, place: Workplace) -> Job:
    """Return the job with all its numbers of trajectories; those left open are found.

    The workplace makes the trajectories for this.
    """
    numbers = find_numbers(job.case, job.open_keys, job.folder, job.bar, place, job.recipe_folder)
    if not numbers:
        return job
    known = with_values(job, numbers)
    remark = too_few_of_a_kind(known.recipe) if "data.calibration" in job.open_keys else None
    if remark is not None:
        job.tell(remark)
    return known


def generate_data(job: Job, place: Workplace) -> DataFigures:
    """Make all trajectories that are not in the run folder yet.

    Raises:
        SimulationError: too many trajectories could not be simulated.
        ClusterError: the cluster cannot be used.
    """
    from slide_fmu.data.failures import kept_failures, remark_on_beyond

    job.open_recipe.resolved()
    of_bound = " of network and bound" if job.recipe.bound is not None else ""
    progress = job.bar(f"trajectories{of_bound}")
    begin = time.monotonic()
    folder = job.folder.trajectories
    made = place.make(job.case, job.recipe_folder, folder, progress)
    curve = kept_curve(job.case, job.folder)
    counts = {split: job.recipe.count(split) for split in SPLITS}
    simulated = sum(counts.values()) * (job.recipe.data.duration + job.recipe.data.burn_in)
    return DataFigures(
        trajectories=counts,
        simulated_time_s=simulated,
        made_now=made,
        failed=len(kept_failures(job.case, folder)),
        remark=remark_on_beyond(job.case, folder),
        wall_time_s=time.monotonic() - begin,
        seed=job.recipe.data.seed,
        learning_curve=curve if curve.points else None,
    )


def train_recipe(job: Job, threads: int) -> TrainingFigures:
    """Train a recipe on the trajectories of its run folder, and return the figures.

    Raises:
        RecipeError: the recipe leaves numbers of trajectories open that are not kept.
        TrajectoryError: trajectories are missing.
        ShortWindowError: the window is too short for the system.
        TrainingError: a training diverged.
    """
    job.open_recipe.resolved()
    Trajectories.of(job.case, job.folder.trajectories).require()
    check_window(checked(job))  # only now, since it may take minutes
    return train_surrogate(job, threads).figures()


def train_surrogate(job: Job, threads: int = 1) -> Training:
    """Train surrogate and error estimator, or find them in the run folder, where they are kept.

    Networks of this size gain little from a second thread of the processor, and lose much when
    another program needs it; with one, every machine sums in the same order.

    Raises:
        TrajectoryError: trajectories are missing.
        TrainingError: a training diverged.
    """
    import torch

    from slide_fmu.bounds.fit import fit_surrogate, key_of_surrogate
    from slide_fmu.fitting.preparation import Work

    recipe, folder = job.open_recipe.resolved(), job.folder
    torch.set_num_threads(threads)
    known = known_start(recipe, job.case.source)
    work = Work(job.case, folder.trajectories, folder.checkpoints, job.bar, known)
    key = key_of_surrogate(work)
    kept = folder.known_training(key)
    if kept is not None:
        return Training(kept, recipe, made_now=False)
    fit = fit_surrogate(work, side_by_side=True)
    start = start_origin(recipe, known)
    trained = TrainedSurrogate(fit.surrogate, fit.histories, versions(recipe), start)
    folder.save_training(trained, recipe, key)
    return Training(trained, recipe, made_now=True)


def examine_stability(job: Job, surrogate: Surrogate) -> tuple[AmplitudeTest, ...]:
    """Test a state-space surrogate beyond its amplitude; the charts of a failure are kept.

    Raises:
        UnstableSurrogateError: the test failed, and the recipe does not allow that.
    """
    tests = check_stability(surrogate, job.case)
    page = job.folder.path / STABILITY_REPORT
    page.unlink(missing_ok=True)
    if any(test.problem is not None for test in tests):
        from slide_fmu.report.html_report import Report
        from slide_fmu.report.learning_sections import stability_section

        section = stability_section(tests, surrogate.window.step)
        report = Report(f"{job.recipe.name}: not stable", job.recipe.description, {}, [section])
        write_whole(page, report.html(datetime.date.today()).encode("utf-8"))
    require_stability(tests, job.recipe, str(page))
    return tests


def generate_recipe(job: Job, workers: int | None, executor: str | None) -> DataFigures:
    """Make the trajectories of a recipe, and return the figures of ``generate_data``.

    Several programs may do so in one run folder.

    Args:
        job: the recipe and its run folder.
        workers: number of processes of this machine; one per core if None.
        executor: address of a cluster, ``dask://HOST:PORT``; None for this machine.
    """
    place = Workplace(workers, executor)
    job = checked(job)
    check_window(job)
    job = choose_numbers(job, place)
    return generate_data(job, place)
