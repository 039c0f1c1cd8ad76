"""This module measures a released FMU against its reference system."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from slide_fmu.core.progress import Stages
from slide_fmu.core.search_path import find_file, make_models_importable
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import Provenance, read_fmu
from slide_fmu.pipeline.apps import check_origins
from slide_fmu.pipeline.run_folder import StageError, recipe_of_provenance
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.accuracy_sections import time_sections, validation_sections
from slide_fmu.report.html_report import Report, Verdict
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.verdict import verdict, verdict_facts
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.measure import rows_of
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE, Task
from slide_fmu.validation.validate import require_same_origin, validate


def validate_fmu_file(
    fmu: Path, case: Case, task: Task, bar: Stages, workers: int | None = None
) -> Validation:
    """Compare an FMU of a user with its reference system (``released_case``).

    Arguments and errors are as in ``validated``.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        StageError: its records have changed since, or it is found under the name of its own
            reference.
        ValueError: an app cannot use its part of the FMU's provenance.
    """
    surrogate, provenance = read_fmu(fmu)
    check_origins(surrogate, provenance)  # the report shows it
    require_another(fmu, case.recipe)
    require_same_origin(case.source, dict(provenance or {}), str(fmu))
    return validated(fmu, surrogate, case, task, bar, workers)


def released_case(fmu: Path, system: System | None = None) -> Case:
    """Return the case of the recipe that an FMU of a user carries.

    Its models are looked for near the FMU. If it was learnt from an object of a Python session,
    this object is the system.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        StageError: it carries no recipe, or an object is given that is not the one it needs.
    """
    make_models_importable(fmu)
    surrogate, provenance = read_fmu(fmu)
    recipe = recipe_of_provenance(provenance, str(fmu))
    if system is not None:
        _require_object(surrogate, recipe, system, fmu)
    return case_of(recipe, system)


def _require_object(surrogate: Surrogate, recipe: Recipe, system: System, fmu: Path) -> None:
    """Refuse an object in the place of a reference system that it cannot be."""
    if recipe.system.kind != "object":
        raise StageError(
            f"{fmu}: system = {system!r} was given, but its recipe names its model, "
            f"{recipe.system.model!r}; expected no system: leave it out"
        )
    if not isinstance(system, System):
        raise StageError(
            f"system = {system!r}; expected a System, the object from which {fmu} was made"
        )
    wanted, given = (
        [(s.name, s.unit, s.hold) for s in (*one.inputs, *one.outputs)]
        for one in (surrogate, system)
    )
    if wanted != given:
        raise StageError(
            f"system has the signals {given} (name, unit, hold); expected those of {fmu}, "
            f"{wanted}: give the object from which it was made"
        )


def validated(
    fmu: Path,
    surrogate: Surrogate,
    case: Case,
    task: Task,
    bar: Stages,
    workers: int | None = None,
) -> Validation:
    """Compare the FMU of a surrogate with the reference system of the case that it was made from.

    ``workers`` is the number of processes: one per core if None, no processes if 0.

    Raises:
        CoSimulationError: an FMU reports an error.
        SimulationError: the reference cannot be simulated on drawn motions; the message begins
            with the name of the validation.
    """
    progress = bar(_title(task))
    try:
        return validate(fmu, surrogate, case, task, progress, workers)
    except SimulationError as error:
        raise SimulationError(f"{_title(task)}: {error}", error.time) from error


def require_another(fmu: Path, recipe: Recipe) -> None:
    """Refuse to measure an FMU against itself: its error would be zero."""
    name = recipe.system.model
    with suppress(FileNotFoundError):
        if name.endswith(".fmu") and find_file(name).samefile(fmu):
            raise StageError(
                f"{str(fmu)!r}: its recipe names the reference {name!r}, and this path leads to "
                "the same file; expected the FMU of the model: run in the folder of that FMU"
            )


def usual_level(provenance: Provenance | None) -> FloatArray | None:
    """Return the usual level of the errors when an FMU was released; None if it is not known."""
    measured = released_figures(provenance)
    if measured is None or IN_RANGE not in measured.validation:
        return None
    return np.array([output.usual_level for output in measured.validation[IN_RANGE].outputs])


def group_of(task: Task) -> str:
    """Return the name of the group of inputs that a task draws."""
    if task.held_out:
        return HELD_OUT
    return IN_RANGE if task.amplitude == (1.0, 1.0) else BEYOND


def validation_report(
    validation: Validation, fmu: Path, case: Case, bar: Stages
) -> tuple[Report, ValidationFigures]:
    """Return the report of one validation, and its figures with all rows.

    In range, inputs of further kinds are measured too. Errors count as harmful relative to the
    usual level that the FMU carries; if it has none, to that of this validation in range.

    Args:
        validation: the validation.
        fmu: the FMU that was validated.
        case: the case by which it was.
        bar: opens the progress of a stage.
    """
    usual = usual_level(read_fmu(fmu)[1])
    if usual is None and validation.in_range:
        usual = validation.usual_error()
    group = group_of(validation.task)
    rows = rows_of(fmu, {group: validation}, case, usual, bar)
    figures = replace(validation.figures(), rows=rows)
    assert figures.timing is not None
    sections = [
        *validation_sections({_title(validation.task): validation}, rows),
        *time_sections(figures.timing),
    ]
    described = SurrogateDescription.of(validation.surrogate)
    facts = verdict_facts(rows, figures.timing, described.memory_s)
    report = Report(
        f"Validation of {validation.surrogate.name}",
        validation.recipe.description,
        figures,
        sections,
        verdict=Verdict(verdict(rows), facts),
    )
    return report, figures


def tasks(recipe: Recipe, seed: int, trajectories: int | None = None) -> dict[str, Task]:
    """Return the tasks on which a released FMU is measured.

    They are in range; beyond, if the FMU estimates its error and the recipe asks for inputs there;
    and kinds of excitation that the recipe holds out.

    An error estimator has its own range of amplitudes; with an error bound alone, it is the range
    of the trajectories beyond. The reference of records is unknown beyond them.
    """
    wanted = {IN_RANGE: Task(seed, trajectories)}
    tells = recipe.estimator is not None or recipe.bound is not None
    driven = bool(recipe.data.excitation)  # records are not
    if driven and recipe.estimator is not None and recipe.estimator.beyond:
        wanted[BEYOND] = Task(seed + 1, trajectories, recipe.estimator.expert.amplitude_factor)
    elif tells and recipe.data.beyond:
        wanted[BEYOND] = Task(seed + 1, trajectories, recipe.data.beyond_factor)
    if recipe.validation.excitation:
        wanted[HELD_OUT] = Task(seed + 2, trajectories, held_out=True)
    return wanted


def remarks_of_beyond(beyond: Validation) -> list[str]:
    """Say on how many trajectories of a validation beyond the range the reference failed."""
    if not beyond.left_out:
        return []
    count = len(beyond.left_out) + len(beyond.comparisons)
    return [
        f"{len(beyond.left_out)} of {count} trajectories beyond the range could not be simulated, "
        "so the figures there are those of the others; the first failed so: "
        f"{beyond.left_out[0]}"
    ]


def _title(task: Task) -> str:
    if task.held_out:
        return f"validation on {HELD_OUT}"
    low, high = task.amplitude
    return "validation" if low == high == 1 else f"validation at {low:g} to {high:g} x amplitude"


def report_folder(task: Task) -> str:
    """Name the folder for the report of a task; tasks of other inputs have other folders."""
    if task.held_out:
        return "validation_held_out"
    low, high = task.amplitude
    return "validation" if low == high == 1 else f"validation_at_{low:g}_to_{high:g}"
