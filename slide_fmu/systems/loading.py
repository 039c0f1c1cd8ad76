"""This module makes a reference system of any kind from its specification."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import cast

from slide_fmu.core.extras import how_to_install
from slide_fmu.core.signals import check_inputs
from slide_fmu.core.suggestions import or_meant
from slide_fmu.core.units import require_unit
from slide_fmu.systems.base import Source, System
from slide_fmu.systems.contract import check_self_description
from slide_fmu.systems.declared import DeclaredModel
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.specification import Specification

KINDS: dict[str, str] = {
    "fmu": "slide_fmu.systems.fmu.model",
    "class": "slide_fmu.systems.python_class",
    "function": "slide_fmu.systems.function.model",
    "object": "slide_fmu.systems.session_objects",
    "exudyn": "slide_fmu.systems.exudyn.model",
    "record": "slide_fmu.records.model",
}
"""Every kind of reference system by its name in recipes: one module and one entry here.

The module is imported when it is needed: exudyn is, for models of exudyn alone. Its ``make`` takes
a ``Specification`` and gives the system, or the records of one; its ``describe`` takes a model's
name and gives a ``DeclaredModel``; both raise ``LoadError``. Its ``recognises`` says whether a
model is of the kind, without running it where that can be seen from its name. A kind whose models
are no files has neither of the last two, and records have no ``describe``: any column may be an
input or an output.
"""
UNSIMULATED: dict[str, str] = {"record": "slide_fmu.records"}
"""Kinds that are not simulated, with their room: its module ``rules`` has the ``RULES`` of their
recipes (``slide_fmu.recipe.kind_rules``), and ``proposal`` proposes a first one."""
NAMED = sorted(set(KINDS) - {"object"})
"""Kinds that a recipe can name: an object is one of a Python session (``slide.learn``)."""


def load_system(specification: Specification) -> System:
    """Make a system that is simulated.

    Raises:
        LoadError: as in ``load_source``; or there are only records of the system.
    """
    return require_system(load_source(specification), specification.model)


def require_system(source: Source, model: str) -> System:
    """Return a source of a model that can be simulated; a LoadError if there are only records."""
    if not isinstance(source, System):
        raise LoadError(
            f"record {model!r} cannot be simulated; expected a model of the system "
            "here: a record tells what happened, not what would happen under other inputs"
        )
    return source


def load_source(specification: Specification) -> Source:
    """Make a system, or read the records of one.

    Raises:
        LoadError: there is no such kind or model, the parameters do not fit, a system has no
            sample step or no signals, the inputs do not belong together (``check_inputs``), or a
            unit is unknown.
    """
    model = specification.model
    system = cast(Source, kind_module(specification.kind).make(specification))
    if isinstance(system, System):
        check_self_description(system, None, model)
    try:
        check_inputs(system.inputs)
        for signal in (*system.inputs, *system.outputs):
            require_unit(signal.name, signal.unit)
    except ValueError as error:
        raise LoadError(f"system {model!r} with {specification.parameters}: {error}") from error
    return system


def kind_module(kind: str) -> ModuleType:
    """Import the module of a kind, one of ``KINDS``.

    Raises:
        LoadError: there is no such kind, or a package that it needs is not installed.
    """
    if kind not in KINDS:
        raise LoadError(
            f"kind of system {kind!r}; expected one of {NAMED}: correct it{or_meant(kind, NAMED)}"
        )
    try:
        return import_module(KINDS[kind])
    except ModuleNotFoundError as error:
        raise LoadError(
            f"kind of system {kind!r} needs the package {error.name!r}, which is not installed: "
            f"install it (exudyn by {how_to_install('train')})"
        ) from error


def describe_model(model: str, kind: str | None = None) -> DeclaredModel:
    """Return the declarations of a model that has no recipe yet.

    Args:
        model: path of an FMU or a Python file, or ``"package.module:Name"``.
        kind: one of ``KINDS``; the first that recognises the model if None.

    Raises:
        LoadError: there is no such model, or no kind recognises it.
    """
    for name in [kind] if kind is not None else KINDS:
        module = kind_module(name)
        if hasattr(module, "describe") and (kind is not None or module.recognises(model)):
            return cast(DeclaredModel, module.describe(model))
    if ":" in model:  # it can only be a class, and that kind reports its fault
        return cast(DeclaredModel, kind_module("class").describe(model))
    raise LoadError(
        f"model {model!r} is of no known kind; expected an FMU (.fmu), a Python file that defines "
        "a class of systems, f or simulate, or build (see the documentation of your own model), "
        "or 'package.module:Class'"
    )
