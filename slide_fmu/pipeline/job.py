"""A job is a recipe on its way through the stages; its provenance stays with the result.

Where a recipe leaves lengths open, they are found once, and kept in its run folder.
"""

from __future__ import annotations

import math
import os
import platform
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import metadata
from pathlib import Path
from shlex import quote
from typing import Any

from slide_fmu.core.progress import Stages
from slide_fmu.core.result_cache import ResultFile
from slide_fmu.core.search_path import make_importable
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.model_answers import identity, model_key
from slide_fmu.fmu.export import Provenance
from slide_fmu.memory.lengths import Lengths, find_lengths
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.pipeline.apps import remarks_on_app_tables
from slide_fmu.pipeline.case_checks import check_case, guarded_case
from slide_fmu.pipeline.numbers import known_numbers
from slide_fmu.pipeline.run_folder import RunFolder, TrainedSurrogate
from slide_fmu.recipe.against_system import remarks_on_clipping
from slide_fmu.recipe.automatic import LENGTHS, FoundValues
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.places import RecipeFile
from slide_fmu.recipe.quick import QUICK, REMARK
from slide_fmu.recipe.reading import parse_open_recipe, read_recipe_text
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.your_inputs import with_inputs
from slide_fmu.systems.base import Batching, System
from slide_fmu.validation.validate import origin_of_data

VERSIONS_OF = ("slide-fmu", "numpy", "scipy", "torch")
"""Packages that every training uses."""
SOLVERS = {"exudyn": "exudyn", "fmu": "fmpy"}
"""Packages that simulate systems of some kinds, by kind."""

DECISIVE_FOR_LENGTHS: dict[str, Any] = {
    **dict.fromkeys(("system", "window", "data", "estimator", "parameters"), True),
    "bound": {"estimate_span": True, "expert": {"short_span", "long_span"}},
}
"""Tables and keys of a recipe on which its lengths depend."""

Tell = Callable[[str], None]
"""A function that shows a sentence to people."""


def silent(sentence: str) -> None:
    """Show nothing."""


@dataclass(frozen=True)
class Job:
    """A job is a recipe on its way through the stages.

    Attributes:
        text: the recipe file as it was read.
        case: its recipe, with seeds of the command line, and the systems made from it.
        folder: folder in which its files lie.
        bar: opens the progress of a stage.
        open_keys: keys of the recipe that are still to be found; they hold first guesses.
        resolved: values that were found for what the recipe leaves open, as a table of tables.
        sizing: sizing of the window, if it was found now; else None.
        recipe_folder: folder of the recipe file; None for a recipe that is not a file.
        command: command that makes the surrogate, for people; without paths.
        tell: shows a sentence to people during the job.
        is_checked: whether the recipe was checked with its systems (``checked``).
        quick: whether it is a quick run, whose numbers are at most those of ``QUICK``.
    """

    text: str = field(repr=False)
    case: Case
    folder: RunFolder
    bar: Stages = field(repr=False)
    open_keys: tuple[str, ...] = ()
    resolved: FoundValues = field(default_factory=dict)
    sizing: AnySizing | None = field(default=None, repr=False)
    recipe_folder: Path | None = None
    command: str = "slide-fmu run RECIPE"
    tell: Tell = field(default=silent, repr=False)
    is_checked: bool = False
    quick: bool = False

    @property
    def recipe(self) -> Recipe:
        """The recipe of the case."""
        return self.case.recipe

    @property
    def open_recipe(self) -> OpenRecipe:
        """The recipe with its open keys."""
        return OpenRecipe(self.recipe, self.open_keys)


def open_job(  # noqa: PLR0913 - its options are those of the subcommands
    recipe_path: Path,
    runs: Path,
    bar: Stages,
    training_seed: int | None = None,
    data_seed: int | None = None,
    patience: float | None = math.inf,
    tell: Tell = silent,
    inputs_file: Path | None = None,
    quick: bool = False,
) -> Job:
    """Read a recipe, and find its run folder and its open lengths.

    A file of inputs becomes a kind of its data, as if the recipe named it: so all that is kept
    depends on it, and the FMU names it, too.

    The training seed replaces the seeds of initialisation and order of windows; the data seed
    replaces the seed of the trajectories. The search for lengths ends after the patience, in s;
    with None there is no search, only what an earlier one has kept in the run folder. The job
    shows sentences by ``tell``. A quick run has a folder of its own in the run folder.

    Raises:
        DamagedFileError: a file in the run folder is damaged.
        RecipeError: the recipe cannot be used; or it leaves lengths open that are not kept.
        StageError: its run folder is a file.
        LoadError, ShortWindowError, SimulationError, ValueError: as in ``resolved_lengths``.
    """
    text = read_recipe_text(recipe_path)
    make_importable(recipe_path.parent, Path.cwd())
    seeds = training_seed, data_seed
    if inputs_file is not None:
        path = Path(os.path.relpath(inputs_file, recipe_path.parent)).as_posix()
        text = with_inputs(text, recipe_path, path)
    job = job_of_text(text, recipe_path, runs, bar, seeds, patience, quick=quick)
    command = _command(recipe_path, training_seed, data_seed, inputs_file)
    if quick:
        command += " --quick"
        tell(REMARK)
    for remark in remarks_on_app_tables(job.recipe):
        tell(remark)
    return replace(job, recipe_folder=recipe_path.parent.resolve(), command=command, tell=tell)


def _command(
    recipe: Path, training_seed: int | None, data_seed: int | None, inputs_file: Path | None
) -> str:
    """Return the command that makes the surrogate of a recipe, which may lie in any folder."""
    file = None if inputs_file is None else quote(inputs_file.name)
    options = {"--seed": training_seed, "--data-seed": data_seed, "--inputs": file}
    given = [f"{option} {value}" for option, value in options.items() if value is not None]
    return " ".join(["slide-fmu run", quote(recipe.name), *given])


def job_of_text(
    text: str,
    source: str | Path,
    runs: Path,
    bar: Stages,
    seeds: tuple[int | None, int | None] = (None, None),
    patience: float | None = math.inf,
    given: System | None = None,
    quick: bool = False,
) -> Job:
    """Return the job of a recipe's text, which messages call ``source``, as ``open_job`` does.

    The seeds of training and data are the recipe's where they are None. A recipe about an object
    of this session uses the given system.
    """
    read, (training_seed, data_seed) = (
        parse_open_recipe(text, source, QUICK if quick else {}),
        seeds,
    )
    folder = RunFolder.of(runs, read.guess.name, quick)
    folder.require_folder()
    begun = bar("recipe")
    begun(0, 1)  # a message at once, since finding the lengths may take a minute
    file = RecipeFile(str(source), text if isinstance(source, Path) else "")
    case, sizing = case_of(read.guess, given, file), None
    resolved: FoundValues = {}
    is_open = any(key in LENGTHS for key in read.open_keys)
    if is_open:  # found for the recipe as written, so that other seeds keep the window
        check_case(case)
        if patience is not None:
            resolved, sizing = resolved_lengths(case, read.open_keys, folder.cache, patience)
        else:
            known = kept_lengths(case, read.open_keys, folder.cache).read_json(FoundValues)
            if known is None:
                raise read.refusal()
            resolved = known
        read = read.with_found(resolved, str(source))
    recipe = read.guess
    if training_seed is not None:
        recipe = with_training_seed(recipe, training_seed)
    if data_seed is not None:
        data = recipe.data.model_copy(update={"seed": data_seed})
        recipe, sizing = recipe.model_copy(update={"data": data}), None
    case = case.with_recipe(recipe)
    found = read.open_keys, resolved, sizing
    job = Job(text, case, folder, bar, *found, is_checked=is_open, quick=quick)
    begun(1, 1)
    numbers = known_numbers(case, job.open_keys, folder)
    return job if numbers is None else with_values(job, numbers)


def resolved_lengths(
    case: Case, open_keys: tuple[str, ...], cache: Path, patience: float = math.inf
) -> tuple[FoundValues, AnySizing | None]:
    """Return the open lengths of a recipe, and the sizing of the window if it was done now.

    The open keys of the case's recipe hold first guesses. Lengths are read from the folder
    ``cache`` if they were found there for the same recipe and model; else they are found from the
    system's motions, and kept there. If motions were left out because of the patience, in s, the
    lengths are not kept.
    """
    file = kept_lengths(case, open_keys, cache)
    known = file.read_json(FoundValues)
    if known is not None:
        return known, None
    lengths = lengths_of_case(case.source, case, open_keys, patience)
    if lengths.sizing is None or lengths.sizing.left_out is None:
        file.write_json(lengths.values)
    return lengths.values, lengths.sizing


def kept_lengths(case: Case, open_keys: tuple[str, ...], cache: Path) -> ResultFile:
    """Return the file for the open lengths of a recipe and its model, in the folder ``cache``."""
    recipe = case.recipe
    tables = recipe.model_dump(mode="json", include=DECISIVE_FOR_LENGTHS)
    model = model_key(cache, identity(case.source, recipe))
    return ResultFile.of(cache, "resolved", tables, recipe.total_count, open_keys, model)


@asked_of_sources
def lengths_of_case(
    system: System, case: Case, open_keys: tuple[str, ...], patience: float
) -> Lengths:
    """Find the open lengths of a recipe, in a separate program if its system may crash."""
    return guarded_case(case, _lengths, open_keys, patience)


def _lengths(case: Case, open_keys: tuple[str, ...], patience: float) -> Lengths:
    """Find lengths; with physical parameters, of the corner with the longest memory.

    The eigenvalues alone do not show this corner.
    """
    cases = [case.at_ends(corner) for corner in case.corners()]
    of_corners = [
        find_lengths(OpenRecipe(one.recipe, open_keys), one.system, TimeBudget(patience))
        for one in cases
    ]
    return max(of_corners, key=lambda lengths: lengths.recipe.guess.window.n_in)


def with_values(job: Job, values: FoundValues) -> Job:
    """Return a job with values for open keys of its recipe."""
    complete = job.open_recipe.with_found(values, f"recipe {job.recipe.name!r}")
    tables = {**job.resolved, **values}
    resolved = {name: {**job.resolved.get(name, {}), **values.get(name, {})} for name in tables}
    case = job.case.with_recipe(complete.guess)
    return replace(job, case=case, open_keys=complete.open_keys, resolved=resolved)


def checked(job: Job) -> Job:
    """Return a job whose recipe was checked with its systems; this is done once.

    The job tells which inputs of the training are clipped, and what a model that may simulate many
    motions at once remarks, such as why it does not.
    """
    if not job.is_checked:
        check_case(job.case)
    source = job.case.source
    if isinstance(source, Batching):
        source.most_at_once(tuple(job.recipe.parameters))  # which tries it
    remarks = source.remarks if isinstance(source, Batching) else ()
    for remark in (*remarks_on_clipping(job.recipe, source), *remarks):
        job.tell(f"remark: {remark}")
    return replace(job, is_checked=True)


def with_training_seed(recipe: Recipe, seed: int) -> Recipe:
    """Return the recipe with another seed for initialisation and order of windows."""
    values = recipe.model_dump()
    estimator = values["estimator"] or {}
    pretraining = estimator.get("expert", {}).get("pretraining")
    for table in (values["training"], estimator.get("training"), pretraining):
        if table is not None:
            table["seed"] = seed
    return Recipe.model_validate(values)


def provenance(job: Job, trained: TrainedSurrogate) -> Provenance:
    """Return the provenance of a job's surrogate: recipe, seeds, versions of the training.

    Values of the recipe's open keys are included, so that they need not be found again.
    """
    recipe = job.recipe
    estimator = recipe.estimator
    return {
        "recipe": job.text,
        **({"quick": dict(QUICK)} if job.quick else {}),
        **({"resolved": job.resolved} if job.resolved else {}),
        **origin_of_data(job.case.source),
        **trained.start,
        "seeds": {
            "data": recipe.data.seed,
            "training": recipe.training.seed,
            "estimator_training": None if estimator is None else estimator.training.seed,
        },
        "versions": trained.versions,
    }


def versions(recipe: Recipe) -> dict[str, str]:
    """Return the versions of the packages that made a surrogate, here and now.

    These are the packages of its training, and the one that simulates its system. A class may use
    any of them; exudyn is listed where it was imported.
    """
    kind, packages = recipe.system.kind, list(VERSIONS_OF)
    if kind in SOLVERS:
        packages.append(SOLVERS[kind])
    elif kind in ("class", "object") and "exudyn" in sys.modules:
        packages.append("exudyn")
    installed = {"python": platform.python_version()}
    return {**installed, **{name: metadata.version(name) for name in packages}}
