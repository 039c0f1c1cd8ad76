"""The user's file of an exudyn model has a function that builds it, and names its signals."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Annotated, Any, cast

from pydantic import Field

from slide_fmu.systems.declared import ModelFile, read_declared
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.exudyn.wires import InputTable, OutputTable
from slide_fmu.systems.user_code import imported

BUILD = "build"
"""The function that builds the model, where the recipe names no other."""


class Tables(ModelFile):
    """An exudyn model's file says more about its signals than other files."""

    inputs: Annotated[dict[str, InputTable], Field(min_length=1)]  # type: ignore[assignment]
    outputs: Annotated[dict[str, OutputTable], Field(min_length=1)]  # type: ignore[assignment]


@dataclass(frozen=True)
class ExudynFile:
    """An exudyn file is the function that builds a model, and what the file declares.

    Attributes:
        build: function of an exudyn system and the parameters, which fills the system.
        tables: its signals, parameters and step.
    """

    build: Callable[[Any, Any], object]
    tables: Tables


def read_model(model: str) -> ExudynFile:
    """Read ``"file.py"``, ``"file.py:function"``, ``"package.module"`` or the like.

    Raises:
        LoadError: the module cannot be imported, or does not declare what it should.
    """
    label = f"system {model!r}"
    module, function = imported(label, model)
    tables = read_declared(Tables, label, vars(module))
    return ExudynFile(_build_function(label, module, function or BUILD), tables)


def _build_function(label: str, module: ModuleType, name: str) -> Callable[[Any, Any], object]:
    """Find the function that builds the model."""
    found = getattr(module, name, None)
    remedy = f"expected a function {name}(mbs, p) that fills the exudyn system mbs"
    if not callable(found):
        raise LoadError(f"{label}: {name} = {found!r}; {remedy}: define it, or correct the name")
    signature = inspect.signature(found)
    try:
        signature.bind(None, None)
    except TypeError:
        raise LoadError(f"{label}: {name}{signature}; {remedy}: correct its arguments") from None
    return cast(Callable[[Any, Any], object], found)
