"""What a user's file declares about its model, as plain variables: signals, parameters, step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slide_fmu.core.suggestions import or_meant
from slide_fmu.systems.base import Parameter
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.specification import SignalChoice

SIGNAL_KEYS = ("unit", "range", "description", "start", "hold", "angle")
"""What a model may say about a signal: the keys that the recipe's tables have too."""


def declared_signals(
    what: str, name: str, values: Mapping[str, Any], more_keys: tuple[str, ...] = ()
) -> tuple[SignalChoice, ...]:
    """Give the signals of a table, whose values are units, or tables of all that is known.

    Args:
        what: names the model, at the beginning of messages.
        name: ``"inputs"``, which have the ``hold`` of the file, or ``"outputs"``.
        values: everything that the file defines, by name.
        more_keys: what the kind of the model knows beside ``SIGNAL_KEYS``; texts.

    Raises:
        LoadError: the table is missing or empty, or is not what it should be.
    """
    table = values.get(name)
    _require_table(what, name, table, 'for example {"position": "m"}')
    assert isinstance(table, dict)
    if not table:
        raise LoadError(f"{what}: {name} = {{}}; expected at least one signal")
    shared = {"hold": values["hold"]} if name == "inputs" and "hold" in values else {}
    return tuple(
        _signal(f"{what}: {name}[{key!r}]", key, {**shared, **as_table(value)}, more_keys)
        for key, value in table.items()
    )


def as_table(value: object) -> dict[str, Any]:
    """Give the table of a signal, of which its unit alone may be given."""
    return value if isinstance(value, dict) else {"unit": value}


def declared_parameters(what: str, values: Mapping[str, Any]) -> dict[str, Parameter]:
    """Give the parameters of a file, which may have none; ``values`` are all that it defines.

    Raises:
        LoadError: it is no table of parameters.
    """
    parameters = values.get("parameters", {})
    _require_table(what, "parameters", parameters, 'for example {"mass": 300.0}')
    for key, value in parameters.items():
        if not isinstance(value, float | int | str):
            raise LoadError(
                f"{what}: parameters[{key!r}] = {value!r}; expected a number, a text, or a "
                "true or false"
            )
    return dict(parameters)


def declared_step(what: str, values: Mapping[str, Any]) -> float | None:
    """Give the sample step h in s that a file suggests, or None.

    Raises:
        LoadError: it is no positive number.
    """
    step = values.get("step")
    if step is not None and not (isinstance(step, float | int) and step > 0):
        raise LoadError(f"{what}: step = {step!r}; expected a positive sample step in s")
    return step


def require_parameters(
    what: str, declared: Mapping[str, Parameter], given: Mapping[str, Parameter]
) -> None:
    """Refuse parameters that a model has not, and texts, or true and false, for numbers.

    Raises:
        LoadError: one does not fit.
    """
    unknown = sorted(set(given) - set(declared))
    if unknown:
        raise LoadError(
            f"{what}: unknown parameters {unknown}; expected some of {sorted(declared)}: correct "
            f"or remove them{or_meant(unknown, declared)}"
        )
    for name, value in given.items():
        if _sort(value) is not _sort(declared[name]):
            raise LoadError(
                f"{what}: parameter {name} = {value!r}; expected one like that of the model, "
                f"{declared[name]!r}: correct its type"
            )


def _sort(value: Parameter) -> type:
    """Return the type that a value counts as: true and false are no numbers."""
    return float if isinstance(value, float | int) and not isinstance(value, bool) else type(value)


def _require_table(what: str, name: str, table: object, example: str) -> None:
    if not (isinstance(table, dict) and all(isinstance(key, str) for key in table)):
        raise LoadError(f"{what}: {name} = {table!r}; expected names with values, {example}")


def _signal(
    what: str, name: str, said: dict[str, Any], more_keys: tuple[str, ...]
) -> SignalChoice:
    """Give one signal from what a model says about it."""
    texts = [said.get(key, "") for key in ("unit", *more_keys)]
    unknown = sorted(set(said) - {*SIGNAL_KEYS, *more_keys})
    if unknown or not all(isinstance(text, str) for text in texts):
        keys = [*SIGNAL_KEYS, *more_keys]
        raise LoadError(f"{what} = {said}; expected a unit, or a table with some of {keys}")
    limits = said.get("range", (None, None))
    if not (isinstance(limits, list | tuple) and len(limits) == 2):
        raise LoadError(f"{what}: range = {limits!r}; expected [LOW, HIGH]")
    numbers = all(isinstance(end, float | int) for end in limits)
    if numbers and not limits[0] < limits[1]:
        raise LoadError(
            f"{what}: range = {list(limits)}; expected [LOW, HIGH], the smaller number first"
        )
    given = {key: said[key] for key in SIGNAL_KEYS if key in said and key != "range"}
    return SignalChoice(name, low=limits[0], high=limits[1], **given)
