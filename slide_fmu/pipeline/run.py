"""This module makes an FMU from a recipe, with its report and its measured error."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from slide_fmu.core.figures import plain
from slide_fmu.core.files import write_whole
from slide_fmu.cosim.check import wide_differences
from slide_fmu.data.workplace import Workplace
from slide_fmu.fitting.history import Curve
from slide_fmu.fmu.export import Provenance, export_fmu
from slide_fmu.fmu.libraries.platforms import require_new_libraries
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.memory.stability import UnstableSurrogateError
from slide_fmu.pipeline.apps import Release, last_section, with_origins
from slide_fmu.pipeline.documents import documents, write_release
from slide_fmu.pipeline.job import Job, checked, provenance
from slide_fmu.pipeline.measurement import (
    remarks_of_beyond,
    require_another,
    tasks,
    validated,
)
from slide_fmu.pipeline.run_folder import TrainedSurrogate
from slide_fmu.pipeline.stages import (
    DataFigures,
    check_window,
    choose_numbers,
    examine_stability,
    generate_data,
    train_surrogate,
)
from slide_fmu.pipeline.time_left import counted_work, time_left
from slide_fmu.recipe.against_system import load_picture
from slide_fmu.recipe.quick import REMARK
from slide_fmu.report.chart_pictures import chart_picture
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.model_card import model_card
from slide_fmu.report.quality import QualityError, require_motion
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.run_report import RunMeasurement, run_figures, run_report, with_times
from slide_fmu.report.step_chart import step_charts
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.adversarial import Attack, attack
from slide_fmu.validation.measure import rows_of
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import Row
from slide_fmu.validation.task import BEYOND, IN_RANGE, Task
from slide_fmu.validation.validate import require_own_memory

PICTURE = "error_against_step.png"
"""Picture of the error against the communication step, in the folder of the card."""

TIMES = "times.json"
"""Times of this run on this machine, in the folder of the card. The FMU has none: it is the same
file in each run."""

MECHANISM_PICTURE = "mechanism.png"
"""Picture of the reference system in motion. The model draws it if it can; otherwise a file of
this name in the run folder is used."""


@dataclass(frozen=True, eq=False)
class FinishedRun:
    """A finished run has an FMU, the page of its report, the figures of ``report.json``, and
    their verdict (``slide_fmu.report.verdict``)."""

    fmu: Path
    page: Path
    figures: RunFigures
    verdict: tuple[str, ...]


def run_recipe(
    job: Job,
    seed: int,
    trajectories: int | None,
    workers: int | None,
    threads: int,
) -> FinishedRun:
    """Make the FMU of a recipe; results of an earlier run are used again.

    Args:
        job: the recipe and its run folder.
        seed: seed of the unseen trajectories that the FMU is measured on.
        trajectories: number of these trajectories; the recipe's if None.
        workers: processes that make the trajectories; one per core if None, and if 0 this one
            makes them.
        threads: threads of the training.

    Raises:
        LoadError, RecipeError: the recipe's systems or networks cannot be made.
        ShortWindowError: the window is too short for the system.
        OldLibrariesError: the compiled runtime is older than its sources.
        StageError: the FMU would be written over its own reference.
        TrainingError: a training diverged.
        UnstableSurrogateError: the surrogate grows without bound, or does not forget its state.
    """
    require_new_libraries()  # before hours of training, after which the FMU would hold them
    require_another(job.folder.fmu(job.recipe), job.recipe)
    job, place = checked(job), Workplace(workers)
    sizing = check_window(job)  # before anything is made
    clock = time_left(job, workers, threads)
    job = replace(job, bar=clock.watched(job.bar))
    job = choose_numbers(job, place)
    clock.count(counted_work(job))
    data = generate_data(job, place)
    training = train_surrogate(job, threads)
    if not (data.made_now or training.made_now):
        job.tell("Data and training were finished already; only the measuring is left to do.")
    trained = training.trained
    results = StageResults(trained, provenance(job, trained), sizing, data)
    return measure_trained(job, results, tasks(job.recipe, seed, trajectories), workers)


@dataclass(frozen=True, eq=False)
class StageResults:
    """These are the results of the stages before the measurement.

    Attributes:
        trained: the surrogate; without histories the report says nothing of its training.
        origin: its provenance, without measured figures.
        sizing: the sizing of its window.
        data: figures of its data; None if they are not known.
    """

    trained: TrainedSurrogate
    origin: Provenance
    sizing: AnySizing
    data: DataFigures | None = None


def measure_trained(
    job: Job,
    results: StageResults,
    wanted: Mapping[str, Task],
    workers: int | None,
    known_search: Sequence[Row] | None = None,
) -> FinishedRun:
    """Measure a trained surrogate as FMU, and write the FMU with its report and its figures.

    What is measured is a bare FMU in a temporary folder. The place of the FMU gets only the
    finished one, as the last of all files.

    Args:
        job: the recipe, and the run folder for all files.
        results: results of the stages before.
        wanted: the tasks of its validation, by name; one of them is ``IN_RANGE``.
        workers: number of processes that simulate; one per core if None, no processes if 0.
        known_search: known rows of a search for unnoticed errors; if None, the search is done if
            the recipe asks for it.

    Raises:
        CoSimulationError: an FMU reports an error, or differs from its surrogate.
        QualityError: the surrogate predicts a constant.
        UnstableSurrogateError: the surrogate grows without bound, does not forget its state, or
            contradicts its measured error.
    """
    trained, data = results.trained, results.data
    surrogate = trained.surrogate
    tests = examine_stability(job, surrogate)
    with TemporaryDirectory(prefix="slide_fmu_run_") as folder:
        bare = export_fmu(surrogate, Path(folder) / job.folder.fmu(job.recipe).name)
        require_same_answers(bare)
        validations, remarks = _validations(bare, surrogate, job, wanted, workers)
        in_range = validations[IN_RANGE]
        _require_agreement(job, in_range)
        attacks = [] if known_search is not None else _searched(job, surrogate, in_range)
        rows = rows_of(bare, validations, job.case, in_range.usual_error(), job.bar, attacks)
        measurement = RunMeasurement(
            surrogate,
            trained.histories,
            validations,
            tests,
            results.sizing,
            curve=(data and data.learning_curve) or Curve(),
            rows=(*rows, *(known_search or ())),
            attacks=attacks,
            remarks=(
                *([REMARK] if job.quick else []),
                *([data.remark] if data and data.remark else []),
                *remarks,
            ),
        )
        return _write_finished(job, results, measurement, bare)


def _require_agreement(job: Job, in_range: Validation) -> None:
    """Refuse a surrogate by what was measured, and keep the reason for ``slide-fmu export``."""
    refusal = job.folder.refusal(in_range.surrogate, job.recipe)
    try:
        require_motion(in_range)
        require_own_memory(job.case.source, in_range)
    except (QualityError, UnstableSurrogateError) as error:
        refusal.write(str(error).encode("utf-8"))
        raise
    refusal.path.unlink(missing_ok=True)


def require_same_answers(fmu: Path) -> None:
    """Refuse an FMU whose compiled library differs much from numpy."""
    problems = wide_differences(fmu)
    if problems:
        raise CoSimulationError(
            f"{fmu.stem}: {'; '.join(problems)}. No FMU is written. Where the network magnifies "
            "rounding, it has learnt from inputs that are too smooth: measure or draw rougher "
            "ones too, or set fewer states (network.order). Else run the same command again; if "
            "it fails again, it is a defect of slide-fmu: please report it with the recipe"
        )


def _validations(
    fmu: Path, surrogate: Surrogate, job: Job, wanted: Mapping[str, Task], workers: int | None
) -> tuple[dict[str, Validation], list[str]]:
    """Return validations by the names of their tasks, and remarks on failures beyond the range.

    Beyond the range a reference may fail, also on all motions; elsewhere this is an error.
    """
    validations: dict[str, Validation] = {}
    remarks: list[str] = []
    for name, task in wanted.items():
        try:
            validations[name] = validated(fmu, surrogate, job.case, task, job.bar, workers)
        except SimulationError as error:
            if name != BEYOND:
                raise
            remarks.append(f"no trajectory beyond the range could be measured: {error}")
    if BEYOND in validations:
        remarks += remarks_of_beyond(validations[BEYOND])
    return validations, remarks


def _write_finished(
    job: Job, results: StageResults, measurement: RunMeasurement, bare: Path
) -> FinishedRun:
    """Write report, card, pictures and at last the FMU; ``bare`` is the FMU that was measured."""
    recipe, surrogate, folder = job.recipe, measurement.surrogate, job.folder
    versions = results.trained.versions
    figures, response = run_figures(job.case, measurement, job.command, versions)
    untimed = figures.without_times()
    report = run_report(recipe, measurement, untimed, response)
    charts = step_charts(measurement.rows)
    drawn = draw_mechanism(job)
    released = with_origins({**results.origin, "measured": untimed.dump()}, recipe, surrogate)
    described = FmuDescription.of(surrogate, released)
    members = documents(report.html().encode("utf-8"), model_card(described))
    seed = measurement.validations[IN_RANGE].task.seed
    release = Release(surrogate, job.case, released, members, bare, seed=seed)
    whole = write_release(release, bare.parent / "whole" / bare.name)
    report = with_times(report, figures, surrogate)
    page = replace(report, inside=last_section(whole)).write(folder.path)
    timing = figures.in_range.timing
    card = model_card(described, PICTURE if charts else None, drawn, timing)
    if charts:
        write_whole(folder.path / PICTURE, chart_picture(charts))
    write_whole(folder.path / "card.md", card.encode("utf-8"))
    write_whole(folder.path / TIMES, json.dumps(plain(timing), indent=2).encode("utf-8") + b"\n")
    fmu = folder.fmu(recipe)
    write_whole(fmu, whole.read_bytes())
    return FinishedRun(fmu, page, figures, report.verdict.sentences)


def _searched(job: Job, surrogate: Surrogate, in_range: Validation) -> list[Attack]:
    """Search for unnoticed errors, if the recipe asks for it."""
    starts, seed = job.recipe.validation.adversarial, in_range.task.seed
    if not starts:
        return []
    return attack(surrogate, job.case, seed, starts, job.bar("search for unnoticed errors"))


def draw_mechanism(job: Job) -> str | None:
    """Draw the reference system into the run folder, if the recipe names a picture of it.

    Returns:
        File name of the picture on the model card, drawn now or found; None without one.
    """
    place, name = job.folder.path / MECHANISM_PICTURE, job.recipe.system.picture
    if name is not None:
        write_whole(place, load_picture(name)(job.case.reference))
    return MECHANISM_PICTURE if place.exists() else None
