"""A reference system from its name, as recipes and reference FMUs give it, whatever its kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import cast

from slide_fmu.core.signals import check_inputs
from slide_fmu.systems.base import LoadError, Parameter, System
from slide_fmu.systems.python_class import imported, system_of_class

Maker = Callable[[str, Mapping[str, Parameter]], System]
"""Makes a system from its model and its parameters; raises ``LoadError`` where it cannot."""

KINDS: dict[str, Maker] = {"class": system_of_class}
"""Every kind of reference system, by its name in recipes: one module and one entry here."""


def load_system(model: str, parameters: Mapping[str, Parameter], kind: str = "class") -> System:
    """Make a system.

    Args:
        model: what the kind makes a system from; of a class, ``"package.module:Class"``.
        parameters: parameters of the system, its sample step among them.
        kind: one of ``KINDS``.

    Raises:
        LoadError: there is no such kind or model, the parameters do not fit, or the inputs do not
            belong together (``check_inputs``).
    """
    if kind not in KINDS:
        raise LoadError(f"kind of system {kind!r}; expected one of {sorted(KINDS)}")
    system = KINDS[kind](model, parameters)
    try:
        check_inputs(system.inputs)
    except ValueError as error:
        raise LoadError(f"system {model!r} with {dict(parameters)}: {error}") from error
    return system


def load_picture(name: str) -> Callable[[System], bytes]:
    """Find the function that draws a system.

    Args:
        name: ``"package.module:function"``, importable in this environment.

    Returns:
        The function, which takes the system and gives the bytes of a PNG file.

    Raises:
        LoadError: the module cannot be imported, or has no such function.
    """
    module, function = imported(f"picture {name!r}", name)
    found = getattr(module, function, None)
    if not callable(found):
        raise LoadError(
            f"picture {name!r}: {module.__name__!r} has no function {function!r}; expected one "
            "that takes the system and gives the bytes of a PNG file: correct system.picture"
        )
    return cast(Callable[[System], bytes], found)
