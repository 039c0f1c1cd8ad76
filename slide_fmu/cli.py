"""The console script ``slide-fmu``: verbs only, no logic."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from slide_fmu import pipeline
from slide_fmu.bench import SYNTHETIC, Effort, bench_fmu, bench_synthetic
from slide_fmu.fmu.check import check_fmu
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.platforms import checked_version
from slide_fmu.module_fmu import is_module, module_figures
from slide_fmu.recipe import load_recipe
from slide_fmu.side_by_side import write_reference, write_side_by_side
from slide_fmu.sizing import decay_rows, require_window
from slide_fmu.surrogate import Surrogate
from slide_fmu.validation import Task


class Backend(StrEnum):
    """What runs the network in an FMU."""

    native = "native"
    python = "python"


TRACEBACK = "SLIDE_FMU_TRACEBACK"
"""Environment variable: if set, errors show where they come from."""

app = typer.Typer(
    name="slide-fmu",
    help="Fast, trustworthy stand-ins for slow multibody models, as FMUs that load anywhere.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)
console = Console(stderr=True)

RecipeArgument = Annotated[Path, typer.Argument(help="Recipe, for example training/duffing.toml.")]
FmuArgument = Annotated[Path, typer.Argument(help="FMU made by slide-fmu.")]


def _writable(path: str | None) -> str | None:
    """Refuse a place for figures before the work begins that they come from."""
    if path is not None and path != "-":
        folder = Path(path).absolute().parent
        if Path(path).is_dir() or not os.access(folder, os.W_OK):
            raise typer.BadParameter(f"{path}: expected a file in a folder that can be written to")
    return path


JsonOption = Annotated[
    str | None,
    typer.Option(
        "--json",
        metavar="PATH",
        help="Write the figures here; - is stdout.",
        callback=_writable,
    ),
]
RunsOption = Annotated[Path, typer.Option("--runs", help="Folder that holds the work.")]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", min=1, help="Processes; one per core if not given.")
]
ThreadsOption = Annotated[int, typer.Option("--threads", min=1, help="Threads of the training.")]
TrajectoriesOption = Annotated[
    int | None, typer.Option(min=1, help="Unseen trajectories; the recipe's if not given.")
]
TrainingSeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed", min=0, max=2**31 - 1, help="Seed of the training; the recipe's if not given."
    ),
]
DataSeedOption = Annotated[
    int | None,
    typer.Option("--data-seed", min=0, help="Seed of the data; the recipe's if not given."),
]
OverwriteOption = Annotated[
    bool, typer.Option("--overwrite", help="Generate again data made from other values.")
]
UNSEEN_SEED = 20_260_000
"""Default seed of validation trajectories; their stream of seeds is used for nothing else."""


@app.command()
def run(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    trajectories: TrajectoriesOption = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    threads: ThreadsOption = 1,
    overwrite: OverwriteOption = False,
) -> None:
    """Everything: window, data, training, FMU, validation, report."""
    with progress_bars() as bar:
        job = pipeline.open_job(recipe, runs, bar, seed, data_seed)
        sizing = pipeline.check_window(job)
        pipeline.generate_data(job, workers, overwrite)
        pipeline.train_surrogate(job, threads)
        fmu, page = pipeline.finish(job, sizing, UNSEEN_SEED, trajectories)
    figures = json.loads((page.parent / "report.json").read_text(encoding="utf-8"))
    for name, validation in figures["validation"].items():
        _show_validation(validation, name)
    _write_json(json_path, figures)
    console.print(f"FMU     {fmu}\nreport  {page}", highlight=False)


@app.command()
def window(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the motions.")] = None,
    runs: RunsOption = Path("runs"),
) -> None:
    """Decay times of the system, linearized and measured, and the window they ask for."""
    with progress_bars() as bar:
        job = pipeline.open_job(recipe, runs, bar)
        sizing = pipeline.size_recipe(job, seed)
    figures = sizing.figures()
    headings, *rows = decay_rows(figures)
    table = Table(*headings)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    if sizing.remark is not None:
        console.print(f"remark: {sizing.remark}", style="yellow", highlight=False, markup=False)
    _write_json(json_path, figures)
    with _errors():
        require_window(job.recipe, sizing)


@app.command()
def generate(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the data.")] = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Make the recipe's trajectories; goes on where it was stopped."""
    with progress_bars() as bar:
        job = pipeline.open_job(recipe, runs, bar, data_seed=seed)
        pipeline.check_window(job)
        figures = pipeline.generate_data(job, workers, overwrite)
        _write_json(json_path, figures)
    console.print(f"data    {job.folder.store}", highlight=False)


@app.command()
def train(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    runs: RunsOption = Path("runs"),
    threads: ThreadsOption = 1,
) -> None:
    """Train surrogate and error estimator; goes on where it was stopped."""
    with progress_bars() as bar:
        job = pipeline.open_job(recipe, runs, bar, seed, data_seed)
        pipeline.check_window(job)
        figures = pipeline.train_surrogate(job, threads)
        _write_json(json_path, figures)
    console.print(f"surrogate  {job.folder.surrogate}", highlight=False)


@app.command()
def export(
    source: Annotated[
        Path, typer.Argument(help="Recipe that was trained, an FMU, or a torch module.")
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="FMU to write.")] = None,
    fmi: Annotated[
        int, typer.Option("--fmi", min=2, max=3, help="Version of the standard: 2 or 3.")
    ] = 2,
    weights: Annotated[
        str | None,
        typer.Option(help="float32 or float16 for feed-forward layers; as they are if not given."),
    ] = None,
    sources: Annotated[
        bool, typer.Option("--source", help="With C sources, for targets of your own compiler.")
    ] = False,
    backend: Annotated[
        Backend, typer.Option(help="python: for torch modules; needs Python where it runs.")
    ] = Backend.native,
    description: Annotated[
        Path | None, typer.Option("--description", help="TOML file about a torch module.")
    ] = None,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    runs: RunsOption = Path("runs"),
) -> None:
    """Write the FMU of a trained recipe, or an FMU again with this version's runtime."""
    with progress_bars() as bar:
        form = pipeline.Form(checked_version(fmi), sources, weights)
        if backend == Backend.python or is_module(source):
            pipeline.require_module_export(source, backend == Backend.python, form)
            path, loss = pipeline.export_torch(source, description, output), None
        elif source.suffix == ".toml":
            job = pipeline.open_job(source, runs, bar, seed, data_seed)
            path, loss = pipeline.export_recipe(job, output, form)
        elif output is None:
            raise ValueError("export of an FMU: where to? give the FMU to write with -o PATH")
        else:
            path, loss = pipeline.export_again(source, output, form)
        _write_json(json_path, {"fmu": str(path), "rounding": loss})
    if loss is not None:
        _show_rounding(loss)
    console.print(f"FMU     {path}", highlight=False)


@app.command()
def reference(
    recipe: RecipeArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="FMU to write.")],
) -> None:
    """Write the reference system of a recipe as FMU (it needs this Python environment)."""
    with _errors():
        pipeline.make_importable(recipe.parent)
        path = write_reference(load_recipe(recipe), output)
    console.print(f"FMU     {path}", highlight=False)


@app.command()
def ssp(
    fmu: FmuArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="SSP to write.")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of the inputs.")] = UNSEEN_SEED,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="Of the inputs in s; the recipe's if not given.")
    ] = None,
) -> None:
    """Write an FMU and its reference system, driven by the same unseen inputs, as SSP."""
    with _errors():
        path = write_side_by_side(fmu, output, seed, duration)
    console.print(f"SSP     {path}", highlight=False)


@app.command()
def validate(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the trajectories.")] = UNSEEN_SEED,
    trajectories: TrajectoriesOption = None,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="Length in s; the recipe's if not given.")
    ] = None,
    amplitude: Annotated[
        tuple[float, float], typer.Option(help="Range of a factor on the excitation.")
    ] = (1.0, 1.0),
    report: Annotated[
        Path | None, typer.Option("--report", help="Folder for report.html and report.json.")
    ] = None,
) -> None:
    """Run an FMU beside its reference system on unseen inputs and measure the error."""
    with progress_bars() as bar:
        if report is not None:
            report.mkdir(parents=True, exist_ok=True)
        task = Task(seed, trajectories, amplitude, duration)
        result = pipeline.validate_fmu_file(fmu, task, bar)
        figures = result.figures()
        _write_json(json_path, figures)
        folder = report or Path("runs") / result.surrogate.name / "validation"
        page = pipeline.validation_report(result).write(folder)
    _show_validation(figures, "validation")
    console.print(f"report  {page}", highlight=False)


@app.command()
def check(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """List the problems of an FMU; an empty list and exit code 0 when it is fine."""
    with _errors():
        problems = check_fmu(fmu)
        _write_json(json_path, {"fmu": str(fmu), "problems": problems})
    for problem in problems:
        console.print(problem, style="red", highlight=False)
    if problems:
        raise typer.Exit(1)
    console.print(f"{fmu}: no problems", highlight=False)


@app.command()
def bench(
    fmu: Annotated[
        Path | None, typer.Argument(help="FMU made by slide-fmu; or give --synthetic.")
    ] = None,
    synthetic: Annotated[
        str | None,
        typer.Option(help=f"A network with random weights instead: {', '.join(SYNTHETIC)}."),
    ] = None,
    json_path: JsonOption = None,
    rounds: Annotated[int, typer.Option(min=1, help="Rounds; all take turns.")] = Effort.rounds,
    steps: Annotated[int, typer.Option(min=1, help="Steps of each in a round.")] = Effort.steps,
) -> None:
    """Time an FMU beside the memory's limit and the same network elsewhere, in one run."""
    with _errors():
        effort = Effort(rounds, steps)
        if (fmu is None) == (synthetic is None):
            raise ValueError("bench: give either an FMU or --synthetic NAME")
        figures = (
            bench_fmu(fmu, effort) if fmu is not None else bench_synthetic(str(synthetic), effort)
        )
        _write_json(json_path, figures)
    if json_path != "-":
        Console().print_json(json.dumps(figures))


@app.command()
def info(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """What an FMU is: signals, window, network, measured error, provenance."""
    with _errors():
        figures = module_figures(fmu) or _describe(*read_fmu(fmu))
        _write_json(json_path, figures)
    if json_path != "-":
        Console().print_json(json.dumps(figures))


def main() -> None:
    """Entry point of the console script."""
    app()


def _describe(surrogate: Surrogate, provenance: dict[str, Any] | None) -> dict[str, Any]:
    estimator = surrogate.estimator
    return {
        "name": surrogate.name,
        "inputs": [vars(signal) for signal in surrogate.inputs],
        "outputs": [vars(signal) for signal in surrogate.outputs],
        "hold": surrogate.hold,
        "window": vars(surrogate.window),
        "parameters": surrogate.network.count_parameters(),
        "estimator_parameters": None
        if estimator is None
        else estimator.network.count_parameters(),
        "provenance": provenance,
    }


def _show_validation(figures: dict[str, Any], title: str) -> None:
    table = Table("output", "RMS of the reference", "RMSE", "relative RMSE", "largest error")
    table.title = f"{title}: {figures['trajectories']} trajectories, seed {figures['seed']}"
    for output in figures["outputs"]:
        unit = output["unit"]
        table.add_row(
            output["name"],
            f"{output['rms_reference']:.4g} {unit}",
            f"{output['rmse']:.4g} {unit}",
            f"{100 * output['relative_rmse']:.3g} %",
            f"{output['max_error']:.4g} {unit}",
        )
    console.print(table)
    estimate = figures["error_estimate"]
    if estimate is not None:
        console.print(
            f"error estimate: mean relative deviation "
            f"{100 * estimate['mean_relative_deviation']:.3g} %, 95 % within "
            f"{100 * estimate['p95_relative_deviation']:.3g} %",
            highlight=False,
        )


def _show_rounding(loss: dict[str, Any]) -> None:
    """What float16 changes, output by output."""
    if not loss["predictor_rounded"]:
        console.print("float16: the surrogate's network has no layers; it stays float32")
    for output in loss["outputs"] if loss["predictor_rounded"] else []:
        console.print(
            f"float16: {output['name']} changes by {output['rms_change']:.3g} {output['unit']} "
            f"(RMS), {100 * output['relative_rms_change']:.3g} % of its spread, on inputs that "
            f"are {loss['inputs']}",
            highlight=False,
        )
    if loss["estimator_rounded"]:
        console.print(
            f"float16: error estimates change by {100 * loss['relative_estimate_change']:.3g} % "
            "(RMS)",
            highlight=False,
        )


def _write_json(path: str | None, figures: Any) -> None:
    if path is None:
        return
    text = json.dumps(figures, indent=2, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
    else:
        Path(path).write_text(text, encoding="utf-8")


@contextmanager
def progress_bars() -> Iterator[pipeline.Bar]:
    """Progress bars on a terminal, lines elsewhere; and errors as messages."""
    if not console.is_terminal:
        with _errors():
            yield _lines
        return
    columns = (
        TextColumn("{task.description:>24}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[remark]}"),
    )
    with _errors(), Progress(*columns, console=console) as progress:

        def bar(stage: str) -> pipeline.Advance:
            task = progress.add_task(stage, total=None, remark="")

            def advance(done: int, total: int, remark: str) -> None:
                progress.update(task, completed=done, total=total, remark=remark)

            return advance

        yield bar


def _lines(stage: str) -> pipeline.Advance:
    """Progress as a line for every tenth of the work."""
    printed = -1

    def advance(done: int, total: int, remark: str) -> None:
        nonlocal printed
        tenth = 10 * done // max(1, total)
        if tenth > printed:
            printed = tenth
            console.print(f"{stage}: {done} of {total}  {remark}".rstrip(), highlight=False)

    return advance


@contextmanager
def _errors() -> Iterator[None]:
    """Turn a user's mistakes into one message and exit code 1."""
    try:
        yield
    except ImportError as error:
        _fail(error, f"{error}; this verb needs more packages: pip install 'slide-fmu[train]'")
    except (ValueError, RuntimeError, OSError) as error:
        _fail(error, str(error))


def _fail(error: Exception, message: str) -> None:
    if os.environ.get(TRACEBACK):
        raise error
    console.print(f"error: {message}", style="red", highlight=False, markup=False)
    raise SystemExit(1) from None


if __name__ == "__main__":
    main()
