"""The user's file of a model: a function that builds it, and what its signals are called."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, cast

from slide_fmu.systems.base import LoadError, Parameter
from slide_fmu.systems.exudyn_solver.wires import InputWire, OutputWire
from slide_fmu.systems.specification import SignalChoice
from slide_fmu.systems.user_code import imported

_OF_SIGNAL = ("unit", "description", "start", "hold", "angle")


@dataclass(frozen=True)
class ModelFile:
    """A model file declares a model.

    Attributes:
        build: function of an exudyn system and the parameters, which fills the system.
        inputs, outputs: what it says about its signals, in its order.
        wires: what its inputs act on, and what measures its outputs.
        parameters: the values that they have if the recipe gives no others, by name.
    """

    build: Callable[[Any, Any], object]
    inputs: tuple[SignalChoice, ...]
    outputs: tuple[SignalChoice, ...]
    wires: tuple[tuple[InputWire, ...], tuple[OutputWire, ...]]
    parameters: Mapping[str, Parameter]


def read_model(model: str) -> ModelFile:
    """Read ``"file.py"``, ``"file.py:function"``, ``"package.module"`` or the like.

    Without a function it is ``build``.

    Raises:
        LoadError: the module cannot be imported, or does not declare what it should.
    """
    what = f"system {model!r}"
    module, function = imported(what, model)
    inputs, outputs = (_table(what, module, name) for name in ("inputs", "outputs"))
    return ModelFile(
        _build_function(what, module, function or "build"),
        tuple(_choice(what, "input", name, said) for name, said in inputs.items()),
        tuple(_choice(what, "output", name, said) for name, said in outputs.items()),
        (
            tuple(InputWire(n, s.get("parameter"), s.get("rate")) for n, s in inputs.items()),
            tuple(_output_wire(n, s.get("sensor", n)) for n, s in outputs.items()),
        ),
        _parameters(what, module),
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


def _table(what: str, module: ModuleType, name: str) -> dict[str, dict[str, Any]]:
    """Read ``inputs`` or ``outputs``: of every signal a dictionary; a text alone is its unit."""
    found = getattr(module, name, None)
    if not (isinstance(found, dict) and found):
        raise LoadError(
            f"{what}: {name} = {found!r}; expected a dictionary with at least one signal and its "
            f'unit, for example {name} = {{"force": "N"}}'
        )
    return {
        str(key): {"unit": value} if isinstance(value, str) else value
        for key, value in found.items()
    }


def _choice(what: str, role: str, name: str, said: object) -> SignalChoice:
    """Read what the file says about one signal."""
    own = ("parameter", "rate") if role == "input" else ("sensor",)
    keys = (*_OF_SIGNAL, "range", *own)
    if not isinstance(said, dict) or not said.get("unit"):
        raise LoadError(
            f"{what}: {role} {name!r} = {said!r}; expected its unit, for example "
            f'"{name}": "m", or a dictionary with "unit" ("1" if it has none)'
        )
    unknown = sorted(set(said) - set(keys))
    if unknown:
        raise LoadError(
            f"{what}: {role} {name!r} has the keys {unknown}; expected some of {sorted(keys)}: "
            "correct or remove them"
        )
    texts = [
        key for key in ("unit", "description", *own) if not isinstance(said.get(key, ""), str)
    ]
    limits = said.get("range", (None, None))
    if texts or not (isinstance(limits, (tuple, list)) and len(limits) == 2):
        raise LoadError(
            f"{what}: {role} {name!r} = {said!r}; expected texts for {['unit', *own]}, and "
            "[LOW, HIGH] for the range"
        )
    return SignalChoice(
        name, low=limits[0], high=limits[1], **{key: said.get(key) for key in _OF_SIGNAL}
    )


def _output_wire(name: str, sensor: str) -> OutputWire:
    """Read ``"sensor"`` or ``"sensor[component]"``."""
    base, bracket, rest = sensor.partition("[")
    if bracket and rest.endswith("]") and rest[:-1].isdigit():
        return OutputWire(name, base, int(rest[:-1]))
    return OutputWire(name, sensor)


def _parameters(what: str, module: ModuleType) -> dict[str, Parameter]:
    """Read ``parameters``; a model may have none."""
    found = getattr(module, "parameters", {})
    fine = isinstance(found, dict) and all(
        isinstance(key, str) and isinstance(value, Parameter) for key, value in found.items()
    )
    if not fine:
        raise LoadError(
            f"{what}: parameters = {found!r}; expected a dictionary of names with numbers, texts "
            'or Booleans, for example parameters = {"mass": 300.0}'
        )
    return dict(found)
