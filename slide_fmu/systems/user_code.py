"""This module imports models as code of the user; errors name file and line."""

from __future__ import annotations

import importlib
import importlib.machinery
import os
import sys
import traceback
import zlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from slide_fmu.core.extras import how_to_install
from slide_fmu.core.file_kinds import file_of_another_kind
from slide_fmu.core.search_path import AmbiguousFileError, neighbours
from slide_fmu.core.search_path import find_file as core_find_file
from slide_fmu.systems.errors import LoadError

PACKAGE = f"{Path(__file__).parents[1]}{os.sep}"


def imported(label: str, name: str) -> tuple[ModuleType, str]:
    """Import the module in ``"package.module:Name"``, and give it with the name behind the colon.

    The module may also be a file, as in ``"model.py:Name"``; ``find_file`` says where it may lie.

    Raises:
        LoadError: the module, or what it needs, is not installed here, or running it fails; the
            message begins with what names it.
    """
    module_name, _, wanted = name.partition(":")
    if not _is_module(module_name):
        refuse_other_file(label, module_name)
        raise LoadError(
            f"{label}: {module_name!r} is no name of a module; expected a Python file (.py), an "
            "FMU (.fmu), or a module as in 'package.module': check the name"
        )
    try:
        if module_name.endswith(".py"):
            return _module_of_file(find_file(label, module_name)), wanted
        _require_own(label, module_name)
        return importlib.import_module(module_name), wanted
    except LoadError:
        raise
    except ModuleNotFoundError as error:
        if error.name is not None and module_name.startswith(error.name):
            refuse_other_file(label, module_name)
            raise LoadError(
                f"{label}: module {module_name!r} cannot be imported ({error}); expected an "
                "installed module, or one in the recipe's folder or in a folder on PYTHONPATH: "
                "check the name"
            ) from error
        raise LoadError(
            f"{label}: {error_text(error)}: correct the name of the import, or install what it "
            f"needs (exudyn by {how_to_install('train')})"
        ) from error
    except (Exception, SystemExit) as error:  # a user's module may raise anything, and end
        raise LoadError(f"{label}: {error_text(error)}; correct the model") from error


def imported_function(label: str, name: str, expected: str) -> Callable[..., Any]:
    """Import the function in ``"package.module:function"`` or ``"file.py:function"``.

    ``expected`` says what it takes and returns.

    Raises:
        LoadError: the module cannot be imported, or has no such function; the message begins with
            what names it.
    """
    module, function = imported(label, name)
    value = getattr(module, function, None)
    if not callable(value):
        raise LoadError(
            f"{label}: {module.__name__!r} has no function {function!r}; expected one that "
            f"{expected}: correct the name"
        )
    return cast(Callable[..., Any], value)


def _require_own(label: str, name: str) -> None:
    """Refuse a module of which this process already uses another one, from another file."""
    places: list[str] | None = None
    parts = name.split(".")
    for count in range(1, len(parts) + 1):
        module = ".".join(parts[:count])
        spec = importlib.machinery.PathFinder.find_spec(module, places)
        if spec is None:
            return
        used = getattr(sys.modules.get(module), "__file__", None)
        if used and spec.origin and Path(used).resolve() != Path(spec.origin).resolve():
            raise LoadError(
                f"{label}: module {module!r} is in {spec.origin!r}, but this process has "
                f"loaded another one of this name, {used!r}; expected one: rename one of them, or "
                "use two processes"
            )
        places = list(spec.submodule_search_locations or ())


def refuse_other_file(label: str, name: str) -> None:
    """Refuse a file that is no model in Python by its name, with a LoadError of this label."""
    other = file_of_another_kind(name, "an FMU (.fmu), a Python file (.py) or a measured record")
    if other is not None and not name.endswith(".py"):
        raise LoadError(f"{label}: {name!r} {other}") from None


def _is_module(name: str) -> bool:
    """Tell whether a name is that of a Python file, or of a module that could be imported."""
    if name.endswith(".py"):
        return True
    another_file = "." in name and Path(name).is_file()
    return not another_file and all(part.isidentifier() for part in name.split("."))


def find_file(label: str, name: str) -> Path:
    """Find a file of the user: a path from here, or from a folder in which modules are looked for.

    The folder of the recipe is one of those.

    Raises:
        LoadError: there is no such file, or another one here; the message begins with what names
            it.
    """
    try:
        return core_find_file(name)
    except (AmbiguousFileError, FileNotFoundError) as error:
        raise LoadError(f"{label}: {error}") from error


def error_text(error: BaseException) -> str:
    """Describe an exception of a user's code, with its innermost line outside of this package."""
    name = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if isinstance(error, SyntaxError) and error.filename:
        return f"{name.split(' (')[0]} ({error.filename}, line {error.lineno})"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if _is_users(frame.filename)]
    return f"{name} ({own[-1].filename}, line {own[-1].lineno})" if own else name


def _is_users(filename: str) -> bool:
    """Tell whether a file is the user's, not of this package, installed or of Python's own.

    Code that was made on the way, as of dataclasses, has a name in angle brackets for its file.
    """
    inner = (PACKAGE, "<", f"{Path(importlib.__file__).parents[1]}{os.sep}")
    return not (filename.startswith(inner) or "site-packages" in filename)


def _module_of_file(path: Path) -> ModuleType:
    """Run a file as a module of its own, once in every process and again where it has changed."""
    number = zlib.crc32(content := path.read_bytes(), zlib.crc32(str(path).encode()))
    name = f"slide_fmu_model_{number:x}_{path.stem}"
    if name in sys.modules:
        return sys.modules[name]
    module = sys.modules[name] = ModuleType(name)
    module.__file__ = str(path)
    try:
        # Python's own loader would take what it compiled of a former file of the same second
        with neighbours(path):
            exec(compile(content, path, "exec", dont_inherit=True), vars(module))
    except BaseException:
        del sys.modules[name]
        raise
    return module
