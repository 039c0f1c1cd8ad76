"""Models that lie beside a recipe, or near an FMU, are found by Python."""

from __future__ import annotations

import sys
from pathlib import Path

from slide_fmu.core.files import look_beside

_made: set[str] = set()
"""The folders that stand on the path because of recipes and FMUs."""


def make_importable(*folders: Path) -> None:
    """Let recipes name models that lie in folders, here and in worker processes.

    They stand at the end of the path, but before those of other recipes: a model may have the name
    of one that was used earlier in this process.
    """
    places = list(dict.fromkeys(folder.resolve() for folder in folders))
    look_beside(*places)
    added = list(map(str, places))
    others = [place for place in sys.path if place not in _made]
    new = [place for place in added if place not in others]
    earlier = [place for place in sys.path if place in _made and place not in new]
    _made.update(new)
    sys.path[:] = [*others, *new, *earlier]


def make_models_importable(fmu: Path) -> None:
    """Let an FMU's recipe name models that lie where its recipe most likely lay.

    That is here, beside the folder ``runs`` that it was made in, or beside the FMU.
    """
    folder = fmu.resolve().parent
    make_importable(Path.cwd(), folder.parent.parent, folder)
