"""``slide-fmu export``: whatever can become an FMU, as FMU."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.cli.console import console, progress_bars, write_json
from slide_fmu.cli.options import DataSeedOption, JsonOption, TrainingSeedOption


class Backend(StrEnum):
    """What runs the network in an FMU."""

    native = "native"
    python = "python"


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
    from slide_fmu.pipeline.export import Form, Request
    from slide_fmu.pipeline.export import export as write

    with progress_bars() as bar:
        form = Form(3 if fmi == 3 else 2, sources)
        python = backend == Backend.python
        request = Request(source, output, form, python, description, seed, data_seed, runs)
        path = write(request, bar)
        write_json(json_path, {"fmu": str(path)})
    console.print(f"FMU     {path}")
