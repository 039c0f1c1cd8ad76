"""A torch module as FMU."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.pipeline.form import Form
from slide_fmu.python_fmu.torch_export import ModuleError, export_module
from slide_fmu.python_fmu.torch_files import SUFFIXES, is_module


def require_module_export(source: Path, python: bool, form: Form) -> None:
    """Refuse what the python backend cannot make, and torch modules without it.

    Args:
        source: file of a scripted or exported module.
        python: whether an FMU that needs Python was asked for.
        form: which FMU was asked for.

    Raises:
        ModuleError: with what was asked for, and the remedy.
    """
    if not is_module(source):
        raise ModuleError(
            f"{source}: the python backend takes a torch module, {' or '.join(SUFFIXES)}; the "
            "native one runs what slide-fmu trains: leave out --backend python"
        )
    if not python:
        raise ModuleError(
            f"{source} is a torch module; the native runtime runs exactly what slide-fmu trains, "
            "and nothing else: add --backend python for an FMU that needs Python where it runs"
        )
    if form != Form():
        raise ModuleError(
            f"{source}: the python backend writes the module as it is, as FMI 2.0; leave out "
            "--fmi 3 and --source, which are for native FMUs"
        )


def export_torch(source: Path, description: Path | None, path: Path | None) -> Path:
    """Write a torch module as FMU that needs Python where it runs.

    Args:
        source: file of a scripted or exported module.
        description: TOML file about the module.
        path: the FMU to write.

    Raises:
        ModuleError: an argument is missing, or the module or its description cannot be used.
    """
    if description is None or path is None:
        raise ModuleError(
            f"{source}: what are its signals, and where to? give --description signals.toml and "
            "-o PATH"
        )
    return export_module(source, description, path)
