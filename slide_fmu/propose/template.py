"""This module writes small models that run, for users without a model."""

from __future__ import annotations

import re
from contextlib import suppress
from importlib import resources
from importlib.util import find_spec
from pathlib import Path

from slide_fmu.core.files import write_whole
from slide_fmu.core.search_path import find_file

TEMPLATES = ("function", "exudyn")
"""Kinds of systems of which a small model can be written."""


def write_template(name: str, kind: str | None) -> str | None:
    """Write a small model that runs, for a name that is no model yet, and return its path.

    None is returned if a file or module has the name already, or if the kind has no template.

    Raises:
        ValueError: the name is invalid for a new file, or the named FMU does not exist.
        OSError: the file cannot be written.
    """
    if kind == "fmu" and not _is_there(name):
        raise ValueError(
            f"--kind fmu {name}: there is no such file; expected the path of an FMU (.fmu): "
            f"correct it, or let --kind {' or '.join(TEMPLATES)} write a small model"
        )
    path = Path(name if name.endswith(".py") else f"{name}.py")
    if kind not in TEMPLATES or path.exists() or Path(name).exists():
        return None
    if not path.stem.isidentifier():
        _require_module(name, path.stem, kind)
        return None
    if name == path.stem and find_spec(name) is not None:
        return None  # a file of that name would hide the module from Python
    text = resources.files(__package__).joinpath("templates", f"{kind}.py").read_bytes()
    write_whole(path, text)
    return str(path)


def _is_there(name: str) -> bool:
    with suppress(FileNotFoundError):
        find_file(name)
        return True
    return False


def _require_module(name: str, stem: str, kind: str) -> None:
    """Refuse a name that is valid neither for a new file nor for a module."""
    module = stem.partition(":")[0]
    if all(part.isidentifier() for part in module.split(".")):
        return
    fitting = re.sub(r"\W+", "_", stem).strip("_")
    fitting = fitting if fitting[:1].isalpha() else f"model_{fitting}"
    raise ValueError(
        f"--kind {kind} {name}: there is no such file, and a new one cannot be called {stem!r}; "
        "expected letters, digits and underscores, the first one no digit: choose a name such as "
        f"{fitting}"
    )
