"""How what is made from a name is found, and what is said when it is not there."""

from __future__ import annotations

import importlib
from types import ModuleType

Parameter = float | int | str | bool
"""Value of a parameter of a reference system, as TOML and JSON know it."""


class LoadError(ValueError):
    """A reference system could not be made from its name and parameters."""


def imported(what: str, module_name: str) -> ModuleType:
    """Import a module that a recipe names.

    Args:
        what: what names it, for the message.
        module_name: dotted name of the module.

    Raises:
        LoadError: the module, or what it needs, is not installed here.
    """
    try:
        return importlib.import_module(module_name)
    except ImportError as error:
        raise LoadError(
            f"{what}: module {module_name!r} cannot be imported ({error}); expected an "
            "installed module, or one in a folder on PYTHONPATH: check the name, or install what "
            "it needs (the extra 'train' brings exudyn)"
        ) from error
