"""This module reads users' declarations about a model: signals, parameters and sample step.

Recipes, model files in Python and the descriptions of FMUs share one table of a signal.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Annotated, Any, NoReturn, TypeVar, get_args

import numpy as np
from pydantic import ConfigDict, Field, ValidationError, field_validator

from slide_fmu.core.mistakes import mistakes
from slide_fmu.core.shown import shown
from slide_fmu.core.signals import Angle, Hold, Signal
from slide_fmu.core.suggestions import or_meant
from slide_fmu.core.toml_table import Table
from slide_fmu.systems.errors import LoadError

Parameter = float | int | str | bool
"""Value of a parameter of a reference system, as TOML and JSON know it."""


class SignalTable(Table):
    """A table ``system.inputs.NAME`` or ``system.outputs.NAME`` completes a signal of a model.

    Attributes:
        range: lowest and highest value of the intended range, in ``unit``; the model's if not
            given, and likewise for the keys below.
        unit: unit of the values, as FMI names it (``"N"``, ``"m"``, ``"rad"``).
        description: one line for people.
        start: value before anybody sets one, within the range; the one nearest to 0 if neither the
            recipe nor the model says one.
        hold: how an input acts between samples: ``"zero_order"`` holds it over a step,
            ``"first_order"`` moves it linearly to its next value. All inputs have the same.
        angle: ``"cosine"`` or ``"sine"`` of an input that is the one of an angle; the sine follows
            its cosine, and both turn on the circle between samples.
        period: of an input such as a position on a closed track: values that differ by the period,
            in ``unit``, mean the same. Inputs in rad or deg need none: they repeat after a turn.
        column: for records, the name of the signal's column; the signal's name if not given.
    """

    range: tuple[float, float] | None = None
    unit: str | None = None
    description: str | None = None
    start: float | None = None
    hold: Hold | None = None
    angle: Angle | None = None
    period: float | None = None
    column: str | None = None

    @field_validator("range", mode="wrap")
    @classmethod
    def _low_end_comes_first(cls, value: Any, read: Any) -> tuple[float, float] | None:
        with suppress(ValidationError):
            ends: tuple[float, float] | None = read(value)
            if ends is None or ends[0] < ends[1]:
                return ends
        raise ValueError("expected [LOW, HIGH], two finite numbers, the smaller one first")

    @staticmethod
    def of(signal: Signal) -> SignalTable:
        """Return the complete table of a signal."""
        given = {key: _plain(value) for key, value in vars(signal).items() if key in SIGNAL_KEYS}
        return SignalTable(range=(float(signal.low), float(signal.high)), **given)

    def over(self, other: SignalTable) -> SignalTable:
        """Return this table, with values of the other one where this one has none."""
        return other.model_copy(update=self.model_dump(exclude_none=True))

    def signal(self, label: str, name: str) -> Signal:
        """Give the signal of a name; the label begins messages, for example ``"input"``.

        Raises:
            LoadError: the range is not known, or a value cannot be that of a signal.
        """
        if self.range is None:
            raise LoadError(
                f"{label} {name!r} has no range; expected one in the recipe: add "
                f"system.{label}s.{name}.range = [LOW, HIGH]"
            )
        given = self.model_dump(exclude_none=True, include=SIGNAL_KEYS)
        try:
            return Signal(name, **{"unit": "1", **given}, low=self.range[0], high=self.range[1])
        except ValueError as error:
            raise LoadError(f"{label} {str(error).removeprefix('signal ')}") from error


SIGNAL_KEYS = {"unit", "description", "start", "hold", "angle", "period"}
"""Keys of a ``SignalTable`` that a ``Signal`` has too."""

SignalTables = Mapping[str, SignalTable]
"""Tables of signals by their names, in the order of the signals."""


class ModelFile(Table):
    """A ModelFile holds the declarations of a user's Python file about its model.

    Attributes:
        inputs, outputs: its signals; what it leaves open is None.
        parameters: the values that they have if the recipe gives no others, by name.
        step: sample step h in s that it suggests, or None.
    """

    model_config = ConfigDict(allow_inf_nan=True)

    inputs: Annotated[dict[str, SignalTable], Field(min_length=1)]
    outputs: Annotated[dict[str, SignalTable], Field(min_length=1)]
    parameters: dict[str, Parameter] = Field(default={})
    step: Annotated[float, Field(gt=0)] | None = None

    @field_validator("inputs", "outputs")
    @classmethod
    def _have_no_columns(cls, tables: dict[str, SignalTable]) -> dict[str, SignalTable]:
        named = [name for name, table in tables.items() if table.column is not None]
        if named:
            raise ValueError(f"{named} name columns; expected none: only records have them")
        return tables


File = TypeVar("File", bound=ModelFile)


def read_declared(kind: type[File], label: str, values: Mapping[str, Any]) -> File:
    """Read the declarations of a Python file from all its definitions, by name.

    A signal is its table, or its unit alone; the file's ``hold`` is that of all inputs.

    Args:
        kind: which tables such a file has.
        label: names the model, at the beginning of messages.
        values: everything that the file defines.

    Raises:
        LoadError: the file declares something else; there is one line per mistake.
    """
    declared = {key: _plain(values[key]) for key in kind.model_fields if key in values}
    shared = {"hold": values["hold"]} if "hold" in values else {}
    for name, every in (("inputs", shared), ("outputs", {})):
        if isinstance(declared.get(name), dict):
            tables = declared[name].items()
            declared[name] = {key: {**every, **_table(value)} for key, value in tables}
    try:
        return kind.model_validate(declared)
    except ValidationError as error:
        fields = {name: kind.model_fields[name].annotation for name in ("inputs", "outputs")}
        known = {name: list(get_args(one)[1].model_fields) for name, one in fields.items()}
        raise LoadError(mistakes(error, label, known)) from error


def _plain(value: Any) -> Any:
    """Return numbers of numpy as those of Python, inside tables and lists too."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return value.item() if isinstance(value, np.generic) else value


def _table(value: Any) -> dict[str, Any]:
    """Return the table of a signal, of which its unit alone may be given."""
    return value if isinstance(value, dict) else {"unit": value}


class Parameters(SimpleNamespace):
    """Parameters are attributes, as ``p.name``, for functions and models of the user.

    The error for another name, or for brackets, lists the parameters.
    """

    def __getitem__(self, name: object) -> NoReturn:
        raise TypeError(f"p[{name!r}]; expected p.{name}: parameters are attributes")

    def __getattr__(self, name: str) -> NoReturn:
        known = list(vars(self))
        raise AttributeError(
            f"p has no parameter {name!r}; expected one of {known}{or_meant(name, known)}"
        )


def merged_parameters(
    label: str, declared: Mapping[str, Parameter], given: Mapping[str, Parameter]
) -> dict[str, Parameter]:
    """Give the parameters of a model, with the values of the recipe where it has some.

    Raises:
        LoadError: the model has no such parameter, or one of another type.
    """
    require_known(label, given, declared)
    for name, value in given.items():
        if _sort(value) is not _sort(declared[name]):
            raise LoadError(
                f"{label}: parameter {name} = {shown(value)}; expected the type of the model's "
                f"value, {shown(declared[name])}: correct it",
                name,
            )
    return {**declared, **given}


def require_known(label: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuse parameters that a model does not have.

    Raises:
        LoadError: the message has all of them, and the parameters of the model.
    """
    unknown, known = sorted(set(given) - set(known)), sorted(known)
    if unknown:
        text = f"{label}: unknown parameters {unknown}; expected some of {known}: correct or "
        raise LoadError(f"{text}remove them{or_meant(unknown, known)}", unknown[0])


def _sort(value: Parameter) -> type:
    """Return the type that a value counts as: true and false are no numbers."""
    return float if isinstance(value, float | int) and not isinstance(value, bool) else type(value)


@dataclass(frozen=True)
class DeclaredParameter:
    """A DeclaredParameter is a parameter of a model, with the value that it has."""

    name: str
    value: Parameter
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class DeclaredModel:
    """A DeclaredModel is a model that has no recipe yet, by its declarations.

    Attributes:
        kind: one of ``slide_fmu.systems.loading.KINDS``.
        model: name of the model in a recipe.
        parameters: parameters of the model, in its order.
        inputs, outputs: its signals, in its order; what it leaves open is None.
        step: sample step h in s that the model suggests; None where it suggests none.
        held_step: the step in s by which an importer runs it, its inputs held over it, where a
            co-simulation FMU names one and its inputs are not discrete.
        takes_any_step: whether an importer may choose its steps; of a co-simulation FMU that does
            not, it takes multiples of one step alone.
        remarks: one sentence for each assumption, for people.
        inputs_may_be_left_out: whether a recipe may name some of the inputs alone; the others keep
            their start values.
        limits: least and greatest value of outputs by name, where the model declares one end
            alone; the other one is infinite.
    """

    kind: str
    model: str
    parameters: tuple[DeclaredParameter, ...] = ()
    inputs: SignalTables = field(default_factory=dict)
    outputs: SignalTables = field(default_factory=dict)
    step: float | None = None
    held_step: float | None = None
    takes_any_step: bool = True
    remarks: tuple[str, ...] = ()
    inputs_may_be_left_out: bool = False
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
