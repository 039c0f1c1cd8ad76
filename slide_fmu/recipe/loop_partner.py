"""The partner of a loop can be a model of the user: of any kind that goes on step by step."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache

from slide_fmu.core.search_path import AmbiguousFileError, find_file
from slide_fmu.core.signals import Signal
from slide_fmu.core.suggestions import or_meant
from slide_fmu.core.units import are_other
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.importer.description import is_multiple
from slide_fmu.systems.base import Source, Stepping
from slide_fmu.systems.declared import DeclaredModel, SignalTable, SignalTables
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import describe_model, load_system
from slide_fmu.systems.specification import Specification

KEPT = 32
"""Partners that a process keeps, so that models are not made for each motion."""


@dataclass(frozen=True, eq=False)
class OwnPartner:
    """An OwnPartner is a model that closes a loop.

    Attributes:
        system: the model; it goes by the sample step of the system in the loop.
        input, output: its channels by which the loop goes.
        further: channels of its other inputs.
    """

    system: Stepping
    input: int
    output: int
    further: tuple[int, ...]


def own_partner(
    loop: LoopRecipe, system: Source, values: Sequence[tuple[str, float]]
) -> OwnPartner:
    """Make the partner of a loop around a system.

    Args:
        loop: a table with a ``partner``.
        system: the system, which has the signals of the loop.
        values: values by the names of ``ranges``; those of inputs do not matter.

    Raises:
        LoadError: there is no such model, it cannot go step by step, or names or units do not fit.
    """
    output = next(signal for signal in system.outputs if signal.name == loop.output)
    input = next(signal for signal in system.inputs if signal.name == loop.input)
    ranges = tuple((loop.ranges or {}).items())
    # systems hold a state, so two threads or processes must not step the same one
    at = os.getpid(), threading.get_ident(), _written(str(loop.partner))
    return _made(
        str(loop.partner), loop.through, ranges, tuple(values), (output, input), system.step, at
    )


def _written(model: str) -> int:
    """Return when the file of a model was written, in ns; 0 where none can be found."""
    try:
        return find_file(model).stat().st_mtime_ns
    except (AmbiguousFileError, OSError):
        return 0


@lru_cache(maxsize=KEPT)
def _made(
    model: str,
    through: tuple[str, str] | None,
    ranges: tuple[tuple[str, tuple[float, float]], ...],
    values: tuple[tuple[str, float], ...],
    ends: tuple[Signal, Signal],
    step: float,
    at: tuple[int, int, int],
) -> OwnPartner:
    """Make a partner; ``ends`` are the output that acts on it, and the input that it gives.

    ``at`` are process, thread and version of the file, which a kept partner is made for.
    """
    label = f"partner {model!r}"
    with _named(label):
        declared = describe_model(model)
    inputs = {n: one for n, one in declared.inputs.items() if not declared.inputs_may_be_left_out}
    taken = _port(label, "input", declared.inputs, through and through[0], set(dict(ranges)))
    given = _port(label, "output", declared.outputs, through and through[1], set())
    _require_unit(label, "input", taken, declared.inputs[taken], ends[0])
    _require_unit(label, "output", given, declared.outputs[given], ends[1])
    parameters = _parameters(label, declared, dict(values), taken)
    wanted = {taken: (ends[0].low, ends[0].high), **dict(ranges)}
    # of an FMU, inputs that nobody names keep their start values
    tables = {
        name: SignalTable(hold="first_order", range=wanted.get(name))
        for name in declared.inputs
        if name in wanted or name in inputs
    }
    own_step = declared.held_step
    if own_step is not None and is_multiple(step, own_step):
        parameters["fmu-substeps"] = round(step / own_step)  # it may take no other steps
    read = {given: SignalTable(range=(ends[1].low, ends[1].high))}
    own = declared.kind == "class"  # it declares its signals itself
    made = Specification(
        declared.model, parameters, step, declared.kind, {} if own else tables, {} if own else read
    )
    with _named(label):
        system = load_system(made)
    if not isinstance(system, Stepping):
        raise LoadError(
            f"{label} simulates whole motions only; expected a model that goes on step by step: "
            "give f and g in place of simulate(t, u, p)"
        )
    names = [signal.name for signal in system.inputs]
    column = names.index(taken)
    further = tuple(k for k in range(len(names)) if k != column)
    return OwnPartner(system, column, [s.name for s in system.outputs].index(given), further)


@contextmanager
def _named(label: str) -> Iterator[None]:
    """Say that it is the partner that cannot be used, and not the system."""
    try:
        yield
    except LoadError as error:
        raise LoadError(f"{label}: {error}") from error


def _port(
    label: str, what: str, offered: SignalTables, named: str | None, others: set[str]
) -> str:
    """Return the signal of a partner by which the loop goes, the only one if none is named."""
    known = [name for name in offered if name not in others]
    if named is None and len(known) == 1:
        return known[0]
    if named in offered:
        return str(named)
    given = "through is not given" if named is None else f"through names the {what} {named!r}"
    raise LoadError(
        f'{label}: {given}; expected through = ["INPUT", "OUTPUT"] of the partner, with one of '
        f"its {what}s {list(offered)}{or_meant(named or '', offered)}"
    )


def _require_unit(label: str, what: str, name: str, table: SignalTable, other: Signal) -> None:
    """Refuse a signal in another unit; one whose unit is not known fits all."""
    if are_other(table.unit, other.unit):
        raise LoadError(
            f"{label}: {what} {name!r} is in {table.unit}, and {other.name!r} of the system in "
            f"{other.unit}; expected one unit: convert it in the partner, or correct through"
        )


def _parameters(
    label: str, declared: DeclaredModel, values: dict[str, float], taken: str
) -> dict[str, float]:
    """Return the values of parameters; refuse names that are neither those nor free inputs."""
    known = [parameter.name for parameter in declared.parameters]
    free = [name for name in declared.inputs if name != taken]
    unknown = [name for name in values if name not in (*known, *free)]
    if unknown:
        raise LoadError(
            f"{label}: ranges name {unknown}; expected some of its parameters {known} and other "
            f"inputs {free}: correct them{or_meant(unknown, [*known, *free])}"
        )
    return {name: value for name, value in values.items() if name not in free}
