"""``slide-fmu info``: what an FMU is."""

from __future__ import annotations

from slide_fmu.cli.console import errors, show_json
from slide_fmu.cli.options import FmuArgument, JsonOption


def info(fmu: FmuArgument, json_path: JsonOption = None) -> None:
    """Print what an FMU is: its signals, window, network, measured error and provenance."""
    from slide_fmu.pipeline.info import describe_fmu

    with errors():
        figures = describe_fmu(fmu)
        show_json(json_path, figures)
