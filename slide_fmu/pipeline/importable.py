"""Models that lie beside a recipe, or near an FMU, are found by Python."""

from __future__ import annotations

import sys
from pathlib import Path


def make_importable(folder: Path) -> None:
    """Let recipes name models that lie beside them, here and in worker processes."""
    place = str(folder.resolve())
    if place not in sys.path:
        sys.path.append(place)


def make_models_importable(fmu: Path) -> None:
    """Let an FMU's recipe name models that lie where its recipe most likely lay.

    That is here, beside the FMU, or beside the folder ``runs`` that it was made in.
    """
    folder = fmu.resolve().parent
    for place in (Path.cwd(), folder, folder.parent.parent):
        make_importable(place)
