"""The subcommand runs a coupled system of FMUs, which an SSP file describes."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, show_remark, show_table, write_json
from slide_fmu.cli.options import JsonOption, numbers_of, one_of

METHODS = ("jacobi", "gauss_seidel", "fixed_point", "newton")
"""Names of the methods, which are imported later."""


def couple(
    system: Annotated[
        Path, typer.Argument(metavar="FILE.ssp", help="The system: FMUs and connections.")
    ],
    step: Annotated[
        float | None,
        typer.Option(help="Communication step in s. Default: the largest step that an FMU names."),
    ] = None,
    stop: Annotated[
        float | None, typer.Option(help="End time in s. Default: as in the SSP.")
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help=f"One of {', '.join(METHODS)}.",
            callback=one_of(METHODS, "leave it out"),
        ),
    ] = "newton",
    extrapolation: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="How inputs go on in explicit steps: linear or zero. Default: linear.",
            callback=one_of(("linear", "zero"), "leave it out"),
        ),
    ] = None,
    control: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Control the length of steps: predictor or halving. Default: all have one.",
            callback=one_of(("predictor", "halving"), "leave it out"),
        ),
    ] = None,
    error: Annotated[
        float | None,
        typer.Option(
            help="Largest error of a controlled step, as a part of a size. Default: 1e-3."
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="Implicit steps end at this difference, as a part of a size. Default: 1e-5."
        ),
    ] = None,
    inputs: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Table of other inputs, with columns time and COMPONENT.VARIABLE, or connectors "
            "of the system.",
        ),
    ] = None,
    given: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="COMPONENT.VARIABLE=VALUE",
            help="Start value of a parameter or an input; repeat it for each one.",
        ),
    ] = None,
    moving: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COMPONENT",
            help="Its inputs reach their values by the end of a step; repeat it for each one.",
        ),
    ] = None,
    record: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COMPONENT.VARIABLE",
            help="A value for the table, such as a.trusted; repeat it for each one. Default: "
            "linked and given inputs, and outputs.",
        ),
    ] = None,
    deadline: Annotated[
        float | None,
        typer.Option(
            help="Longest time in s of one call of an FMU of another tool. Default: 120.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.csv",
            help="Write the table to this file. Default: runs/NAME/couple/values.csv.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Folder for report.html. Default: runs/NAME/couple."),
    ] = None,
    json_path: JsonOption = None,
) -> None:
    """Run several FMUs together: a co-simulation master for a system in an SSP file."""
    from slide_fmu.apps.couple.couple import run_coupled
    from slide_fmu.apps.couple.coupled_report import coupled_report, coupled_table
    from slide_fmu.apps.couple.options import CouplingOptions
    from slide_fmu.apps.couple.result import StoppedRunError
    from slide_fmu.apps.couple.ssp import read_inputs, read_ssp
    from slide_fmu.apps.couple.structure import coupled_system, default_step, require_units
    from slide_fmu.importer.errors import FmuError

    folder = report or Path("runs") / system.stem / "couple"
    table = output or folder / "values.csv"
    with progress_bars() as bar, TemporaryDirectory(prefix="slide_fmu_") as unpacked:
        ssp = read_ssp(system, Path(unpacked))
        values = {**ssp.parameters, **ssp.with_components(numbers_of("set", given))}
        courses = {} if inputs is None else ssp.with_components(read_inputs(inputs))
        try:
            checked = coupled_system(ssp.fmus, ssp.connections, values, courses)
        except FmuError as refusal:  # users know the place in the SSP
            raise FmuError(str(refusal).replace(unpacked, str(system))) from None
        except ValueError as refusal:
            raise ValueError(f"{system}: {refusal}") from None
        require_units(checked, ssp.units)
        end = stop if stop is not None else ssp.stop
        if end is None:
            raise ValueError(f"{system} names no end; expected one: give --stop in s")
        options = CouplingOptions.of(
            step=default_step(checked) if step is None else step,
            stop=end,
            method=method,
            extrapolation=extrapolation,
            tolerance=tolerance,
            control=control,
            error=error,
            moving=tuple(moving or ()),
            deadline=deadline,
            record=[ssp.outputs.get(name, name) for name in record or ()] or None,
        )
        _make_places(folder, table)
        try:
            result = run_coupled(checked, options, bar("couple")).with_names(ssp.outputs)
        except StoppedRunError as stopped:
            if stopped.values is not None:
                kept = stopped.values.with_names(ssp.outputs)
                console.print(f"table   {kept.write(table)}, up to {kept.time[-1]:.6g} s")
            raise
        result.write(table)
        page = coupled_report(system.stem, result, checked).write(folder)
    write_json(json_path, result.figures)
    show_table(coupled_table(result))
    for remark in result.figures.remarks:
        show_remark(remark)
    console.print(f"table   {table}")
    console.print(f"report  {page}")


def _make_places(folder: Path, table: Path) -> None:
    """Make the folders of report and table, before the run."""
    for place in (folder, table.parent):
        place.mkdir(parents=True, exist_ok=True)
    if table.is_dir() or not os.access(table.parent, os.W_OK):
        raise ValueError(f"{str(table)!r}: expected a file in a folder that can be written to")
