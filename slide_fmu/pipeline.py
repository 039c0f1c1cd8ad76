"""The stages from a recipe to an FMU with a report, each usable alone."""

from __future__ import annotations

import platform
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from slide_fmu import report as reports
from slide_fmu.card import card
from slide_fmu.data.sampling import recipe_system, reference_system
from slide_fmu.figures import side_by_side, stability_tests
from slide_fmu.fmu.export import export_fmu, read_fmu, read_member
from slide_fmu.fmu.platforms import FmiVersion
from slide_fmu.module_fmu import SUFFIXES, ModuleError, export_module, is_module
from slide_fmu.network_features import require_features
from slide_fmu.recipe import SPLITS, Recipe, parse_recipe, read_recipe_text
from slide_fmu.report import Report
from slide_fmu.response import is_affine
from slide_fmu.run_folder import RunFolder, Trained, recipe_of_provenance
from slide_fmu.sizing import Sizing, require_window, size_window
from slide_fmu.stability import (
    AmplitudeTest,
    check_stability,
    require_stability,
    stability_figures,
)
from slide_fmu.surrogate import Surrogate
from slide_fmu.validation import Task, Validation, validate
from slide_fmu.weights import rounding_loss, with_weights

Advance = Callable[[int, int, str], None]
"""Called with the work done, the work to do, and a remark."""

Bar = Callable[[str], Advance]
"""Opens the progress bar of a named stage."""

VERSIONS_OF = ("slide-fmu", "numpy", "scipy", "fmpy", "torch", "exudyn", "pythonfmu")
IN_RANGE, BEYOND = "in range", "beyond the range"
PICTURE = "side_by_side.png"
STABILITY_PICTURE = "stability.png"
MECHANISM_PICTURE = "mechanism.png"
"""Of the reference system in motion, where it draws itself; of another, who puts it into the run
folder finds it on the card."""


@dataclass(frozen=True)
class Job:
    """A recipe on its way through the stages.

    Attributes:
        text: the recipe file as it was read.
        recipe: what it says, seeds of the command line included.
        folder: where its files lie.
        bar: opens progress bars.
    """

    text: str = field(repr=False)
    recipe: Recipe
    folder: RunFolder
    bar: Bar = field(repr=False)


@dataclass(frozen=True)
class Form:
    """Which FMU of a surrogate is written.

    Attributes:
        fmi: version of the standard.
        sources: with C sources.
        weights: precision of the weights of layers (``with_weights``); as they are if None.
    """

    fmi: FmiVersion = 2
    sources: bool = False
    weights: str | None = None


def open_job(
    recipe_path: Path,
    runs: Path,
    bar: Bar,
    training_seed: int | None = None,
    data_seed: int | None = None,
) -> Job:
    """Read a recipe and find its run folder.

    Args:
        training_seed: replaces the recipe's seeds of initialisation and order of windows.
        data_seed: replaces the recipe's seed of the trajectories.

    Raises:
        RecipeError: the recipe cannot be used.
    """
    text = read_recipe_text(recipe_path)
    recipe = parse_recipe(text, str(recipe_path))
    make_importable(recipe_path.parent)
    if training_seed is not None:
        recipe = with_training_seed(recipe, training_seed)
    if data_seed is not None:
        data = recipe.data.model_copy(update={"seed": data_seed})
        recipe = recipe.model_copy(update={"data": data})
    return Job(text, recipe, RunFolder(runs / recipe.name), bar)


def make_importable(folder: Path) -> None:
    """Let recipes name models that lie beside them, here and in worker processes."""
    place = str(folder.resolve())
    if place not in sys.path:
        sys.path.append(place)


def with_training_seed(recipe: Recipe, seed: int) -> Recipe:
    """The recipe with another seed for initialisation and order of windows."""
    values = recipe.model_dump()
    values["training"]["seed"] = seed
    if values["estimator"] is not None:
        values["estimator"]["training"]["seed"] = seed
        if values["estimator"]["pretraining"] is not None:
            values["estimator"]["pretraining"]["seed"] = seed
    return Recipe.model_validate(values)


def check_recipe(recipe: Recipe) -> None:
    """Refuse what can be found wrong without data, before any are made.

    Raises:
        LoadError: one of the recipe's systems cannot be made.
        RecipeError: they do not fit each other or the excitation, or a network sees what the
            system has not.
    """
    reference_system(recipe)
    require_features(recipe, recipe_system(recipe))


def size_recipe(job: Job, seed: int | None = None) -> Sizing:
    """Decay times of the recipe's system along its motions.

    Args:
        seed: of the motions; the recipe's data seed if None.

    Raises:
        LoadError, RecipeError: as of ``check_recipe``.
    """
    check_recipe(job.recipe)
    return size_window(job.recipe, recipe_system(job.recipe), seed)


def check_window(job: Job) -> Sizing:
    """Check the recipe, compute the decay times; refuse a window that is too short.

    Raises:
        LoadError, RecipeError: as of ``check_recipe``.
        ShortWindowError: the window is too short for the system.
    """
    sizing = size_recipe(job)
    require_window(job.recipe, sizing)
    return sizing


def generate_data(job: Job, workers: int | None, overwrite: bool) -> dict[str, Any]:
    """Make all trajectories that are not in the store yet.

    Returns:
        Numbers of trajectories by split, the simulated time in s, and how many of them were made
        now in which time.

    Raises:
        LoadError, RecipeError: as of ``check_recipe``.
        StoreError: the store was made from other values.
    """
    from slide_fmu.data.generation import generate
    from slide_fmu.data.pool import process_pool
    from slide_fmu.data.store import remove_store

    check_recipe(job.recipe)
    if overwrite:
        remove_store(job.folder.store)
    job.folder.path.mkdir(parents=True, exist_ok=True)
    advance = job.bar("trajectories")
    begin = time.monotonic()
    with process_pool(workers) as pool:
        made = generate(job.recipe, job.folder.store, pool, lambda done, n: advance(done, n, ""))
    counts = {split: job.recipe.count(split) for split in SPLITS}
    simulated = sum(counts.values()) * (job.recipe.data.duration + job.recipe.data.burn_in)
    return {
        "trajectories": counts,
        "simulated_time_s": simulated,
        "made_now": made,
        "wall_time_s": time.monotonic() - begin,
        "seed": job.recipe.data.seed,
    }


def train_surrogate(job: Job, threads: int = 1) -> dict[str, Any]:
    """Train surrogate and error estimator; keep them in the run folder.

    Args:
        threads: of the processor. Networks of this size gain little from a second one, and lose
            much when another program needs it; with one, every machine sums in the same order.

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

    def progress(stage: str) -> Callable[[int, int, float], None]:
        advance = job.bar(stage)

        def tell(done: int, total: int, best: float) -> None:
            advance(done, total, f"validation error {best:.3g}")

        return tell

    fit = fit_surrogate(job.recipe, system, job.folder.store, job.folder.checkpoints, progress)
    job.folder.save_surrogate(fit.surrogate, job.recipe, fit.histories, versions())
    return {
        "validation_error": {n: min(h.validation_error) for n, h in fit.histories.items()},
        "parameters": fit.surrogate.network.count_parameters(),
        "seed": job.recipe.training.seed,
    }


def export_recipe(
    job: Job, path: Path | None, form: Form = Form()
) -> tuple[Path, dict[str, Any] | None]:
    """Write the FMU of a trained recipe.

    An FMU of the same surrogate that ``run`` has finished keeps its report and measured error.

    Args:
        path: the FMU to write; if None, that of the run folder.
        form: which FMU is written.

    Returns:
        The path, and what rounding to float16 changes (``rounding_loss``); None without.

    Raises:
        StageError: nothing was trained.
        ValueError: no such precision.
    """
    trained = job.folder.load_surrogate(job.recipe)
    surrogate, origin = trained.surrogate, provenance(job, trained.versions)
    examine_stability(job, surrogate)
    finished = job.folder.fmu(job.recipe)
    path = path or finished
    if finished.exists():
        other, found = read_fmu(finished)
        same = {key: value for key, value in (found or {}).items() if key in origin} == origin
        if same and other.to_bytes() == surrogate.to_bytes():
            return export_again(finished, path, form)
    return _write_form(surrogate, path, form, provenance=origin)


def export_again(
    source: Path, path: Path, form: Form = Form()
) -> tuple[Path, dict[str, Any] | None]:
    """Write the surrogate of an FMU as FMU of either standard, with this version's runtime.

    Args:
        source: FMU of slide-fmu.
        path: the FMU to write.
        form: which FMU is written.

    Returns:
        As of ``export_recipe``.

    Raises:
        FmuError: the source is no FMU of slide-fmu.
        ValueError: no such precision.
    """
    surrogate, found = read_fmu(source)
    page = read_member(source, "documentation/index.html")
    documentation = {} if page is None else {"index.html": page}
    return _write_form(surrogate, path, form, provenance=found, documentation=documentation)


def _write_form(
    surrogate: Surrogate,
    path: Path,
    form: Form,
    *,
    provenance: dict[str, object] | None,
    documentation: Mapping[str, bytes] | None = None,
) -> tuple[Path, dict[str, Any] | None]:
    """Write a surrogate as FMU of a form; what rounding changes."""
    stored = surrogate if form.weights is None else with_weights(surrogate, form.weights)
    export_fmu(
        stored,
        path,
        fmi=form.fmi,
        provenance=provenance,
        documentation=documentation,
        sources=form.sources,
    )
    return path, rounding_loss(surrogate, stored) if form.weights == "float16" else None


def require_module_export(source: Path, python: bool, form: Form) -> None:
    """Refuse what the python backend cannot make, and torch modules without it.

    Args:
        source: file of a scripted or exported module.
        python: whether an FMU that needs Python was asked for.
        form: which FMU was asked for.

    Raises:
        ModuleError: with what was asked for, and the remedy.
    """
    if not is_module(source):
        raise ModuleError(
            f"{source}: the python backend takes a torch module, {' or '.join(SUFFIXES)}; the "
            "native one runs what slide-fmu trains: leave out --backend python"
        )
    if not python:
        raise ModuleError(
            f"{source} is a torch module; the native runtime runs exactly what slide-fmu trains, "
            "and nothing else: add --backend python for an FMU that needs Python where it runs"
        )
    if form != Form():
        raise ModuleError(
            f"{source}: the python backend writes the module as it is, as FMI 2.0; leave out "
            "--fmi 3, --source and --weights, which are for native FMUs"
        )


def export_torch(source: Path, description: Path | None, path: Path | None) -> Path:
    """Write a torch module as FMU that needs Python where it runs.

    Args:
        source: file of a scripted or exported module.
        description: TOML file about the module.
        path: the FMU to write.

    Raises:
        ModuleError: an argument is missing, or the module or its description cannot be used.
    """
    if description is None or path is None:
        raise ModuleError(
            f"{source}: what are its signals, and where to? give --description signals.toml and "
            "-o PATH"
        )
    return export_module(source, description, path)


def validate_fmu_file(fmu: Path, task: Task, bar: Bar) -> Validation:
    """Run an FMU beside the reference system that its provenance names.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        CoSimulationError: an FMU reports an error.
    """
    surrogate, found = read_fmu(fmu)
    recipe = recipe_of_provenance(found, str(fmu))
    advance = bar(_title(task))
    return validate(
        fmu, surrogate, recipe, task, lambda done, n: advance(done, n, ""), workers=None
    )


def validation_report(validation: Validation) -> Report:
    """The report of one validation."""
    name = _title(validation.task)
    return Report(
        f"Validation of {validation.surrogate.name}",
        validation.recipe.description,
        validation.figures(),
        reports.validation_sections({name: validation}),
    )


def examine_stability(job: Job, surrogate: Surrogate) -> tuple[AmplitudeTest, ...]:
    """Test a state-space surrogate beyond its amplitude; the picture of a failure is kept.

    Raises:
        UnstableSurrogateError: it failed, and the recipe does not allow that.
    """
    tests = check_stability(surrogate, job.recipe, recipe_system(job.recipe))
    picture = job.folder.path / STABILITY_PICTURE
    picture.unlink(missing_ok=True)
    if any(test.problem is not None for test in tests):
        picture.write_bytes(stability_tests(tests, surrogate.window.step))
    require_stability(tests, job.recipe, str(picture))
    return tests


def finish(
    job: Job, sizing: Sizing, seed: int, trajectories: int | None = None
) -> tuple[Path, Path]:
    """Export, validate, and write the FMU that carries its report and its measured error.

    Args:
        seed: of the unseen trajectories.
        trajectories: their number; the recipe's if None.

    Returns:
        Paths of the FMU and of the report.
    """
    recipe, fmu = job.recipe, job.folder.fmu(job.recipe)
    trained = job.folder.load_surrogate(recipe)
    surrogate, origin = trained.surrogate, provenance(job, trained.versions)
    tests = examine_stability(job, surrogate)
    export_fmu(surrogate, fmu, provenance=origin)
    validations = {
        name: validate_fmu_file(fmu, task, job.bar)
        for name, task in tasks(recipe, seed, trajectories).items()
    }
    report = _full_report(trained, recipe, sizing, validations, tests)
    page = report.write(job.folder.path)
    (job.folder.path / PICTURE).write_bytes(side_by_side(validations[IN_RANGE], 0))
    text = card(surrogate, recipe, report.data, PICTURE, draw_mechanism(job))
    (job.folder.path / "card.md").write_text(text, encoding="utf-8")
    released = {**origin, "measured": report.data}
    export_fmu(
        surrogate, fmu, provenance=released, documentation={"index.html": page.read_bytes()}
    )
    return fmu, page


def draw_mechanism(job: Job) -> str | None:
    """Draw the reference system into the run folder, if it draws itself.

    Returns:
        File name of the picture on the card: this one, or one that was there; None without.

    Raises:
        SimulationError: the motion that is drawn could not be simulated.
    """
    place, picture = job.folder.path / MECHANISM_PICTURE, reference_system(job.recipe).picture()
    if picture is not None:
        place.write_bytes(picture)
    return MECHANISM_PICTURE if place.exists() else None


def tasks(recipe: Recipe, seed: int, trajectories: int | None = None) -> dict[str, Task]:
    """What a released FMU is measured on: in range, and where its estimator was trained too."""
    found = {IN_RANGE: Task(seed, trajectories)}
    if recipe.estimator is not None:
        found[BEYOND] = Task(seed + 1, trajectories, recipe.estimator.amplitude_factor)
    return found


def provenance(job: Job, versions: dict[str, str]) -> dict[str, object]:
    """Where the surrogate of a job comes from: recipe, seeds, versions of the training."""
    recipe = job.recipe
    estimator = recipe.estimator
    return {
        "recipe": job.text,
        "seeds": {
            "data": recipe.data.seed,
            "training": recipe.training.seed,
            "estimator_training": None if estimator is None else estimator.training.seed,
        },
        "versions": versions,
    }


def _full_report(
    trained: Trained,
    recipe: Recipe,
    sizing: Sizing,
    validations: dict[str, Validation],
    tests: tuple[AmplitudeTest, ...],
) -> Report:
    surrogate = trained.surrogate
    data: dict[str, Any] = {
        "name": recipe.name,
        "versions": trained.versions,
        "validation": {name: v.figures() for name, v in validations.items()},
        "window": sizing.figures(),
        "parameters": surrogate.network.count_parameters(),
    }
    sections = reports.validation_sections(validations)
    if is_affine(surrogate):
        section, data["response_matrix"] = reports.response_section(
            surrogate, recipe_system(recipe)
        )
        sections.append(section)
    if tests:
        data["stability"] = stability_figures(tests)
        sections.append(reports.stability_section(tests, surrogate.window.step))
    sections += [reports.sizing_section(sizing), reports.training_section(trained.histories)]
    return Report(f"{recipe.name}: surrogate FMU", recipe.description, data, sections)


def _title(task: Task) -> str:
    low, high = task.amplitude
    return "validation" if low == high == 1 else f"validation at {low:g} to {high:g} x amplitude"


def versions() -> dict[str, str]:
    """Versions of the packages that a surrogate depends on, here and now."""
    found = {"python": platform.python_version()}
    for name in VERSIONS_OF:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found
