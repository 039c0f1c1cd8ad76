"""Reference systems of the kind "class": classes of Python, in mbs_models or of the user."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from types import ModuleType
from typing import cast

from slide_fmu.systems.base import LoadError, Parameter, System


def system_of_class(model: str, parameters: Mapping[str, Parameter]) -> System:
    """Make a system from the name of its class.

    Args:
        model: ``"package.module:Class"``, importable in this environment.
        parameters: keyword arguments of the class.

    Raises:
        LoadError: module or class is not there, or the parameters do not fit.
    """
    system_class = _find_class(model)
    accepted = inspect.signature(system_class).parameters
    unknown = sorted(set(parameters) - set(accepted))
    if unknown:
        raise LoadError(
            f"system {model!r}: unknown parameters {unknown}; expected some of "
            f"{sorted(accepted)}: correct or remove them"
        )
    try:
        return system_class(**parameters)
    except (TypeError, ValueError) as error:
        raise LoadError(f"system {model!r} with {dict(parameters)}: {error}") from error


def _find_class(model: str) -> type[System]:
    """Import the class that a dotted name means."""
    if not all(model.partition(":")):
        raise LoadError(
            f"system {model!r}; expected 'package.module:Class', for example "
            "'mbs_models.oscillators:DuffingOscillator'"
        )
    module, class_name = imported(f"system {model!r}", model)
    found = getattr(module, class_name, None)
    if not _is_system(found):
        lacks = sorted(getattr(found, "__abstractmethods__", ()))
        if inspect.isclass(found) and issubclass(found, System) and lacks:
            raise LoadError(f"system {model!r} lacks {lacks}: define what System asks for")
        offered = sorted(name for name, item in vars(module).items() if _is_system(item))
        raise LoadError(
            f"system {model!r}: {class_name!r} is not a reference system in "
            f"{module.__name__!r}; expected one of {offered}"
        )
    return cast(type[System], found)


def _is_system(item: object) -> bool:
    """Whether it is a class of systems that can be made."""
    return inspect.isclass(item) and issubclass(item, System) and not inspect.isabstract(item)


def imported(what: str, name: str) -> tuple[ModuleType, str]:
    """Import the module in ``"package.module:Name"``, and give it with the name behind the colon.

    Raises:
        LoadError: the module, or what it needs, is not installed here; the message begins with
            what names it.
    """
    module_name, _, wanted = name.partition(":")
    try:
        return importlib.import_module(module_name), wanted
    except ImportError as error:
        raise LoadError(
            f"{what}: module {module_name!r} cannot be imported ({error}); expected an "
            "installed module, or one in a folder on PYTHONPATH: check the name, or install what "
            "it needs (the extra 'train' brings exudyn)"
        ) from error
