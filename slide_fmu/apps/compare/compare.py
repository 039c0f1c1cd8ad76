"""The recipe's network is compared with models of other kinds, on the same data and budget."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from slide_fmu.apps.compare.baselines.base import Budget, NetworkBaseline
from slide_fmu.apps.compare.baselines.candidates import CANDIDATES, BaselineCandidate
from slide_fmu.apps.compare.baselines.lesson import Lesson, lesson_of
from slide_fmu.apps.compare.baselines.own_network import OwnNetwork
from slide_fmu.apps.compare.baselines.polynomial import require_sysidentpy
from slide_fmu.apps.compare.measurement import ComparisonBench, StepTimes, UnseenTest, fmu_of
from slide_fmu.apps.compare.model_figures import ComparisonFigures, ModelFigures
from slide_fmu.apps.compare.sections import baselines_report, linear_remark
from slide_fmu.core.progress import Stages
from slide_fmu.core.result_cache import ResultFile, damage_named, key_of
from slide_fmu.data.draws import TEST, Stream, probe
from slide_fmu.data.trajectories import Split, Trajectories, values_of_draws
from slide_fmu.data.unseen import UnseenMotion, known_or_simulated, unseen_motions
from slide_fmu.data.workplace import Workplace
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.network.base import Network
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.pipeline.job import Job, checked, versions
from slide_fmu.pipeline.run_folder import StageError, TrainedSurrogate
from slide_fmu.pipeline.stages import check_window, choose_numbers, generate_data, train_surrogate
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import RecipeError


@dataclass(frozen=True)
class KeptComparison:
    """A KeptComparison is a folder with the results of comparisons."""

    path: Path

    def figures(self, name: str, key: str, find: Callable[[], ModelFigures]) -> ModelFigures:
        """Return the figures of a model; they are computed if none with this key are stored.

        Raises:
            DamagedFileError: a stored file is damaged.
        """
        file = ResultFile.of(self.path, name, key)
        known = file.read_json(ModelFigures)
        if known is not None:
            return known
        figures = find()
        file.write_json(figures)
        return figures

    def motions(self, key: str, find: Callable[[], Sequence[UnseenMotion]]) -> list[UnseenMotion]:
        """Return unseen motions; they are simulated if none with this key are stored.

        Raises:
            DamagedFileError: a stored file is damaged.
        """
        file = ResultFile.of(self.path, "unseen", key, suffix=".npz")
        known = file.read_arrays()
        if known is not None:
            with damage_named(file.path, "arrays that compare wrote"):
                numbers = range(len(known["about"]))
                return [
                    UnseenMotion(
                        known[f"inputs_{number}"],
                        known[f"outputs_{number}"],
                        *known["about"][number].tolist(),
                    )
                    for number in numbers
                ]
        motions = list(find())
        arrays = {"about": np.array([[motion.burn_in, motion.kind] for motion in motions])}
        for number, motion in enumerate(motions):
            arrays[f"inputs_{number}"], arrays[f"outputs_{number}"] = motion.inputs, motion.outputs
        file.write_arrays(arrays)
        return motions


FOLDER = "compare"


@dataclass(frozen=True)
class Terms:
    """Terms of a comparison are the same for all models.

    Attributes:
        budget: CPU time in s to train each model; if None, the time that the training of the
            recipe's own network took.
        seed: seed of the unseen motions.
        trajectories: their number; the recipe's if None.
        workers: processes that make missing trajectories; one per core if None.

    Raises:
        ValueError: the budget is not positive.
    """

    budget: float | None
    seed: int
    trajectories: int | None = None
    workers: int | None = None

    def __post_init__(self) -> None:
        if self.budget is not None and not 0 < self.budget < float("inf"):
            raise ValueError(f"budget = {self.budget} s; expected a positive, finite CPU time")


def require_comparable(case: Case) -> None:
    """Refuse a recipe that models of other kinds cannot learn.

    Raises:
        RecipeError: it has physical parameters, or records that lack outputs.
        LoadError: its records cannot be read.
    """
    recipe = case.recipe
    if recipe.parameters:
        raise RecipeError(
            f"recipe {recipe.name!r}: the physical parameters {list(recipe.parameters)}; "
            "expected none for a comparison, since other kinds of models cannot follow them: "
            "compare with a recipe that has fixed values (system.parameters)"
        )
    if case.source.lacks_outputs:
        raise RecipeError(
            f"recipe {recipe.name!r}: outputs are missing in its records; expected all of "
            "them, since other kinds of models look back at outputs: cut the files where "
            "outputs are missing"
        )


def compare_recipe(job: Job, terms: Terms) -> tuple[ComparisonFigures, Path]:
    """Train models of other kinds on a recipe's data, and measure all on the same unseen motions.

    Missing data and a missing surrogate are made first, as by ``slide-fmu run``. Models that were
    compared before on the same terms are not trained again.

    Returns:
        The figures, and the page of the report.

    Raises:
        MissingPackageError: the extra ``compare`` is not installed.
        LoadError, RecipeError, ShortWindowError, SimulationError, TrainingError: as
            for the stages that make data and surrogate.
    """
    require_comparable(job.case)
    import torch

    require_sysidentpy()
    torch.set_num_threads(1)
    job, trained = _trained(job, terms)
    recipe, surrogate, kept = job.recipe, trained.surrogate, KeptComparison(_folder(job))
    trajectories = Trajectories.of(job.case, job.folder.trajectories)
    training, validation = (trajectories.read(name) for name in ("train", "validation"))
    test = UnseenTest(surrogate, _unseen(job, terms, kept))
    lesson = lesson_of(surrogate, training, validation, recipe.training.seed)
    own = trained.histories["surrogate"].cpu_seconds
    assert own is not None  # every training is timed
    budget = own if terms.budget is None else terms.budget
    again = OwnNetwork(job.case, job.folder.trajectories, surrogate, own)
    key = key_of(_decisive(test, (training, validation)), lesson.seed, budget, versions(recipe))
    with fmu_of(surrogate) as fmu:
        bench = ComparisonBench(test, StepTimes(surrogate, fmu, test.motions[0]))
        find = partial(_own, again, lesson, bench, budget, job.bar)
        models = [kept.figures("own", key, find) if budget < own else find()]
        for name, candidate in CANDIDATES.items():
            find = partial(_measured, candidate, lesson, bench, budget, job.bar)
            models.append(kept.figures(name, key, find))
    figures = ComparisonFigures(
        name=recipe.name,
        trajectories=len(test.motions),
        budget_s=budget,
        seed=terms.seed,
        training_seed=recipe.training.seed,
        models=tuple(models),
        remark=linear_remark(models),
    )
    return figures, baselines_report(figures, recipe.description).write(_folder(job))


def _folder(job: Job) -> Path:
    return job.folder.path / FOLDER


def _trained(job: Job, terms: Terms) -> tuple[Job, TrainedSurrogate]:
    """Return the recipe's surrogate; it is made with its data if it is missing."""
    try:
        return job, job.folder.load_surrogate(job.recipe)
    except StageError:
        job = checked(job)
        check_window(job)
        job = choose_numbers(job, Workplace(terms.workers))
        generate_data(job, Workplace(terms.workers))
        return job, train_surrogate(job).trained


def _unseen(job: Job, terms: Terms, kept: KeptComparison) -> list[UnseenMotion]:
    """Return the unseen motions, the same as in ``validate``."""
    simulate = partial(_simulated, job, terms, kept)
    motions = known_or_simulated(job.case.source, job.recipe, simulate)
    return motions[: terms.trajectories]


def _simulated(job: Job, terms: Terms, kept: KeptComparison) -> list[UnseenMotion]:
    """Return unseen motions of the reference system."""
    recipe, reference = job.recipe, job.case.reference
    duration = recipe.measured_duration()
    count = recipe.unseen(terms.trajectories)
    stream = Stream(TEST, terms.seed, (1.0, 1.0), duration)
    key = key_of(
        values_of_draws(recipe),
        recipe.system.model_dump(mode="json", include={"reference"}),
        [stream.seed, stream.duration, count],
        probe(recipe, reference),
    )
    progress = job.bar("unseen motions")
    return kept.motions(
        key, lambda: list(unseen_motions(recipe, reference, stream, count, progress))
    )


def _decisive(test: UnseenTest, splits: tuple[Split, Split]) -> tuple[object, ...]:
    """Return what all models learn from, and are measured on."""
    motions = [[motion.inputs, motion.outputs] for motion in test.motions]
    return (test.surrogate.to_bytes(), splits, motions)


def _own(
    own: OwnNetwork, lesson: Lesson, bench: ComparisonBench, budget: float, bar: Stages
) -> ModelFigures:
    """Measure the recipe's network; it is trained again if its training took longer."""
    title = f"own: {own.case.recipe.network.family.replace('_', ' ')}"
    network = own.surrogate.network
    if budget < own.seconds and own.can_be_fitted:
        candidate = BaselineCandidate(title, network.is_affine, lambda _, *terms: own.fit(*terms))
        figures = _measured(candidate, lesson, bench, budget, bar)
        return replace(figures, structure=_size(network))
    model = ModelFigures(
        title=title,
        linear=network.is_affine,
        structure=_size(network),
        cpu_seconds=own.seconds,
    )
    frozen = NetworkBaseline(network, own.surrogate.window, len(own.surrogate.outputs))
    return bench.measured(model, frozen)


def _size(network: Network) -> str:
    if isinstance(network, StateSpace):
        return f"{len(network.cell.a)} states, {len(network.cell.w)} units"
    if isinstance(network, FeedForward) and len(network.layers) > 1:
        return " x ".join(str(len(layer.bias)) for layer in network.layers[:-1]) + " units"
    return "affine" if network.is_affine else ""


def _measured(
    candidate: BaselineCandidate,
    lesson: Lesson,
    bench: ComparisonBench,
    budget: float,
    bar: Stages,
) -> ModelFigures:
    """Train and measure a model; if training fails, the figures have the reason."""
    clock, title, linear = Budget(budget), candidate.title, candidate.linear
    try:
        learnt = candidate.fit(lesson, clock, bar(candidate.title))
    except (TrainingError, ValueError, np.linalg.LinAlgError) as error:
        return ModelFigures(
            title=title, linear=linear, structure="", failed=str(error), cpu_seconds=clock.spent
        )
    model = ModelFigures(
        title=title,
        linear=linear,
        structure=learnt.structure,
        cut=learnt.cut,
        cpu_seconds=clock.spent,
        validation_error=None if learnt.course is None else learnt.course.error,
        error_half_way=None if learnt.course is None else learnt.course.error_half_way,
    )
    return bench.measured(model, learnt.baseline)
