"""Reference systems of the kind "function": a file of the user with f and g, or with simulate.

The file, or installed module, says what ``docs/own_model_function.md`` lists, as plain variables
and functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from slide_fmu.systems.base import Parameter, System
from slide_fmu.systems.declarations import (
    declared_parameters,
    declared_signals,
    declared_step,
    require_parameters,
)
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.found import Found, FoundParameter
from slide_fmu.systems.function.integration import Solver
from slide_fmu.systems.function.record import RecordSystem
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.function.user_function import with_columns
from slide_fmu.systems.specification import (
    SignalChoice,
    Specification,
    chosen_outputs,
    chosen_signals,
)
from slide_fmu.systems.user_code import imported

SOLVER_KEYS = ("method", "rtol", "atol")
"""What a model may say about its integration, as of ``integration.Solver``."""


@dataclass(frozen=True, eq=False)
class Model:
    """A model is what a user's file declares, checked.

    Attributes:
        name: the file or module, as recipes name it.
        inputs, outputs: its signals; what it leaves open is None.
        parameters: their values by name.
        step: sample step h in s that it suggests, or None.
        values: everything that the file defines, by name.
    """

    name: str
    inputs: tuple[SignalChoice, ...]
    outputs: tuple[SignalChoice, ...]
    parameters: Mapping[str, Parameter]
    step: float | None
    values: Mapping[str, Any]


def make(specification: Specification) -> System:
    """Make a system from a user's file: ``"file.py"`` here or beside the recipe, or a module.

    Raises:
        LoadError: the file is not there or cannot be run, or does not say what is needed; the
            parameters do not fit; a range is not known.
    """
    model, what = read_model(specification.model), f"system {specification.model!r}"
    parameters = {**model.parameters, **specification.parameters}
    require_parameters(what, model.parameters, specification.parameters)
    offered = chosen_outputs(model.outputs, specification.outputs)
    signals = {
        "inputs": chosen_signals("input", model.inputs, specification.inputs),
        "outputs": chosen_signals("output", offered, specification.outputs),
    }
    values, step = model.values, specification.step
    common: dict[str, Any] = {**signals, "parameters": parameters}
    common["step"] = model.step if step is None and model.step else specification.sample_step()
    names = [choice.name for choice in model.outputs]
    columns = [names.index(signal.name) for signal in signals["outputs"]]
    try:
        if "simulate" in values:
            simulate = with_columns("simulate", values["simulate"], len(names), columns)
            return RecordSystem(simulate, **common)
        solver = Solver(**{key: values[key] for key in SOLVER_KEYS if key in values})
        g = with_columns("g", values["g"], len(names), columns)
        return FunctionSystem(values["f"], g, start=values["start"], solver=solver, **common)
    except LoadError as error:
        raise LoadError(f"{what}: {error}") from error


def recognises(model: str) -> bool:
    """Tell whether a model is a Python file or module that defines f or simulate.

    Raises:
        LoadError: it cannot be run.
    """
    if model.endswith(".fmu") or ":" in model:
        return False
    values = vars(imported(f"system {model!r}", model)[0])
    return "f" in values or "simulate" in values


def describe(model: str) -> Found:
    """Say what a user's file declares, without making a system of it.

    Raises:
        LoadError: the file is not there or cannot be run, or does not say what is needed.
    """
    found = read_model(model)
    parameters = tuple(FoundParameter(name, value) for name, value in found.parameters.items())
    return Found("function", model, parameters, found.inputs, found.outputs, found.step)


def read_model(name: str) -> Model:
    """Run a user's file and check what it declares.

    Raises:
        LoadError: the file is not there or cannot be run, or does not say what is needed.
    """
    what = f"system {name!r}"
    module, wanted = imported(what, name)
    if wanted:
        raise LoadError(
            f"{what}: {wanted!r} behind the colon; expected the file or module alone, all of "
            "which is the model"
        )
    values = vars(module)
    _require_parts(what, module)
    parameters, step = declared_parameters(what, values), declared_step(what, values)
    inputs, outputs = (declared_signals(what, name, values) for name in ("inputs", "outputs"))
    return Model(name, inputs, outputs, parameters, step, values)


def _require_parts(what: str, module: ModuleType) -> None:
    """Refuse a file that lacks a part of a model, or has two models."""
    values = vars(module)
    ways = [name for name in ("f", "simulate") if name in values]
    if len(ways) != 1:
        raise LoadError(
            f"{what} defines {' and '.join(ways) or 'neither f nor simulate'}; expected "
            "f(x, u, p) and g(x, u, p), or simulate(t, u, p)"
        )
    needed = ("inputs", "outputs", *(("g", "start") if ways == ["f"] else ()))
    lacks = [name for name in needed if name not in values]
    if lacks:
        raise LoadError(
            f"{what} does not define {', '.join(lacks)}; expected {', '.join(needed)} beside "
            f"{ways[0]}"
        )
