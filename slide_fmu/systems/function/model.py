"""Reference systems of the kind "function" are made from files with f and g, or with simulate.

The file, or installed module, defines what ``docs/own_model.md`` lists, as plain
variables and functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slide_fmu.systems.base import System
from slide_fmu.systems.declared import (
    DeclaredModel,
    DeclaredParameter,
    ModelFile,
    merged_parameters,
    read_declared,
)
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.function.integration import Solver
from slide_fmu.systems.function.record import RecordSystem
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.function.user_function import with_columns
from slide_fmu.systems.specification import Specification, chosen_outputs, chosen_signals
from slide_fmu.systems.user_code import imported

SOLVER_KEYS = ("method", "rtol", "atol")
"""Keys of a model about its integration, as in ``integration.Solver``."""


def make(specification: Specification) -> System:
    """Make a system from a user's file, here or in the recipe's folder, or from a module.

    Raises:
        LoadError: the file is not there or cannot be run, or lacks a needed definition; the
            parameters do not fit; a range is not known.
    """
    label = f"system {specification.model!r}"
    file, values = read_model(specification.model)
    offered = chosen_outputs(file.outputs, specification.outputs)
    own = specification.step is None and file.step is not None
    common: dict[str, Any] = {
        "inputs": chosen_signals("input", file.inputs, specification.inputs),
        "outputs": chosen_signals("output", offered, specification.outputs),
        "step": file.step if own else specification.sample_step(),
        "parameters": merged_parameters(label, file.parameters, specification.parameters),
    }
    names = list(file.outputs)
    columns = [names.index(name) for name in offered]
    try:
        if "simulate" in values:
            simulate = with_columns("simulate", values["simulate"], len(names), columns)
            return RecordSystem(simulate, **common)
        solver = Solver(**{key: values[key] for key in SOLVER_KEYS if key in values})
        g = with_columns("g", values["g"], len(names), columns)
        return FunctionSystem(values["f"], g, start=values["start"], solver=solver, **common)
    except LoadError as error:
        raise LoadError(f"{label}: {error}") from error


def recognises(model: str) -> bool:
    """Tell whether a model is a Python file or module that defines f or simulate.

    Raises:
        LoadError: it cannot be run.
    """
    if ":" in model:
        return False
    values = vars(imported(f"system {model!r}", model)[0])
    return "f" in values or "simulate" in values


def describe(model: str) -> DeclaredModel:
    """Say what a user's file declares, without making a system of it.

    Raises:
        LoadError: the file is not there or cannot be run, or lacks a needed definition.
    """
    file, _ = read_model(model)
    parameters = tuple(DeclaredParameter(name, value) for name, value in file.parameters.items())
    return DeclaredModel("function", model, parameters, file.inputs, file.outputs, file.step)


def read_model(name: str) -> tuple[ModelFile, Mapping[str, Any]]:
    """Run a user's file; give what it declares, and everything that it defines by name.

    Raises:
        LoadError: the file is not there or cannot be run, or lacks a needed definition.
    """
    label = f"system {name!r}"
    module, wanted = imported(label, name)
    if wanted:
        raise LoadError(
            f"{label}: {wanted!r} behind the colon; expected the file or module alone, all of "
            "which is the model"
        )
    values = vars(module)
    _require_parts(label, values)
    return read_declared(ModelFile, label, values), values


def _require_parts(label: str, values: Mapping[str, Any]) -> None:
    """Refuse a file that lacks a part of a model, or has two models."""
    ways = [name for name in ("f", "simulate") if name in values]
    if len(ways) != 1:
        raise LoadError(
            f"{label} defines {' and '.join(ways) or 'neither f nor simulate'}; expected "
            "f(x, u, p) and g(x, u, p), or simulate(t, u, p)"
        )
    needed = ("inputs", "outputs", *(("g", "start") if ways == ["f"] else ()))
    lacks = [name for name in needed if name not in values]
    if lacks:
        raise LoadError(
            f"{label} does not define {', '.join(lacks)}; expected {', '.join(needed)} with "
            f"{ways[0]}"
        )
