"""Small models that run, for who has none yet."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from slide_fmu.core.files import write_whole

TEMPLATES = ("function", "exudyn")
"""Kinds of systems of which a small model can be written."""


def write_template(name: str, kind: str | None) -> str | None:
    """Write a small model that runs, for a name that is no model yet, and return its path.

    None is returned where the name is that of a file or module already, or the kind has no
    template.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(name if name.endswith(".py") else f"{name}.py")
    if kind not in TEMPLATES or path.exists() or not path.stem.isidentifier():
        return None
    text = resources.files(__package__).joinpath("templates", f"{kind}.py").read_bytes()
    write_whole(path, text)
    return str(path)
