"""Models and files next to a recipe, or near an FMU, are found on Python's search path.

Their folders are entries of ``sys.path``. Nothing else keeps them: each process has one search
path, and models are imported from it.
"""

from __future__ import annotations

import filecmp
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class AmbiguousFileError(ValueError):
    """Two different files may be meant by one file name in a recipe."""


class RecipeFolder(str):
    """A RecipeFolder is an entry of the search path made for a recipe or an FMU.

    Worker processes receive it as a plain text.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (str(self),)


class FormerFolder(RecipeFolder):
    """A FormerFolder belongs to a recipe or an FMU that this process used earlier."""

    __slots__ = ()


def make_importable(*folders: Path) -> None:
    """Let recipes name models and files in these folders, here and in worker processes.

    The folders stand at the end of the path, but before those of other recipes: a model may have
    the name of one that this process used earlier.
    """
    new = list(dict.fromkeys(RecipeFolder(folder.resolve()) for folder in folders))
    others = [place for place in sys.path if not isinstance(place, RecipeFolder)]
    earlier = [
        FormerFolder(place)
        for place in sys.path
        if isinstance(place, RecipeFolder) and place not in new
    ]
    sys.path[:] = [*others, *new, *earlier]


@contextmanager
def neighbours(file: Path) -> Iterator[None]:
    """Let a file import its neighbours while it runs, after those of all other folders."""
    place = str(file.resolve().parent)
    sys.path.append(place)
    try:
        yield
    finally:  # an equal entry, of the recipe's folder, stays
        sys.path[:] = [entry for entry in sys.path if entry is not place]


def make_models_importable(fmu: Path) -> None:
    """Let an FMU's recipe name models that lie where the recipe probably was.

    That is the current folder, the folder that contains ``runs``, or the folder of the FMU.
    """
    folder = fmu.resolve().parent
    make_importable(Path.cwd(), folder.parent.parent, folder)


def find_file(name: str) -> Path:
    """Find a file of the user: in the current folder, or in a folder where modules are found.

    The folder of a recipe is one of these.

    Raises:
        AmbiguousFileError: the file here and the file next to the recipe differ. Worker processes
            do not check this: they look in the same places after the recipe was read.
        FileNotFoundError: there is no such file; the message lists the folders.
    """
    here = Path(name)
    current = (Path(place) / name for place in sys.path if type(place) is RecipeFolder)
    own = next((path for path in current if path.is_file()), None)
    if own is not None and here.is_file() and not _same(here, own):
        raise AmbiguousFileError(
            f"two files {name!r} that differ: {str(own)!r}, and one in the current folder; "
            "expected one: change to the folder of the recipe, or rename one"
        )
    places = (folder / name for folder in map(Path, ["", *sys.path]))
    file = next((path for path in places if path.is_file()), None)
    if file is None:
        raise FileNotFoundError(
            f"no file {name!r} in {Path.cwd()}, on PYTHONPATH, or next to the recipe; expected "
            "the path of one: check the name, or put its folder on PYTHONPATH"
        )
    return file.resolve()


def _same(one: Path, other: Path) -> bool:
    return one.samefile(other) or filecmp.cmp(one, other, shallow=False)
