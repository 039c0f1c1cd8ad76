"""FMUs of FMI 3.0 in C: what a source has not, nobody calls with arguments that matter."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from tests.own_models.quarter_car import HERE, compiled, write_fmu


def build(path: Path, name: str, description: str, interface: type[Any]) -> Path:
    """Compile ``c/NAME_fmi3.c`` and write it as FMU.

    Args:
        path: the file to write.
        name: name of the model, and of its library.
        description: its model description.
        interface: fmpy's class of the interface, which loads all functions of the standard.
    """
    source = (HERE / "c" / f"{name}_fmi3.c").read_text(encoding="utf-8")
    wanted = [name for name, _ in inspect.getmembers(interface) if name.startswith("fmi3")]
    missing = [name for name in wanted if f" {name}(" not in source]
    stubs = "\n".join(f"NOT_THERE({name})" for name in missing)
    library = compiled(f"{source}\n{stubs}\n", path.with_suffix(".so"), ())
    return write_fmu(path, description, library, name, fmi=3)
