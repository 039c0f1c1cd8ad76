"""Subcommands as functions, for those who work in Python: run a recipe, export, validate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.core.extras import require_training
from slide_fmu.core.progress import quiet_stages
from slide_fmu.fmu.export import FmuError, export_fmu, load
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.pipeline.defaults import UNSEEN_SEED
from slide_fmu.pipeline.display import messages, shown
from slide_fmu.pipeline.export import export_again
from slide_fmu.pipeline.learning import Learnt, simulating_processes
from slide_fmu.surrogate.surrogate import Surrogate


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
) -> Learnt:
    """Go the whole way with a recipe file, as ``slide-fmu run`` does.

    What is there from an earlier call is not made again. Progress is shown on standard error.

    Args:
        recipe: path of the recipe, a TOML file.
        runs: folder that holds the folder of the run.
        seed: seed of the training; the recipe's if None.
        data_seed: seed of the data; the recipe's if None.
        trajectories: number of unseen trajectories that the FMU is measured on; the recipe's if
            None.
        workers: processes that simulate, as of ``learn``.
        threads: threads of the training.
        overwrite: whether data that were made from other values are made again.

    Returns:
        The surrogate, with its FMU, report and measured error.

    Raises:
        RecipeError: the recipe cannot be read or used; there is one line per mistake.
        QualityError: an output errs by more than the recipe requires; FMU and report are there.
        ModuleNotFoundError: the extra ``train`` is not installed.
        LoadError: the system cannot be loaded. So are the other errors those of
            ``slide_fmu.pipeline.run.run_recipe``: ShortWindowError, SimulationError, StoreError,
            TrainingError, UnstableSurrogateError.
    """
    require_training()
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.quality import require_quality
    from slide_fmu.pipeline.run import run_recipe

    console = messages()
    processes, remark = simulating_processes({}, workers, "run")
    if remark is not None:
        console.print(f"remark: {remark}")
    with shown(console) as bar:
        job = open_job(Path(recipe), Path(runs), bar, seed, data_seed, tell=console.print)
        done = run_recipe(job, UNSEEN_SEED, trajectories, processes, threads, overwrite)
    require_quality(job.recipe, done.figures)
    return Learnt(load(done.fmu), done.fmu, done.page, done.figures)


def export(
    source: Surrogate | str | Path, path: str | Path, *, fmi: FmiVersion = 2, sources: bool = False
) -> Path:
    """Write a surrogate, or an FMU of slide-fmu again, as FMU of a version of FMI.

    An FMU that is written again keeps its report, its credentials and where it comes from; a bare
    surrogate has none of them (``export_fmu`` takes them).

    Args:
        source: a surrogate, or the path of an FMU or of a surrogate file (``.slide``).
        path: the FMU to write; it ends in ``.fmu``.
        fmi: version of the standard, 2 or 3.
        sources: whether C sources are written too, of FMI 2.0 only.

    Returns:
        The path of the FMU.

    Raises:
        FmuError: the source is no surrogate, and no FMU of slide-fmu.
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
) -> dict[str, Any]:
    """Run an FMU beside its reference system on unseen inputs, as ``slide-fmu validate`` does.

    Args:
        fmu: path of an FMU that carries its recipe.
        seed: seed of the trajectories.
        trajectories: their number; the recipe's if None.
        duration: length of each in s; the recipe's if None.
        amplitude: range of the factor on the excitation.
        held_out: whether the kinds of excitation are drawn that the recipe holds out.
        workers: processes that simulate, as of ``learn``.

    Returns:
        The figures that ``slide-fmu validate --json`` writes: among them ``"outputs"`` with the
        name, the unit, the RMSE and the relative RMSE of each.

    Raises:
        FmuError: the file is no FMU of slide-fmu.
        StageError: it carries no recipe, or its records have changed since.
        CoSimulationError: an FMU reports an error.
        ValueError: a number makes no sense.
    """
    from slide_fmu.pipeline.measurement import validate_fmu_file
    from slide_fmu.validation.comparison import Task

    processes, _ = simulating_processes({}, workers, "validate")
    task = Task(seed, trajectories, amplitude, duration, held_out)
    return validate_fmu_file(Path(fmu), task, quiet_stages, processes).figures()
