"""A recipe's own files travel with its data, to workers that do not see the folder of the recipe.

Workers elsewhere share the disk of the store, since they write to it. So what was loaded from the
folder of the recipe, and the files that it names, are copied beside the store, in a folder that is
named by their content. A worker that finds this folder shares the disk; where the model changes,
the folder has another name, and a worker that lives on forgets the former model.
"""

from __future__ import annotations

import hashlib
import importlib
import os
import shutil
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from slide_fmu.core.files import AmbiguousFileError, find_file, look_beside, writing
from slide_fmu.recipe.recipe import Recipe, RecipeError

LONGEST = 255
"""Longer strings of a recipe name no file."""


def keep_own_files(recipe: Recipe, beside: Path, store: Path) -> Path:
    """Copy a recipe's own files beside its store, and return their folder.

    These are the modules that this process loaded from the folder ``beside``, where the recipe
    lies, and the files that the recipe names with relative paths. A recipe without files of its
    own has an empty folder. Other files that a model reads must be where workers find them too.

    Raises:
        RecipeError: the recipe names a file by a path that leaves its folder.
        OSError: the files cannot be copied; it names the folder.
    """
    files = {**dict(_loaded(beside.resolve())), **dict(_named(recipe))}
    digest = hashlib.sha256()
    for name, source in sorted(files.items()):
        content = source.read_bytes()
        digest.update(f"{name} {len(content)}\n".encode() + content)
    folder = store.absolute().with_name("own_files") / digest.hexdigest()[:16]
    if not folder.exists():
        _copy(files, folder)
    return folder


def _copy(files: dict[str, Path], folder: Path) -> None:
    """Copy files into a folder that is whole or not there; the first of several programs wins."""
    staged = folder.with_name(f"{folder.name}.{os.getpid()}.{threading.get_ident()}")
    try:
        with writing(folder):
            staged.mkdir(parents=True)
            for name, source in files.items():
                place = staged / name
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, place)
            staged.rename(folder)
    except OSError:
        if not folder.exists():
            raise
    finally:
        shutil.rmtree(staged, ignore_errors=True)


def _loaded(beside: Path) -> Iterator[tuple[str, Path]]:
    """Give the files of all modules that were loaded from a folder, by their relative paths.

    Packages of an environment that lies in the folder are none of the recipe's, nor is this one.
    """
    ours = Path(__file__).parents[2]
    for module in list(sys.modules.values()):
        file = getattr(module, "__file__", None)
        if file is None:
            continue
        place = Path(file).resolve()
        if not place.is_relative_to(beside) or "site-packages" in place.parts:
            continue
        if place.is_relative_to(ours) and place.parts[len(ours.parts)] in OURS:
            continue
        if place.is_file():
            yield str(place.relative_to(beside)), place


OURS = "slide_fmu", "mbs_models"
"""These packages are installed wherever a worker is."""


def _named(recipe: Recipe) -> Iterator[tuple[str, Path]]:
    """Give the files that a recipe names with relative paths."""
    for text in _strings(recipe.model_dump(mode="json")):
        name = text.partition(":")[0]
        if not name or len(name) > LONGEST or "\n" in name or Path(name).is_absolute():
            continue
        try:
            found = find_file(name)
        except (AmbiguousFileError, FileNotFoundError):  # who reads a file of the name says so
            continue
        if ".." in Path(name).parts:
            raise RecipeError(
                f"recipe {recipe.name!r} names the file {name!r}; expected one in the folder of "
                "the recipe, or an absolute path that all machines see, since workers elsewhere "
                "have another folder: move the file, or write its absolute path"
            )
        yield name, found


def _strings(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for inner in value.values():
            yield from _strings(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _strings(inner)


class _Used:
    """Names the folder of own files that this process uses."""

    def __init__(self) -> None:
        self.folder: Path | None = None
        self.lock = threading.Lock()


_used = _Used()


def use_own_files(folder: Path) -> bool:
    """Let this process, a worker, find the files of a folder; return whether it is another one.

    Modules that came from the former folder are forgotten, so that a changed model is loaded anew.

    Raises:
        FileNotFoundError: the folder is not there.
    """
    with _used.lock:
        if folder == _used.folder:
            look_beside(folder, instead=True)
            return False
        if not folder.is_dir():
            raise FileNotFoundError(folder)
        if _used.folder is not None:
            _forget(_used.folder)
        # first, so that no other file of the name is taken; of Python's own modules none is here
        sys.path.insert(0, str(folder))
        look_beside(folder, instead=True)
        importlib.invalidate_caches()
        _used.folder = folder
        return True


def _forget(folder: Path) -> None:
    sys.path[:] = [place for place in sys.path if place != str(folder)]
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file is not None and Path(file).is_relative_to(folder):
            del sys.modules[name]
