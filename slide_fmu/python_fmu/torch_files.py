"""Files of torch modules, and FMUs that carry one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.fmu.export import MODULE, read_json

SUFFIXES = {".pt": "module.pt", ".pt2": "module.pt2"}
"""Endings of files of scripted (``torch.jit.save``) and exported (``torch.export.save``) modules,
and their names in the FMU."""


def is_module(path: Path) -> bool:
    """Say whether a file is a torch module, by its name."""
    return path.suffix in SUFFIXES


def module_figures(path: Path) -> dict[str, Any] | None:
    """Read what an FMU says about the torch module in it, or None when it carries none.

    Raises:
        FmuError: the file is no zip archive or is damaged, or what it says is no JSON object.
        OSError: the file cannot be read.
    """
    return read_json(path, MODULE)
