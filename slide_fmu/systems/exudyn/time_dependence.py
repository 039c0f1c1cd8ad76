"""A model whose user functions read the time is found by letting it begin at several times.

Each sample step is integrated from t = 0, so such a model would be another one here. What matters
is what it does: one step from the same state, begun at another time, must lead to the same place.
"""

from __future__ import annotations

import dis
import inspect
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.exudyn.wired_system import WiredPlant
from slide_fmu.systems.exudyn.wires import Wires

BEGINNINGS = 8
"""Number of times at which a step is begun."""
FARTHER = 5.37
"""Each is this number of times as late as the one before, which is no multiple of a period."""
NOTICED = 1e-4
"""Differences are noticed from this part of what inputs do in the same step."""
ROUNDED = 1e-9
"""Below this part of coordinates and outputs, or of 1, differences are rounding."""
SHOWN = 1000
"""Number of samples in which a refused model shows how much its outputs move."""


def require_no_time(
    model: WiredPlant, inputs: tuple[Signal, ...], outputs: tuple[Signal, ...]
) -> None:
    """Refuse a model that depends on time; it must be at its initial configuration, and stays so.

    A model without user functions cannot, and is not tried. Where it fails, its motions will tell.

    Raises:
        LoadError: the message has how far outputs move, and which functions read the time.
    """
    functions = list(_user_functions(model.plant.mbs))
    if not functions:
        return
    start = np.array([signal.start_value for signal in inputs])
    still = _after_step(model, start, 0.0)
    if still is None:
        return
    size, step = len(model.plant.origin), model.plant.step
    ends = [np.array([getattr(signal, end) for signal in inputs]) for end in ("low", "high")]
    acted = [one for one in (_after_step(model, end, 0.0) for end in ends) if one is not None]
    for k in range(BEGINNINGS):
        later = _after_step(model, start, step * FARTHER**k)
        if later is None:
            continue
        for part in (slice(0, 2 * size), slice(2 * size, None)):
            rounded = ROUNDED * max(1.0, _largest(still[part]))
            moved = max((_largest(one[part] - still[part]) for one in acted), default=0.0)
            if _largest(later[part] - still[part]) > max(NOTICED * moved, rounded):
                raise LoadError(_refusal(model, start, outputs, functions))


def _after_step(model: WiredPlant, held: FloatArray, begin: float) -> FloatArray | None:
    """Return coordinates, velocities times h, and outputs after one step from the start.

    It is None if the model fails.
    """
    plant = model.plant
    model.wires.hold(held)
    at_rest = np.zeros(len(plant.origin))
    try:
        coordinates, velocities = plant.after_step(plant.origin, at_rest, begin)
    except SimulationError:
        return None
    state = np.concatenate([coordinates, plant.step * velocities])
    return np.append(state, model.wires.read())


def _largest(values: FloatArray) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _refusal(
    model: WiredPlant,
    start: FloatArray,
    outputs: tuple[Signal, ...],
    functions: list[tuple[str, Callable[..., Any]]],
) -> str:
    """Say how far outputs move under constant inputs with time, and which functions do it."""
    plant, rows = model.plant, [model.wires.read()]
    model.wires.hold(start)
    coordinates, velocities = plant.origin, np.zeros(len(plant.origin))
    with suppress(SimulationError):  # what is shown goes as far as it goes
        for k in range(SHOWN):
            coordinates, velocities = plant.after_step(coordinates, velocities, k * plant.step)
            rows.append(model.wires.read())
    table = np.array(rows[1:] or rows)
    moves = [
        f"{signal.name} goes from {low:.3g} to {high:.3g} {signal.unit}".rstrip()
        for signal, low, high in zip(outputs, table.min(axis=0), table.max(axis=0), strict=True)
    ]
    readers = [where for where, function in functions if _reads_time(function)]
    named = ", ".join(readers) or "a user function (perhaps by mbs.systemData.GetTime())"
    return (
        f"its outputs depend on time: under constant inputs, {', '.join(moves)} within "
        f"{len(table) * plant.step:.4g} s, and {named} read{'s' * (len(readers) < 2)} t; expected "
        "outputs that follow from inputs and states alone: make what depends on time an input, "
        "which the function reads from mbs.variables, or leave it out"
    )


def _user_functions(mbs: Any) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Give the user functions of loads, objects and sensors, each with what it belongs to.

    Those by which moving inputs act are not the user's.
    """
    data = mbs.systemData
    for kind in ("Load", "Object", "Sensor"):
        for index in range(getattr(data, f"NumberOf{kind}s")()):
            item = getattr(mbs, f"Get{kind}")(index)
            for key, value in item.items():
                if key.endswith("UserFunction") and "raphics" not in key and value:
                    function = value["function"] if isinstance(value, dict) else value
                    name = getattr(function, "__name__", key)
                    if getattr(function, "__module__", None) != Wires.__module__:
                        owner = f"{kind.lower()} {item['name']!r}"
                        yield f"function {name!r} of {owner}", function


def _reads_time(function: Callable[..., Any]) -> bool:
    """Tell whether a user function may use its second argument, which is the time in s."""
    inner = getattr(function, "__func__", function)
    code = getattr(inner, "__code__", None)
    if code is None:  # nobody can look into it
        return True
    place = 1 + (inner is not function)
    if code.co_argcount <= place:
        return bool(code.co_flags & inspect.CO_VARARGS)
    name = code.co_varnames[place]
    read = [one.argval for one in dis.get_instructions(code) if "LOAD" in one.opname]
    return any(name == each or (isinstance(each, tuple) and name in each) for each in read)
