"""These functions are subcommands for users of Python: learn, run a recipe, export, validate."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slide_fmu.cli.script_guard import simulating_processes
from slide_fmu.core.extras import require_training
from slide_fmu.core.figures import plain
from slide_fmu.core.measures import percent
from slide_fmu.core.progress import Stages, quiet_stages
from slide_fmu.fmu.export import export_fmu, load
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.importer.errors import FmuError
from slide_fmu.pipeline.export import export_again
from slide_fmu.recipe.writing import tables_text
from slide_fmu.report.progress_display import messages, progress_on
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation.task import UNSEEN_SEED

if TYPE_CHECKING:  # it needs the packages of the training
    from slide_fmu.pipeline.job import Job, Tell


@dataclass(frozen=True, eq=False)
class RunResult:
    """A RunResult is what comes of ``learn`` or ``run``.

    Attributes:
        surrogate: the trained surrogate, with its error estimator if the recipe has one.
        fmu: path of the FMU, which carries the report.
        report: path of the report, a page of HTML.
        measured: the figures of the report.
    """

    surrogate: Surrogate = field(repr=False)
    fmu: Path
    report: Path
    measured: RunFigures = field(repr=False)

    @property
    def figures(self) -> Any:
        """Return the figures of the report as plain values, as ``report.json`` holds them."""
        return self.measured.dump()

    @property
    def errors(self) -> dict[str, float]:
        """Return the relative RMSE on unseen trajectories in range, by output."""
        outputs = self.measured.validation["in range"].outputs
        return {output.name: output.relative_rmse for output in outputs}

    def export(self, path: str | Path, fmi: FmiVersion = 2, sources: Sources = False) -> Path:
        """Write the FMU with its report to another path, for a version of FMI, or with C sources.

        Raises:
            ValueError: the path does not end in ``.fmu``.
        """
        return export_again(self.fmu, Path(path), fmi, sources)

    def _repr_html_(self) -> str:
        """Show the errors in a notebook."""
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{percent(error)}</td></tr>"
            for name, error in self.errors.items()
        )
        return f"<table><tr><th>output</th><th>relative RMSE</th></tr>{rows}</table>"


def run(  # noqa: PLR0913 - its options are the keywords that users read
    recipe: str | Path,
    *,
    runs: str | Path = "runs",
    seed: int | None = None,
    data_seed: int | None = None,
    trajectories: int | None = None,
    workers: int | None = None,
    threads: int = 1,
    inputs: str | Path | None = None,
    quick: bool = False,
) -> RunResult:
    """Do all stages of a recipe file, as ``slide-fmu run`` does.

    Results of an earlier call are used again. Progress is shown on standard error.

    Args:
        recipe: path of the recipe, a TOML file.
        runs: folder that contains the run folder.
        seed: seed of the training; the recipe's if None.
        data_seed: seed of the data; the recipe's if None.
        trajectories: number of unseen trajectories to measure the FMU on; the recipe's if None.
        workers: processes that simulate, as for ``learn``.
        threads: threads of the training.
        inputs: file of your own inputs, whose second half judges the FMU; None for the recipe's.
        quick: whether it shall take about a minute of computing, with larger errors and wider
            bounds; the FMU comes into the folder ``quick`` of the run folder.

    Returns:
        The surrogate, with its FMU, report and measured error.

    Raises:
        RecipeError: the recipe cannot be read or used; one line per mistake.
        QualityError: an output has a larger error than the recipe allows; FMU and report exist.
        ModuleNotFoundError: the extra ``train`` is not installed.
        LoadError: the system cannot be loaded. Further errors are as for
            ``slide_fmu.pipeline.run.run_recipe``: ShortWindowError, SimulationError,
            TrainingError, UnstableSurrogateError.
    """
    require_training()
    from slide_fmu.pipeline.job import open_job

    def opened(bar: Stages, tell: Tell) -> Job:
        file = None if inputs is None else Path(inputs)
        seeds, place = (seed, data_seed), Path(recipe)
        return open_job(place, Path(runs), bar, *seeds, tell=tell, inputs_file=file, quick=quick)

    processes = simulating_processes({}, workers, "run")
    return whole_way(opened, processes, threads, trajectories)


def whole_way(
    opened: Callable[[Stages, Tell], Job],
    processes: tuple[int | None, str | None],
    threads: int,
    trajectories: int | None = None,
) -> RunResult:
    """Go the whole way with a job; progress and remarks are shown on standard error.

    Args:
        opened: opens the job, with what shows the progress of stages and what says a sentence.
        processes: how many simulate, and what to say about that (``simulating_processes``).
        threads, trajectories: as of ``run``.

    Raises:
        QualityError: an output has a larger error than the recipe allows; FMU and report exist.
    """
    from slide_fmu.pipeline.run import run_recipe
    from slide_fmu.report.quality import require_quality

    console, (workers, remark) = messages(), processes
    if remark is not None:
        console.print(f"remark: {remark}")
    with progress_on(console) as bar:
        job = opened(bar, console.print)
        done = run_recipe(job, UNSEEN_SEED, trajectories, workers, threads)
    require_quality(job.recipe, done.figures)
    return RunResult(load(done.fmu), done.fmu, done.page, done.figures)


def export(
    source: Surrogate | str | Path, path: str | Path, *, fmi: FmiVersion = 2, sources: bool = False
) -> Path:
    """Write a surrogate, or an FMU of slide-fmu again, as an FMU for a version of FMI.

    An FMU that is written again keeps its report, its credentials and its provenance. A bare
    surrogate has none of these (``export_fmu`` takes them as arguments).

    Args:
        source: a surrogate, or the path of an FMU or of a surrogate file (``.slide``).
        path: the FMU to write, ending in ``.fmu``.
        fmi: version of the standard, 2 or 3.
        sources: whether to write C sources too, for FMI 2.0 only.

    Returns:
        The path of the FMU.

    Raises:
        FmuError: the source is neither a surrogate nor an FMU of slide-fmu.
        ValueError: the path does not end in ``.fmu``.
    """
    if isinstance(source, Surrogate):
        return export_fmu(source, Path(path), fmi=fmi, sources=sources)
    if not isinstance(source, str | Path):
        raise FmuError(f"{source!r}; expected a surrogate, or the path of an FMU of slide-fmu")
    if Path(source).suffix == ".slide":
        return export_fmu(load(source), Path(path), fmi=fmi, sources=sources)
    return export_again(Path(source), Path(path), fmi, sources)


def validate(
    fmu: str | Path,
    *,
    seed: int = UNSEEN_SEED,
    trajectories: int | None = None,
    duration: float | None = None,
    amplitude: tuple[float, float] = (1.0, 1.0),
    held_out: bool = False,
    workers: int | None = None,
    system: System | None = None,
) -> dict[str, Any]:
    """Compare an FMU with its reference system on unseen inputs, as ``slide-fmu validate`` does.

    Args:
        fmu: path of an FMU that carries its recipe.
        seed: seed of the trajectories.
        trajectories: their number; the recipe's if None.
        duration: length of each in s; the recipe's if None.
        amplitude: range of the factor on the excitation.
        held_out: whether to draw the kinds of excitation that the recipe holds out.
        workers: processes that simulate, as for ``learn``.
        system: the object given to ``learn``, for an FMU that was trained on one.

    Returns:
        The figures of ``slide-fmu validate --json``; ``"outputs"`` has the name, the unit, the
        RMSE and the relative RMSE of each.

    Raises:
        FmuError: the file is not an FMU of slide-fmu.
        StageError: it carries no recipe, or its records have changed since.
        CoSimulationError: an FMU reports an error.
        ValueError: a number is not valid.
    """
    from slide_fmu.pipeline.measurement import released_case, validate_fmu_file
    from slide_fmu.validation.task import Task

    processes, _ = simulating_processes(system or {}, workers, "validate")
    task = Task(seed, trajectories, amplitude, duration, held_out)
    case = released_case(Path(fmu), system)
    validation = validate_fmu_file(Path(fmu), case, task, quiet_stages, processes)
    return dict(plain(validation.figures()))


def learn(
    system: System | Mapping[str, Any],
    name: str,
    *,
    runs: str | Path = "runs",
    workers: int | None = None,
    threads: int = 1,
    **tables: Any,
) -> RunResult:
    """Learn a surrogate of a reference system and measure it, as ``slide-fmu run`` does.

    Results of an earlier call with the same values are used again. Progress is shown on standard
    error.

    Args:
        system: any reference system, with its signals and step; or the recipe's table ``system``
            as a dictionary, for example ``{"kind": "fmu", "model": "pump.fmu"}``.
        name: name of the FMU and of the run folder, a C identifier.
        runs: folder that contains the run folder.
        workers: processes that simulate. If None, one per core, provided the system can be sent to
            other processes and these do not run the call again; otherwise, or if 0, only this
            process. In a script, the call must be under ``if __name__ == "__main__":`` for several
            processes.
        threads: threads of the training.
        tables: the other tables of a recipe as dictionaries, such as ``data={"train": 40}`` and
            ``window={"n_in": 300}``; missing keys have the recipe's defaults.

    Returns:
        The surrogate, with its FMU, report and measured error.

    Raises:
        RecipeError: the system is neither of the two, or a table is not valid in a recipe; one
            line per mistake.
        QualityError: an output has a larger error than the recipe allows; FMU and report exist.
        ValueError: workers were requested, but would run the user's script again.
        ModuleNotFoundError: the extra ``train`` is not installed.
        LoadError: the system cannot be loaded. Further errors are as for
            ``slide_fmu.pipeline.run.run_recipe``: ShortWindowError, SimulationError,
            TrainingError, UnstableSurrogateError.
    """
    require_training()
    from slide_fmu.core.search_path import make_importable
    from slide_fmu.pipeline.job import job_of_text
    from slide_fmu.propose.object_recipe import recipe_tables

    text = tables_text(recipe_tables(system, name, tables))
    make_importable(Path.cwd())

    def opened(bar: Stages, tell: Tell) -> Job:
        own = system if isinstance(system, System) else None
        job = job_of_text(text, f"slide.learn of {name!r}", Path(runs), bar, given=own)
        return replace(job, command=f"slide.learn(system, {name!r})", tell=tell)

    return whole_way(opened, simulating_processes(system, workers), threads)
