"""A reference system from its dotted name, as recipes and reference FMUs give it."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import cast

from slide_fmu.core.signals import check_inputs
from slide_fmu.systems.base import System

Parameter = float | int | str | bool
"""Value of a constructor argument, as TOML and JSON know it."""


class LoadError(ValueError):
    """A reference system could not be made from its name and parameters."""


def load_system(model: str, parameters: Mapping[str, Parameter]) -> System:
    """Make a system.

    Args:
        model: ``"package.module:Class"``, importable in this environment.
        parameters: keyword arguments of the class.

    Raises:
        LoadError: module or class is not there, the parameters do not fit, or the inputs do not
            belong together (``check_inputs``).
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
        system = system_class(**parameters)
        check_inputs(system.inputs)
        return system
    except (TypeError, ValueError) as error:
        raise LoadError(f"system {model!r} with {dict(parameters)}: {error}") from error


def load_picture(name: str) -> Callable[[System], bytes]:
    """Find the function that draws a system.

    Args:
        name: ``"package.module:function"``, importable in this environment.

    Returns:
        The function, which takes the system and gives the bytes of a PNG file.

    Raises:
        LoadError: the module cannot be imported, or has no such function.
    """
    module_name, _, function = name.partition(":")
    module = _imported(f"picture {name!r}", module_name)
    found = getattr(module, function, None)
    if not callable(found):
        raise LoadError(
            f"picture {name!r}: {module_name!r} has no function {function!r}; expected one that "
            "takes the system and gives the bytes of a PNG file: correct system.picture"
        )
    return cast(Callable[[System], bytes], found)


def _imported(what: str, module_name: str) -> ModuleType:
    try:
        return importlib.import_module(module_name)
    except ImportError as error:
        raise LoadError(
            f"{what}: module {module_name!r} cannot be imported ({error}); expected an "
            "installed module, or one in a folder on PYTHONPATH: check the name, or install what "
            "it needs (the extra 'train' brings exudyn)"
        ) from error


def _find_class(model: str) -> type[System]:
    """Import the class that a dotted name means."""
    module_name, colon, class_name = model.partition(":")
    if not (module_name and colon and class_name):
        raise LoadError(
            f"system {model!r}; expected 'package.module:Class', for example "
            "'mbs_models.oscillators:DuffingOscillator'"
        )
    module = _imported(f"system {model!r}", module_name)
    found = getattr(module, class_name, None)
    if not _is_system(found):
        offered = sorted(name for name, item in vars(module).items() if _is_system(item))
        raise LoadError(
            f"system {model!r}: {class_name!r} is not a reference system in {module_name!r}; "
            f"expected one of {offered}"
        )
    return cast(type[System], found)


def _is_system(item: object) -> bool:
    """Whether it is a class of systems that can be made."""
    return inspect.isclass(item) and issubclass(item, System) and not inspect.isabstract(item)
