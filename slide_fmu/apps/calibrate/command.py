"""The subcommand fits the physical parameters of an FMU to records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from slide_fmu.cli.console import console, progress_bars, show_remark, write_json
from slide_fmu.cli.findings import show_table
from slide_fmu.cli.options import FmuArgument, JsonOption, numbers_of, one_of, pairs_of
from slide_fmu.core.figures import plain

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
            metavar="RECORD...", help="Fit to these records: CSV, Parquet, HDF5 or MAT files."
        ),
    ],
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="NAME=COLUMN",
            help="Take this column for this input; once for each. An input that is not named "
            "has the column of its own name.",
        ),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            metavar="NAME=COLUMN",
            help="Take this column for this output; once for each. If any is named, the others "
            "do not count; else all count, each with the column of its own name.",
        ),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Hold this parameter at this value; once for each. All others are fitted.",
        ),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Take this column as times; found by its name if not given."
        ),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Take this sample step, in s, for records without times.")
    ] = None,
    pairing: Annotated[
        str | None,
        typer.Option(
            metavar="same|later",
            callback=one_of(PAIRINGS, "leave the option out, and the FMU decides"),
            autocompletion=lambda: list(PAIRINGS),
            help="Say whether outputs answer the input of the same sample, or that of the sample "
            "before. If not given, the FMU decides: the same where its inputs move between "
            "samples, one sample later where they are held.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Begin the search at points of this seed.")] = 0,
    json_path: JsonOption = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write report.html and report.json here."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--ssv", help="Write the values here, as an SSV file for an SSP."),
    ] = None,
) -> None:
    """Fit the physical parameters of an FMU to measured records, with their intervals."""
    from slide_fmu.apps.calibrate.calibrate_fmu import (
        Measured,
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
        measured = Measured(tuple(records), *columns, time, step, chosen)
        found, remarks = calibrate_fmu(fmu, measured, fixed, seed)
        if output is not None:
            write_parameters(found, output)
    for remark in remarks:
        show_remark(remark)
    _show(found)
    write_json(json_path, {**plain(found.figures()), "seed": seed, "about_records": list(remarks)})
    if output is not None:
        console.print(f"SSV     {output}")
    if report is not None:
        from slide_fmu.apps.calibrate.calibrate_fmu import fitted_courses
        from slide_fmu.apps.calibrate.calibration_report import calibration_report

        page = calibration_report(found, fitted_courses(fmu, measured, found)).write(report)
        console.print(f"report  {page}")


def _show(found: Calibration) -> None:
    """Print the fitted values, how well they fit, and remarks."""
    from slide_fmu.apps.calibrate.calibration_report import output_table, parameter_table

    show_table(parameter_table(found))
    for name, value in found.fixed.items():
        console.print(f"{name} was held at {value:g}")
    show_table(output_table(found))
    console.print(f"{found.samples} samples count")
    for remark in found.remarks:
        show_remark(remark)
