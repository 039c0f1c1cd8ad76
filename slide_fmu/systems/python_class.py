"""This module makes reference systems of the kind "class" from Python classes."""

from __future__ import annotations

import inspect
from types import ModuleType
from typing import cast

from slide_fmu.core.suggestions import or_meant
from slide_fmu.systems.base import System
from slide_fmu.systems.contract import check_self_description
from slide_fmu.systems.declared import DeclaredModel, DeclaredParameter, SignalTable, require_known
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.specification import Specification
from slide_fmu.systems.user_code import error_text, imported, refuse_other_file


def make(specification: Specification) -> System:
    """Make a system from the name of its class, ``"package.module:Class"`` or ``"file.py:Class"``.

    The parameters and the sample step are the keyword arguments of the class.

    Raises:
        LoadError: module or class is missing, or the parameters do not fit.
    """
    model, system_class = specification.model, _find_class(specification.model)
    if specification.inputs or specification.outputs:
        raise LoadError(
            f"system {model!r}: system.inputs or system.outputs of the recipe; expected none, "
            "since a class declares its own signals: remove them"
        )
    arguments: dict[str, object] = dict(specification.parameters)
    require_known(f"system {model!r}", arguments, inspect.signature(system_class).parameters)
    if specification.step is not None:
        arguments["step"] = specification.step
    try:
        return system_class(**arguments)
    except (Exception, SystemExit) as error:  # a user's class may raise anything, and end
        raise LoadError(f"system {model!r} with {arguments}: {error_text(error)}") from error


def recognises(model: str) -> bool:
    """Tell whether a model is a class, or a file or module that defines a class of systems.

    Raises:
        LoadError: it cannot be run.
    """
    module, name = imported(f"system {model!r}", model)
    return inspect.isclass(getattr(module, name, None)) if name else bool(_classes_of(model))


def describe(model: str) -> DeclaredModel:
    """Return the declarations of a class: its parameters with their defaults, and its signals.

    A file or module without the name of a class stands for the only class of systems in it.

    Raises:
        LoadError: there is no such class, or it cannot be made with its defaults.
    """
    if ":" not in model:
        names = _classes_of(model)
        if len(names) != 1:
            raise LoadError(
                f"system {model!r} defines the classes of systems {names}; expected one: name it, "
                f"as in '{model}:{names[0] if names else 'Class'}'"
            )
        model = f"{model}:{names[0]}"
    declared = inspect.signature(_find_class(model)).parameters
    defaults = {
        name: item.default
        for name, item in declared.items()
        if isinstance(item.default, float | int | str | bool)
    }
    given = defaults.pop("step", None)
    step = float(given) if given else None
    system = make(Specification(model, step=step or 1.0 if "step" in declared else None))
    check_self_description(system, step, model)
    inputs, outputs = (
        {signal.name: SignalTable.of(signal) for signal in signals}
        for signals in (system.inputs, system.outputs)
    )
    parameters = tuple(DeclaredParameter(name, value) for name, value in defaults.items())
    suggested = system.step if step or "step" not in declared else None
    return DeclaredModel("class", model, parameters, inputs, outputs, suggested)


def _classes_of(model: str) -> list[str]:
    """Return the names of classes of systems that a file or module defines itself.

    Classes that lack methods count where there are no others: then a message names those methods.
    """
    module, _ = imported(f"system {model!r}", model)
    own = {
        name: item
        for name, item in vars(module).items()
        if inspect.isclass(item)
        and issubclass(item, System)
        and item.__module__ == module.__name__
    }
    whole = sorted(name for name, item in own.items() if _is_system(item))
    return whole or sorted(own)


def _find_class(model: str) -> type[System]:
    """Import the class that a dotted name means."""
    if not all(model.partition(":")):
        refuse_other_file(f"system {model!r}", model)
        raise LoadError(
            f"system {model!r}; expected 'package.module:Class', for example "
            "'mbs_models.oscillators:DuffingOscillator'; a model that is no class has another "
            "system.kind: function, exudyn or fmu"
        )
    module, class_name = imported(f"system {model!r}", model)
    system_class = getattr(module, class_name, None)
    if not _is_system(system_class):
        raise LoadError(f"system {model!r}: {_why_none(module, class_name, system_class)}")
    return cast(type[System], system_class)


def _why_none(module: ModuleType, name: str, named: object) -> str:
    """Say why a name of a module is not a usable reference system."""
    lacks = sorted(getattr(named, "__abstractmethods__", ()))
    if inspect.isclass(named) and issubclass(named, System) and lacks:
        asks = ", ".join(base.__name__ for base in named.__bases__)
        return f"{name} lacks the methods {', '.join(lacks)}, which {asks} asks for: define them"
    own = sorted(key for key, item in vars(module).items() if _is_system(item))
    if named is None:
        classes = [key for key, item in vars(module).items() if inspect.isclass(item)]
        return f"there is no {name!r}; expected {_one_of(own)}{or_meant(name, classes)}"
    return (
        f"{name!r} does not inherit slide_fmu.System; expected {_one_of(own)}: inherit it and "
        "define simulate, or inherit slide_fmu.Stepping and define begin, output and advance"
    )


def _one_of(classes: list[str]) -> str:
    """Name the classes of a module that could be meant."""
    return f"one of {classes}" if classes else "a class of reference systems"


def _is_system(item: object) -> bool:
    """Tell whether it is a class of systems that can be made."""
    return inspect.isclass(item) and issubclass(item, System) and not inspect.isabstract(item)
