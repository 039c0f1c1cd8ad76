"""The recipe of a reference system that is an object in Python is made of the tables of a call."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from slide_fmu.core.signals import Signal, cosines_of
from slide_fmu.propose.proposal import MOVING, SUBSTEPS, kind_of_inputs
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.default_excitation import default_excitation
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.base import Bending, System

NO_SYSTEM = (
    "slide.learn of {name!r}: system = {found}; expected a reference system, or the table system "
    "of a recipe as a dictionary: make one of functions by slide.FunctionSystem(f, g, inputs=..., "
    "outputs=..., start=..., step=...), or by slide.RecordSystem(simulate, inputs=..., "
    "outputs=..., step=...); of a class, take an object of it"
)


def recipe_tables(
    system: System | Mapping[str, Any], name: str, tables: Mapping[str, Any]
) -> Tables:
    """Return all tables of the recipe; a Python object gets the recipe's name.

    Raises:
        RecipeError: the system is neither a reference system nor a table.
    """
    if not isinstance(system, System | Mapping):
        raise RecipeError(NO_SYSTEM.format(name=name, found=_described(system)))
    recipe: Tables = {"name": name, "description": f"{name}, learnt from Python", **tables}
    recipe.setdefault("data", {})
    if not isinstance(system, System):
        return {**recipe, "system": dict(system)}
    window = {"step": system.step, **recipe.get("window", {})}
    recipe["data"] = _with_excitation(recipe["data"], system, window["step"])
    return {**recipe, "system": {"kind": "object", "model": name}, "window": window}


def _with_excitation(data: Any, system: System, step: Any) -> Any:
    """Return the table ``data`` with the excitation that the inputs of the system need.

    An excitation that is given stays. Only the object itself knows whether its inputs move, or are
    angles; no table of the recipe has this.
    """
    if not isinstance(data, Mapping) or "excitation" in data:
        return data
    signals = getattr(system, "inputs", None)
    sound = isinstance(signals, tuple) and all(isinstance(signal, Signal) for signal in signals)
    number = isinstance(step, float | int) and 0 < step < math.inf
    if not (sound and signals and number):
        return data  # signals and step have their own checks
    widths, kind = [signal.high - signal.low for signal in signals], kind_of_inputs(system)
    bends = kind in MOVING and isinstance(system, Bending)
    substeps = {"substeps": SUBSTEPS} if bends else {}
    jumps = data.get("jumps") is True
    mix = default_excitation(step, kind, widths, bool(cosines_of(signals)), jumps)
    return {**substeps, **data, "excitation": mix}


def _described(system: object) -> str:
    """Describe in one short line what was given in place of a system."""
    text = f"{type(system).__name__} {getattr(system, '__name__', None) or repr(system)}"
    return text if len(text) <= 80 else f"{text[:77]}..."
