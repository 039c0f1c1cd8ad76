"""These functions are the subcommands for users of Python: run a recipe, export, validate."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slide_fmu.cli.script_guard import simulating_processes
from slide_fmu.core.extras import require_training
from slide_fmu.core.figures import plain
from slide_fmu.core.measures import percent
from slide_fmu.core.progress import Stages, quiet_stages
from slide_fmu.fmu.export import FmuError, export_fmu, load
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.pipeline.export import export_again
from slide_fmu.report.display import messages, shown
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
        found = self.measured.validation["in range"].outputs
        return {output.name: output.relative_rmse for output in found}

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


def run(
    recipe: str | Path,
    *,
    runs: str | Path = "runs",
    seed: int | None = None,
    data_seed: int | None = None,
    trajectories: int | None = None,
    workers: int | None = None,
    threads: int = 1,
    overwrite: bool = False,
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
        overwrite: whether data that were made from other values are made again.

    Returns:
        The surrogate, with its FMU, report and measured error.

    Raises:
        RecipeError: the recipe cannot be read or used; one line per mistake.
        QualityError: an output has a larger error than the recipe allows; FMU and report exist.
        ModuleNotFoundError: the extra ``train`` is not installed.
        LoadError: the system cannot be loaded. Further errors are as for
            ``slide_fmu.pipeline.run.run_recipe``: ShortWindowError, SimulationError, StoreError,
            TrainingError, UnstableSurrogateError.
    """
    require_training()
    from slide_fmu.pipeline.job import open_job

    def opened(bar: Stages, tell: Tell) -> Job:
        return open_job(Path(recipe), Path(runs), bar, seed, data_seed, tell=tell)

    processes = simulating_processes({}, workers, "run")
    return whole_way(opened, processes, threads, overwrite, trajectories)


def whole_way(
    opened: Callable[[Stages, Tell], Job],
    processes: tuple[int | None, str | None],
    threads: int,
    overwrite: bool,
    trajectories: int | None = None,
) -> RunResult:
    """Go the whole way with a job; progress and remarks are shown on standard error.

    Args:
        opened: opens the job, with what shows the progress of stages and what says a sentence.
        processes: how many simulate, and what to say about that (``simulating_processes``).
        threads, overwrite, trajectories: as of ``run``.

    Raises:
        QualityError: an output has a larger error than the recipe allows; FMU and report exist.
    """
    from slide_fmu.pipeline.run import run_recipe
    from slide_fmu.report.quality import require_quality

    console, (workers, remark) = messages(), processes
    if remark is not None:
        console.print(f"remark: {remark}")
    with shown(console) as bar:
        job = opened(bar, console.print)
        done = run_recipe(job, UNSEEN_SEED, trajectories, workers, threads, overwrite)
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
    found = validate_fmu_file(Path(fmu), case, task, quiet_stages, processes)
    return dict(plain(found.figures()))
