"""The subcommand fits the physical parameters of an FMU to records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from slide_fmu.cli.console import console, progress_bars, show_remark, show_table, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption, numbers_of, one_of, pairs_of
from slide_fmu.core.figures import plain
from slide_fmu.core.file_kinds import record_formats

if TYPE_CHECKING:
    from slide_fmu.apps.calibrate.result import Calibration
    from slide_fmu.records.preparation import Pairing

PAIRINGS = ("same", "later")
"""Which output of a record belongs to an input (``slide_fmu.records.preparation.Pairing``)."""


def calibrate(
    fmu: FmuArgument,
    records: Annotated[
        list[str],
        typer.Argument(
            metavar="RECORD...",
            help=f"One or more measured records: {record_formats()} files.",
        ),
    ],
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="NAME=COLUMN",
            help="Column of an input; repeat it for each one. Default: the column with "
            "the name of the input.",
        ),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            metavar="NAME=COLUMN",
            help="Column of an output; repeat it for each one. Outputs that you do not "
            "name are left out. Default: all outputs, in the columns with their "
            "names.",
        ),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Value of a parameter that is not fitted; repeat it for each one.",
        ),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Column with the times. Default: found by its name."),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Sample step in s of records without times.")
    ] = None,
    pairing: Annotated[
        str | None,
        typer.Option(
            metavar="same|later",
            callback=one_of(PAIRINGS, "leave the option out, and the FMU decides"),
            autocompletion=lambda: list(PAIRINGS),
            help="Whether an output belongs to the input of the same sample (same) or of"
            " the sample before (later). Default: same if the inputs of the FMU "
            "move between samples, later if they are held.",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of the points where the search begins.")
    ] = 0,
    json_path: JsonOption = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write report.html and report.json here."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--ssv", help="Write the fitted values to this SSV file, for an SSP."),
    ] = None,
) -> None:
    """Fit the physical parameters of an FMU to measured records, with 95 % intervals."""
    from slide_fmu.apps.calibrate.calibrate_fmu import (
        RecordFiles,
        calibrate_fmu,
        require_ssv,
        write_parameters,
    )

    with progress_bars():
        if output is not None:
            require_ssv(output)  # before the long work begins
        columns = pairs_of("input", inputs, "COLUMN"), pairs_of("output", outputs, "COLUMN")
        fixed = numbers_of("fix", fix)
        chosen = cast("Pairing | None", pairing)
        measured = RecordFiles(tuple(records), *columns, time, step, chosen)
        calibration, remarks = calibrate_fmu(fmu, measured, fixed, seed)
        if output is not None:
            write_parameters(calibration, output)
    for remark in remarks:
        show_remark(remark)
    _show(calibration)
    write_json(
        json_path, {**plain(calibration.figures()), "seed": seed, "about_records": list(remarks)}
    )
    if output is not None:
        console.print(f"SSV     {output}")
    if report is not None:
        from slide_fmu.apps.calibrate.calibrate_fmu import fitted_courses
        from slide_fmu.apps.calibrate.calibration_report import calibration_report

        page = calibration_report(calibration, fitted_courses(fmu, measured, calibration)).write(
            report
        )
        console.print(f"report  {page}")


def _show(calibration: Calibration) -> None:
    """Print the fitted values, how well they fit, and remarks."""
    from slide_fmu.apps.calibrate.calibration_report import output_table, parameter_table

    show_table(parameter_table(calibration))
    for name, value in calibration.fixed.items():
        console.print(f"{name} was held at {value:g}")
    show_table(output_table(calibration))
    console.print(f"{calibration.samples} samples were used")
    for remark in calibration.remarks:
        show_remark(remark)
