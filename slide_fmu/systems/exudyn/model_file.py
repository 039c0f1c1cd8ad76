"""The user's file of a model: a function that builds it, and what its signals are called."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, cast

from slide_fmu.systems.base import Parameter
from slide_fmu.systems.declarations import (
    as_table,
    declared_parameters,
    declared_signals,
    declared_step,
)
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.exudyn.wires import InputWire, OutputWire
from slide_fmu.systems.specification import SignalChoice
from slide_fmu.systems.user_code import imported

BUILD = "build"
"""The function that builds the model, where the recipe names no other."""


@dataclass(frozen=True)
class ModelFile:
    """A model file declares a model.

    Attributes:
        build: function of an exudyn system and the parameters, which fills the system.
        inputs, outputs: what it says about its signals, in its order.
        wires: what its inputs act on, and what measures its outputs.
        parameters: the values that they have if the recipe gives no others, by name.
        step: sample step h in s that it suggests, or None.
    """

    build: Callable[[Any, Any], object]
    inputs: tuple[SignalChoice, ...]
    outputs: tuple[SignalChoice, ...]
    wires: tuple[tuple[InputWire, ...], tuple[OutputWire, ...]]
    parameters: Mapping[str, Parameter]
    step: float | None


def read_model(model: str) -> ModelFile:
    """Read ``"file.py"``, ``"file.py:function"``, ``"package.module"`` or the like.

    Raises:
        LoadError: the module cannot be imported, or does not declare what it should.
    """
    what = f"system {model!r}"
    module, function = imported(what, model)
    values = vars(module)
    inputs = declared_signals(what, "inputs", values, ("parameter", "rate_parameter"))
    outputs = declared_signals(what, "outputs", values, ("sensor",))
    tables = {name: as_table(said) for name, said in values["inputs"].items()}
    input_wires = tuple(
        InputWire(name, said.get("parameter"), said.get("rate_parameter"))
        for name, said in tables.items()
    )
    output_wires = tuple(
        _output_wire(name, as_table(said).get("sensor", name))
        for name, said in values["outputs"].items()
    )
    return ModelFile(
        _build_function(what, module, function or BUILD),
        inputs,
        outputs,
        (input_wires, output_wires),
        declared_parameters(what, values),
        declared_step(what, values),
    )


def _build_function(what: str, module: ModuleType, name: str) -> Callable[[Any, Any], object]:
    """Find the function that builds the model."""
    found = getattr(module, name, None)
    remedy = f"expected a function {name}(mbs, p) that fills the exudyn system mbs"
    if not callable(found):
        raise LoadError(f"{what}: {name} = {found!r}; {remedy}: define it, or correct the name")
    signature = inspect.signature(found)
    try:
        signature.bind(None, None)
    except TypeError:
        raise LoadError(f"{what}: {name}{signature}; {remedy}: correct its arguments") from None
    return cast(Callable[[Any, Any], object], found)


def _output_wire(name: str, sensor: str) -> OutputWire:
    """Read ``"sensor"`` or ``"sensor[component]"``."""
    base, bracket, rest = sensor.partition("[")
    if bracket and rest.endswith("]") and rest[:-1].isdigit():
        return OutputWire(name, base, int(rest[:-1]))
    return OutputWire(name, sensor)
