"""Models and files that lie beside a recipe, or near an FMU, are found.

Their folders stand on Python's search path, ``sys.path``, which alone knows them: there is one in
each process, and models are imported by it.
"""

from __future__ import annotations

import filecmp
import sys
from pathlib import Path


class AmbiguousFileError(ValueError):
    """A recipe's name of a file may mean two files that differ."""


class RecipeFolder(str):
    """A RecipeFolder stands on the search path because of a recipe or an FMU.

    Worker processes get it as a plain text.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (str(self),)


class FormerFolder(RecipeFolder):
    """A FormerFolder is that of a recipe or an FMU which this process was about earlier."""

    __slots__ = ()


def make_importable(*folders: Path) -> None:
    """Let recipes name models and files that lie in folders, here and in worker processes.

    The folders stand at the end of the path, but before those of other recipes: a model may have
    the name of one that was used earlier in this process.
    """
    new = list(dict.fromkeys(RecipeFolder(folder.resolve()) for folder in folders))
    others = [place for place in sys.path if not isinstance(place, RecipeFolder)]
    earlier = [
        FormerFolder(place)
        for place in sys.path
        if isinstance(place, RecipeFolder) and place not in new
    ]
    sys.path[:] = [*others, *new, *earlier]


def make_models_importable(fmu: Path) -> None:
    """Let an FMU's recipe name models that lie where its recipe most likely lay.

    That is here, beside the folder ``runs`` that it was made in, or beside the FMU.
    """
    folder = fmu.resolve().parent
    make_importable(Path.cwd(), folder.parent.parent, folder)


def find_file(name: str) -> Path:
    """Find a file of the user: a path from here, or from a folder in which modules are looked for.

    The folder of a recipe is one of those.

    Raises:
        AmbiguousFileError: the one here is another than the one beside the recipe. Worker
            processes do not ask: they look in the same places after the recipe was read.
        FileNotFoundError: there is no such file; the message says where it was looked for.
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
    found = next((path for path in places if path.is_file()), None)
    if found is None:
        raise FileNotFoundError(
            f"no file {name!r} in {Path.cwd()} or beside the recipe; expected the path of one: "
            "check the name"
        )
    return found.resolve()


def _same(one: Path, other: Path) -> bool:
    return one.samefile(other) or filecmp.cmp(one, other, shallow=False)
