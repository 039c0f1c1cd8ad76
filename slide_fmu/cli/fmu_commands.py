"""The subcommands on FMUs read their options and print the results.

As with the subcommands on recipes, the code of a subcommand is imported when it is called.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from slide_fmu.cli.console import (
    console,
    errors,
    figures_console,
    progress_bars,
    show_remark,
    show_table,
    write_json,
)
from slide_fmu.cli.options import (
    DataSeedOption,
    FmuArgument,
    JsonOption,
    TrainingSeedOption,
    TrajectoriesOption,
)
from slide_fmu.core.file_kinds import record_formats
from slide_fmu.validation.task import UNSEEN_SEED, Task


def export(
    source: Annotated[
        Path, typer.Argument(help="A recipe that was trained, or an FMU of slide-fmu.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the FMU to this file.")
    ] = None,
    fmi: Annotated[
        int,
        typer.Option(
            "--fmi", min=2, max=3, help="Version of the standard: 2 for FMI 2.0, 3 for FMI 3.0."
        ),
    ] = 2,
    sources: Annotated[
        bool, typer.Option("--source", help="Add the C sources to the FMU, for your own compiler.")
    ] = False,
    scalar: Annotated[
        bool,
        typer.Option(
            "--scalar", help="Add C sources for controllers: scalar arithmetic, no dynamic memory."
        ),
    ] = False,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    runs: Annotated[
        Path | None,
        typer.Option("--runs", help="Folder with the work on recipes. Default: runs."),
    ] = None,
) -> None:
    """Write the FMU of a trained recipe, or renew an FMU with this version."""
    from slide_fmu.pipeline.export import ExportRequest
    from slide_fmu.pipeline.export import export as write

    with progress_bars() as bar:
        version: Literal[2, 3] = 3 if fmi == 3 else 2
        kind: bool | Literal["scalar"] = "scalar" if scalar else sources
        request = ExportRequest(source, output, version, kind, seed, data_seed, runs)
        written = write(request, bar)
    write_json(json_path, {"fmu": str(written.path), "remark": written.remark})
    show_remark(written.remark)
    console.print(f"FMU     {written.path}")


def validate(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the trajectories.")] = UNSEEN_SEED,
    trajectories: TrajectoriesOption = None,
    duration: Annotated[
        float | None,
        typer.Option(help="Duration of a motion in s. Default: as in the recipe."),
    ] = None,
    amplitude: Annotated[
        tuple[float, float],
        typer.Option(
            help="Multiply the amplitude of the inputs by random factors from this range."
        ),
    ] = (1.0, 1.0),
    held_out: Annotated[
        bool,
        typer.Option(
            "--held-out", help="Use the kinds of inputs that the recipe keeps out of the training."
        ),
    ] = False,
    report: Annotated[
        Path | None,
        typer.Option("--report", help="Write report.html and report.json to this folder."),
    ] = None,
    inputs: Annotated[
        Path | None,
        typer.Option(
            "--inputs",
            metavar="FILE",
            help=f"Measure it under your own inputs alone, from a file ({record_formats()}) with "
            "times and a column for each input. It takes no other option but --json.",
        ),
    ] = None,
) -> None:
    """Measure an FMU against its model on unseen inputs. This runs the code of the model."""
    if inputs is not None:
        given = Task(seed, trajectories, amplitude, duration, held_out) != Task(UNSEEN_SEED)
        with errors():
            _require_alone(given or report is not None)
        _validate_inputs(fmu, inputs, json_path)
        return
    from slide_fmu.pipeline.apps import last_section
    from slide_fmu.pipeline.measurement import (
        released_case,
        report_folder,
        validate_fmu_file,
        validation_report,
    )
    from slide_fmu.report.console import print_noise, print_rows

    with progress_bars() as bar:
        if report is not None:
            report.mkdir(parents=True, exist_ok=True)
        task = Task(seed, trajectories, amplitude, duration, held_out)
        case = released_case(fmu)
        result = validate_fmu_file(fmu, case, task, bar)
        made, figures = validation_report(result, fmu, case, bar)
        folder = report or Path("runs") / result.surrogate.name / report_folder(task)
        page = replace(made, inside=last_section(fmu)).write(folder)
    write_json(json_path, figures)
    console.print(f"{figures.trajectories} trajectories, seed {figures.seed}")
    print_rows(figures.rows, console)
    print_noise(figures.outputs, console)
    console.print(f"report  {page}")


def _require_alone(others: bool) -> None:
    """Refuse options of drawn trajectories, and a report, where a file of inputs is measured."""
    if others:
        raise ValueError(
            "--inputs with other options of validate; expected --json alone next to it: the file "
            "says what is measured, and there is no report of it, so leave them out"
        )


def _validate_inputs(fmu: Path, inputs: Path, json_path: str | None) -> None:
    """Measure an FMU under a file of inputs, and print it."""
    from slide_fmu.pipeline.measurement import released_case
    from slide_fmu.pipeline.your_inputs import measure_inputs
    from slide_fmu.report.console import print_table
    from slide_fmu.report.row_tables import row_table
    from slide_fmu.report.verdict import verdict

    with progress_bars() as bar:
        figures = measure_inputs(fmu, released_case(fmu), inputs, bar)
    write_json(json_path, figures)
    console.print(f"inputs  {figures.judging}, {figures.begin_s:g} to {figures.end_s:g} s")
    show_remark(figures.remark)
    print_table(row_table(figures.rows), console)
    for sentence in verdict(figures.rows):
        console.print(sentence)


def simulate(
    fmu: FmuArgument,
    inputs: Annotated[
        Path,
        typer.Option(
            "--inputs",
            metavar="FILE",
            help=f"File of your inputs ({record_formats()}) with times and a column for each.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE.csv", help="Write outputs, bounds and trusted here."
        ),
    ] = None,
    json_path: JsonOption = None,
    step: Annotated[
        float | None,
        typer.Option(min=1e-9, help="Communication step in s. Default: the FMU's own."),
    ] = None,
    known: Annotated[
        bool,
        typer.Option(
            "--known", help="Let the FMU know what inputs reach by the end of each step."
        ),
    ] = False,
) -> None:
    """Run an FMU along your inputs, without its model: outputs, and what it does not trust."""
    from slide_fmu.pipeline.your_inputs import simulate_inputs, write_outputs
    from slide_fmu.report.own_view import parts_table, view_sentences

    with errors():
        made = simulate_inputs(fmu, inputs, "known" if known else "plain", step)
        if output is not None:
            write_outputs(made, output)
    write_json(json_path, made.view)
    for sentence in view_sentences(made.view):
        console.print(sentence)
    table = parts_table(made.view)
    if table is not None:
        show_table(table)
    if output is not None:
        console.print(f"outputs {output}")


def check(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    run: Annotated[
        bool,
        typer.Option(
            "--run",
            help="Also repeat the experiment inside the FMU, and compare the outputs. "
            "This runs libraries that this version does not know, such as those "
            "that you compiled. Such code may do anything.",
        ),
    ] = False,
) -> None:
    """Check the files and the results of an FMU. The exit code is 0 if all is well."""
    from slide_fmu.pipeline.check import check as check_file

    with errors():
        checked = check_file(fmu, run)
        write_json(json_path, checked.figures(fmu))
    for run_again in checked.repeated.values():
        show_table(run_again.table)
    for problem in checked.problems:
        console.print(problem, style="red")
    if not checked.problems:
        console.print(f"{fmu}: no problems. Checked:")
        for part in checked.parts:
            console.print(f"  {part}")
    for part in checked.left_out:
        console.print(f"Not checked: {part}")
    if checked.problems:
        raise typer.Exit(1)


def info(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """Describe an FMU: measured error, where it is valid, speed, signals and origin."""
    from slide_fmu.fmu.export import read_fmu
    from slide_fmu.report.console import print_description
    from slide_fmu.report.fmu_description import FmuDescription

    with errors():
        described = FmuDescription.of(*read_fmu(fmu))
        if json_path is not None:
            write_json(json_path, described.dump())
            return
        try:
            print_description(described, figures_console())
        except ValueError as error:
            raise ValueError(
                f"{fmu}: resources/provenance.json is not in the form that slide-fmu "
                f"writes ({error}); expected recipe, seeds, versions and "
                "measured errors: slide-fmu info FMU --json - shows what is there"
            ) from error
