"""Reference systems of the kind "exudyn" are built by a function of the user."""

from __future__ import annotations

import inspect

import numpy as np

from slide_fmu.systems.declared import Declared, DeclaredParameter, SignalTable, SignalTables
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.exudyn.plant import raised_in_exudyn
from slide_fmu.systems.exudyn.system import (
    BUILD,
    SOLVER,
    ExudynSystem,
    LinearizableExudynSystem,
    read_model,
)
from slide_fmu.systems.specification import Specification
from slide_fmu.systems.user_code import imported

_ACTS = {
    "load": "is the load of its name",
    "parameter": "sets a parameter of an item",
    "variables": "is read from mbs.variables by user functions",
}
_TRIED_STEP = 0.01
"""Sample step in s with which a model is tried before there is a recipe."""


def make(specification: Specification) -> ExudynSystem | LinearizableExudynSystem:
    """Make a system from the file that builds it, as of ``read_model``.

    The recipe's parameters are those of the file and ``SOLVER``.

    Raises:
        LoadError: the file is not there or lacks something, it raises, parameters do not fit, or
            the model has no load or sensor of a name.
    """
    try:
        system = LinearizableExudynSystem(specification)
        data = system.plant.mbs.systemData
        if data.ODE1Size() + data.DataSize():
            return ExudynSystem(specification)
    except Exception as error:  # a user's model may raise anything
        if isinstance(error, LoadError) and str(error).startswith("system "):
            raise
        own = isinstance(error, LoadError | SimulationError)
        reason = str(error) if own else raised_in_exudyn(error)
        raise LoadError(f"system {specification.model!r}: {reason}") from error
    return system


def recognises(model: str) -> bool:
    """Tell whether a model is a Python file or module that defines a function ``build``.

    Raises:
        LoadError: it cannot be run.
    """
    module, function = imported(f"system {model!r}", model)
    return inspect.isfunction(vars(module).get(function or BUILD))


def describe(model: str) -> Declared:
    """Build a model and say what it declares.

    Raises:
        LoadError: as of ``make``.
    """
    file = read_model(model)
    inputs, outputs = _with_ranges(file.inputs), _with_ranges(file.outputs)
    step = file.step or _TRIED_STEP
    system = make(Specification(model, {}, step, "exudyn", inputs, outputs))
    remarks = [f"input {name} {_ACTS[what]}" for name, what in system.acts.items()]
    system.rest_state(np.array([signal.start_value for signal in system.inputs]))
    values = {**SOLVER, **file.parameters}
    if system.remarks:
        values["start"] = "initial"
        remarks += system.remarks
    parameters = tuple(DeclaredParameter(name, value) for name, value in values.items())
    return Declared(
        "exudyn", model, parameters, file.inputs, file.outputs, file.step, remarks=tuple(remarks)
    )


def _with_ranges(tables: SignalTables) -> dict[str, SignalTable]:
    """Give signals ranges for a first trial where the file leaves them open."""
    found = {}
    for name, table in tables.items():
        start = table.start or 0.0
        ends = table.range or (start - 1.0, start + 1.0)
        found[name] = table.model_copy(update={"range": ends})
    return found
