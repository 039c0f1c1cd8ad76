"""Verbs that write, run and describe FMUs."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from slide_fmu.cli.app import app
from slide_fmu.cli.console import console, errors, progress_bars, write_json
from slide_fmu.cli.options import (
    UNSEEN_SEED,
    DataSeedOption,
    FmuArgument,
    JsonOption,
    RecipeArgument,
    TrainingSeedOption,
    TrajectoriesOption,
)
from slide_fmu.cli.tables import show_remark, show_validation
from slide_fmu.cosim.synthetic import SYNTHETIC, Effort
from slide_fmu.surrogate.surrogate import Surrogate


class Backend(StrEnum):
    """What runs the network in an FMU."""

    native = "native"
    python = "python"


@app.command()
def export(
    source: Annotated[
        Path, typer.Argument(help="Recipe that was trained, an FMU, or a torch module.")
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="FMU to write.")] = None,
    fmi: Annotated[
        int, typer.Option("--fmi", min=2, max=3, help="Version of the standard: 2 or 3.")
    ] = 2,
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
    runs: Annotated[
        Path | None,
        typer.Option("--runs", help="Folder that holds the work on recipes; runs if not given."),
    ] = None,
) -> None:
    """Write the FMU of a trained recipe, or an FMU again with this version's runtime."""
    from slide_fmu.fmu.libraries.platforms import checked_version
    from slide_fmu.pipeline.export import Request
    from slide_fmu.pipeline.export import export as write
    from slide_fmu.pipeline.form import Form

    with progress_bars() as bar:
        form = Form(checked_version(fmi), sources)
        python = backend == Backend.python
        request = Request(source, output, form, python, description, seed, data_seed, runs)
        path = write(request, bar)
        write_json(json_path, {"fmu": str(path)})
    console.print(f"FMU     {path}")


@app.command()
def reference(
    recipe: RecipeArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="FMU to write.")],
) -> None:
    """Write the reference system of a recipe as FMU (it needs this Python environment)."""
    from slide_fmu.pipeline.job import make_importable
    from slide_fmu.pipeline.side_by_side import write_reference
    from slide_fmu.recipe.reading import load_recipe

    with errors():
        make_importable(recipe.parent)
        path = write_reference(load_recipe(recipe), output)
    console.print(f"FMU     {path}")


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
    from slide_fmu.pipeline.side_by_side import write_side_by_side

    with errors():
        path, remark = write_side_by_side(fmu, output, seed, duration)
    show_remark(remark)
    console.print(f"SSP     {path}")


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
    from slide_fmu.pipeline.measurement import validate_fmu_file, validation_report
    from slide_fmu.validation.comparison import Task

    with progress_bars() as bar:
        if report is not None:
            report.mkdir(parents=True, exist_ok=True)
        task = Task(seed, trajectories, amplitude, duration)
        result = validate_fmu_file(fmu, task, bar)
        figures = result.figures()
        write_json(json_path, figures)
        folder = report or Path("runs") / result.surrogate.name / "validation"
        page = validation_report(result).write(folder)
    show_validation(figures, "validation")
    console.print(f"report  {page}")


@app.command()
def check(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """List the problems of an FMU; an empty list and exit code 0 when it is fine."""
    from slide_fmu.cosim.check import check_fmu

    with errors():
        problems = check_fmu(fmu)
        write_json(json_path, {"fmu": str(fmu), "problems": problems})
    for problem in problems:
        console.print(problem, style="red")
    if problems:
        raise typer.Exit(1)
    console.print(f"{fmu}: no problems")


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
    """Time an FMU beside the same network elsewhere, in one run."""
    from slide_fmu.cosim.bench import bench_fmu, bench_synthetic

    with errors():
        effort = Effort(rounds, steps)
        if (fmu is None) == (synthetic is None):
            raise ValueError("bench: give either an FMU or --synthetic NAME")
        figures = (
            bench_fmu(fmu, effort) if fmu is not None else bench_synthetic(str(synthetic), effort)
        )
        write_json(json_path, figures)
    if json_path != "-":
        Console().print_json(json.dumps(figures))


@app.command()
def info(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """What an FMU is: signals, window, network, measured error, provenance."""
    from slide_fmu.fmu.export import read_fmu
    from slide_fmu.python_fmu.torch_files import module_figures

    with errors():
        figures = module_figures(fmu) or _describe(*read_fmu(fmu))
        write_json(json_path, figures)
    if json_path != "-":
        Console().print_json(json.dumps(figures))


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
