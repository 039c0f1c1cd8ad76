"""This module proposes inputs and outputs of a first recipe, with ranges and their origins."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from slide_fmu.core.file_kinds import SPREADSHEETS, file_of_another_kind
from slide_fmu.core.signals import LARGEST, Hold
from slide_fmu.core.suggestions import or_meant
from slide_fmu.propose.first_look import FirstLook
from slide_fmu.propose.inputs_file import seen_in_file
from slide_fmu.recipe.recipe import NAME, RecipeError
from slide_fmu.recipe.writing import DraftSignal, recipe_name
from slide_fmu.systems.declared import DeclaredModel, Parameter, SignalTable, SignalTables

MARGIN = 0.2
"""Ranges of outputs are wider than the seen values, by this part of them at both ends."""
NEAR = 1e-6
"""An output passes a declared end by more than this part of its own motion."""
ROUNDING = 1e-6
"""An end that is nearer than this part of its last digit to a rounded one is that."""
ANYWHERE = (-math.inf, math.inf)
"""Ends of an output of which the model declares none."""
MOTION_UNITS = ("m", "mm", "rad", "deg")
"""Inputs in these units are motions, which have no jumps: their hold is of first order."""
FINE = ("function", "fmu")
"""Models of these kinds step more finely than their surrogate, and let inputs move meanwhile."""

IN_FILE = f"Seen in the file of your inputs, and widened by {100 * MARGIN:.0f} % at both ends."
"""Origin of the range of an input that neither the user nor the model gives."""

Ranges = Mapping[str, tuple[float, float] | None]
"""Ranges of inputs by name, in their units; None for the model's range."""
Bands = Mapping[str, tuple[float, float]]
"""Lowest and highest working frequencies in Hz by the names of inputs."""
ALL_OTHERS = ""
"""Stands in ``Bands`` for all inputs that are not named."""


def parse_range(texts: Sequence[str]) -> dict[str, tuple[float, float] | None]:
    """Read inputs of the command line: ``NAME=LOW..HIGH``, or ``NAME`` for the model's range.

    Raises:
        RecipeError: a text has neither form.
    """
    ranges: dict[str, tuple[float, float] | None] = {}
    for text in texts:
        name, given, limits = text.partition("=")
        _require_once("input", name, ranges)
        low, dots, high = limits.partition("..")
        try:
            ranges[name] = (float(low), float(high)) if given else None
        except ValueError:
            ranges[name] = (math.nan, math.nan)
        ends = ranges[name]
        if not name or (ends is not None and not (dots and ends[0] < ends[1])):
            raise RecipeError(
                f"--input {text}; expected NAME=LOW..HIGH with two numbers, the smaller one "
                "first, as in --input road=-0.05..0.05"
            )
        if ends is not None and max(map(abs, ends)) > LARGEST:
            raise RecipeError(
                f"--input {text}; expected a range that is finite, and its width too, with ends "
                f"between -{LARGEST:g} and {LARGEST:g}: narrow it"
            )
    return ranges


def parse_bands(texts: Sequence[str]) -> Bands:
    """Read working frequencies in Hz of the command line: ``LOW..HIGH`` or ``NAME=LOW..HIGH``.

    Raises:
        RecipeError: a text has another form, a name stands twice, or frequencies are not positive.
    """
    bands: dict[str, tuple[float, float]] = {}
    for text in texts:
        before, named, after = text.rpartition("=")
        name = before if named else ALL_OTHERS
        _require_once("band", name, bands)
        low, _, high = after.partition("..")
        try:
            band = float(low), float(high)
        except ValueError:
            band = (math.nan, math.nan)
        if not 0 < band[0] <= band[1] < math.inf or (named and not name):
            raise RecipeError(
                f"--band {text}; expected LOW..HIGH or NAME=LOW..HIGH with two positive "
                "frequencies in Hz, the lower one first, as in --band 10..25"
            )
        bands[name] = band
    return bands


def parse_keys(texts: Sequence[str]) -> dict[str, Parameter]:
    """Read keys of the command line, ``KEY=VALUE``: numbers, true and false, else texts.

    Raises:
        RecipeError: a text has another form, or a key stands twice.
    """
    keys: dict[str, Parameter] = {}
    for text in texts:
        key, named, value = text.partition("=")
        if not named or not key.strip():
            raise RecipeError(f"--read {text}; expected KEY=VALUE, as in --read missing=-9999")
        _require_once("read", key, keys)
        try:
            read = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            read = value
        keys[key.strip()] = read if isinstance(read, bool | int | float | str) else value
    return keys


def draft_inputs(
    declared: DeclaredModel, given: Ranges, hold: Hold | None = None, file: Path | None = None
) -> list[DraftSignal]:
    """Return the inputs of the surrogate, with the user's ranges or the model's.

    Where neither gives one, the range is that of a ``file`` of inputs, and a little wider.

    Inputs without a hold in the model move between samples if the model steps more finely than its
    surrogate; ``hold`` is the user's choice instead.

    If a recipe may leave out inputs of the model, the result has the inputs that the user names,
    in that order; else all inputs of the model in its order.

    Raises:
        RecipeError: a name is not one of the model, a range is not known, or the model declares
            its signals itself.
        RecordError: the file cannot be read, lacks an input, or has a fault.
    """
    if declared.kind == "class":
        _require_declared("input", declared, {name: _ends(r) for name, r in given.items()})
    chosen = _chosen("input", declared, given)
    if not declared.inputs_may_be_left_out:
        chosen = dict(declared.inputs)
    if hold is not None and declared.kind == "class":
        raise RecipeError(
            f"--hold {hold}; expected none: {declared.model} declares how its inputs act, so "
            "change it there"
        )
    if hold is not None:
        chosen = {name: SignalTable(hold=hold).over(table) for name, table in chosen.items()}
    seen = {} if file is None else seen_in_file(file, chosen)
    return [
        _input(name, table, given.get(name), declared.kind, seen.get(name))
        for name, table in chosen.items()
    ]


def on_inputs(declared: DeclaredModel, given: Ranges) -> list[str]:
    """Return remarks on inputs that a recipe leaves out, and on ranges beyond the model's own.

    The names of the given ranges are inputs of the model.
    """
    remarks = list[str]()
    if declared.inputs_may_be_left_out and given:
        for name, table in declared.inputs.items():
            if name not in given:
                remarks.append(
                    f"input {name!r} is not named, so the model keeps its start value"
                    + (
                        ""
                        if table.start is None
                        else f" {table.start:g} {table.unit or ''}".rstrip()
                    )
                    + f"; --input {name}=LOW..HIGH makes it an input of the surrogate"
                )
    for name, ends in given.items():
        own = declared.inputs[name].range
        if ends is not None and own is not None and not own[0] <= ends[0] < ends[1] <= own[1]:
            remarks.append(
                f"input {name!r}: the range {ends[0]:g}..{ends[1]:g} leaves that of the model, "
                f"{own[0]:g}..{own[1]:g}, beyond which it may fail: give a part of that"
            )
    return remarks


def draft_outputs(declared: DeclaredModel, names: Sequence[str]) -> list[DraftSignal]:
    """Return the outputs of the surrogate, without ranges that are still to be found."""
    if declared.kind == "class":
        _require_declared("output", declared, dict.fromkeys(names, ""))
    return [DraftSignal(*pair, "") for pair in _chosen("output", declared, names).items()]


def ranged_outputs(
    outputs: list[DraftSignal],
    seen: FirstLook,
    chosen: bool,
    limits: Mapping[str, tuple[float, float]],
) -> tuple[list[DraftSignal], list[str]]:
    """Return outputs with ranges around the seen values, and remarks on outputs.

    Outputs that never moved are left out, unless the user has chosen them or no output moved.
    Nothing changes if no ranges were to be found (``seen.motions`` is 0). ``limits`` are ends that
    the model declares, infinite where it declares none.
    """
    if not seen.motions:
        return outputs, []
    kept, remarks = [], []
    for index, draft in enumerate(outputs):
        if seen.still[index] and not (chosen or seen.still.all()):
            name = draft.name
            remarks.append(
                f"output {name!r} never moves and is left out; --output {name} keeps it"
            )
        else:
            declared = draft.table.range or limits.get(draft.name, ANYWHERE)
            kept.append(_with_range(draft, seen, index, declared))
            remarks += _on_passed_limits(draft, seen, index, declared)
    return kept, remarks


def require_name(name: str | None) -> None:
    """Refuse an invalid name of a recipe, before anything is simulated or read.

    Raises:
        RecipeError: the name is no C identifier.
    """
    if name is not None and not re.match(NAME, name):
        raise RecipeError(
            f"--name {name!r}; expected a letter, then letters, digits or underscores, 100 "
            f"at most, as in --name {recipe_name(name)}"
        )


def names_of(signals: Iterable[DraftSignal]) -> str:
    """Return the names of signals in one line of text."""
    return ", ".join(signal.name for signal in signals)


def _require_declared(what: str, declarations: DeclaredModel, wanted: Mapping[str, str]) -> None:
    """Refuse to choose signals of a class; ``wanted`` are names with the option of each."""
    if not wanted:
        return
    declared: SignalTables = getattr(declarations, f"{what}s")
    name, option = next(iter(wanted.items()))
    own = ", ".join(f"{one} ({_ends(table.range)})" for one, table in declared.items())
    raise RecipeError(
        f"--{what} {name}{option and f'={option}'}: a class declares its signals itself, and "
        f"{declarations.model!r} has the {what}s {own}; expected no --{what}: leave it out, or "
        f"change self.{what}s in the class"
    )


def _ends(limits: tuple[float, float] | None) -> str:
    return "" if limits is None else f"{limits[0]:g}..{limits[1]:g}"


def require_models(names: Sequence[str]) -> None:
    """Refuse recipes and spreadsheets by their names, before any other message.

    Raises:
        RecipeError: a name belongs neither to a model nor to a measured record.
    """
    for name in names:
        other = file_of_another_kind(name, "a model (.py, .fmu) or a measured record (.csv)")
        if other is not None and Path(name).suffix.lower() in (".toml", *SPREADSHEETS):
            raise RecipeError(f"{name!r} {other}")


def proposed_name(model: str, name: str | None) -> str:
    """Return the name that a recipe for a model or record has; the one given if there is one."""
    return name or recipe_name(Path(model.replace(":", "_")).stem)


def _chosen(what: str, declared: DeclaredModel, names: Iterable[str]) -> dict[str, SignalTable]:
    """Return the inputs or outputs that are named, in that order, else all."""
    offered: SignalTables = getattr(declared, f"{what}s")
    wanted: list[str] = []
    for name in names:
        _require_once(what, name, wanted)
        wanted.append(name)
    unknown = [name for name in wanted if name not in offered]
    if unknown:
        raise RecipeError(
            f"--{what} {unknown[0]}: the model has no such {what}; expected some of "
            f"{list(offered)}{or_meant(unknown[0], offered)}"
        )
    if not offered:
        raise RecipeError(
            f"{declared.model}: the model declares no {what}s; expected at least one: a surrogate "
            "takes inputs and gives outputs"
        )
    return {name: offered[name] for name in wanted or offered}


def _require_once(what: str, name: str, before: Container[str]) -> None:
    """Refuse a signal of the command line that was named before."""
    if name in before:
        raise RecipeError(
            f"--{what} {name} is given twice; expected each {what} once: remove one of them"
        )


def _input(
    name: str,
    table: SignalTable,
    given: tuple[float, float] | None,
    kind: str,
    seen: tuple[float, float] | None,
) -> DraftSignal:
    """Return an input with its range, from the user, from the model, or around a file's values."""
    origin = "The model declares the range."
    if given is None and table.range is None and seen is not None:
        table, origin = _with_given_range(table, widened(*seen), IN_FILE)
    if given is not None:
        table, origin = _with_given_range(table, given, "The range was given.")
    if table.range is None:
        raise RecipeError(
            f"input {name!r} ({table.unit or 'no unit'}): the model declares no range; "
            f"expected one: give --input {name}=LOW..HIGH, or a file of inputs by --inputs"
        )
    if table.hold is None and kind != "class":
        moves = kind in FINE or table.unit in MOTION_UNITS
        hold: Hold = "first_order" if moves else "zero_order"
        table = table.model_copy(update={"hold": hold})
    acts = "" if kind == "class" else _ACTS[table.hold or "zero_order"]
    return DraftSignal(name, table, origin, acts)


_ACTS: dict[Hold, str] = {
    "first_order": (
        "The input goes straight from sample to sample where it does not jump. Is yours constant "
        "over each step, as the output of a controller is? Then write "
        'hold = "zero_order". All inputs need the same hold.'
    ),
    "zero_order": (
        "The input is constant over each step, as the output of a controller is. Is yours smooth? "
        'Then hold = "first_order" is more accurate.'
    ),
}
"""Comment of a recipe for each hold."""


def _with_given_range(
    table: SignalTable, given: tuple[float, float], origin: str
) -> tuple[SignalTable, str]:
    """Return an input with a range that is not the model's, and the comment on it.

    A model's start value is often 0, even if this is out of the range: then the nearest end is
    used.
    """
    start = table.start
    if start is not None and not given[0] <= start <= given[1]:
        origin += f" The model's start value, {start:g}, lies outside, so it starts at its end."
        start = given[0] if start < given[0] else given[1]
    return table.model_copy(update={"range": given, "start": start}), origin


def _with_range(
    draft: DraftSignal, seen: FirstLook, index: int, declared: tuple[float, float]
) -> DraftSignal:
    """Return an output with a range: its own, or one around its values in motions.

    Ends are those that the model declares, or those at rest that no motion passes; the others are
    wider than what was seen.
    """
    if draft.table.range is not None:
        return replace(draft, origin="The model declares the range.")
    low, high = float(seen.low[index]), float(seen.high[index])
    wider, outer = widened(low, high), _outwards(low, high)
    at_rest = bool(seen.low_at_rest[index]), bool(seen.high_at_rest[index])
    ends, reasons = list[float](), list[str]()
    for end, sign in enumerate((-1.0, 1.0)):
        passed = sign * (low, high)[end] > sign * declared[end]
        if math.isfinite(declared[end]) and not passed:
            ends.append(declared[end])
            reasons.append("declared")
        elif at_rest[end] and low < high:
            ends.append(outer[end])
            reasons.append("rest")
        else:
            ends.append(wider[end])
            reasons.append("widened")
    table = draft.table.model_copy(update={"range": (ends[0], ends[1])})
    return DraftSignal(draft.name, table, _origin_of_range(seen, reasons))


def _origin_of_range(seen: FirstLook, reasons: Sequence[str]) -> str:
    """Say where the lower and the upper end of a range come from."""
    count = "one motion" if seen.motions == 1 else f"{seen.motions} motions"
    tones = [f"{frequency:.3g}" for frequency in seen.resonances]
    among = f", among them tones that last at {' and '.join(tones)} Hz" if tones else ""
    texts = {
        "declared": "The model declares {}.",
        "rest": "{} is that at rest under constant inputs, which no motion passed.",
        "widened": f"widened by {100 * MARGIN:.0f} % at {{}}",
    }
    ends = ("the lower end", "the upper end")
    own, other = (
        [ends[k] for k in (0, 1) if (reasons[k] == "widened") is w] for w in (True, False)
    )
    where = "both ends" if len(own) == 2 else own[0] if own else ""
    text = f"Seen in {count}{among}"
    text += f", and {texts['widened'].format(where)}." if own else "."
    for end in other:
        sentence = texts[reasons[ends.index(end)]].format(end)
        text += f" {sentence[0].upper()}{sentence[1:]}"
    return text


def _on_passed_limits(
    draft: DraftSignal, seen: FirstLook, index: int, declared: tuple[float, float]
) -> list[str]:
    """Return a remark on an output that goes beyond ends that the model declares."""
    low, high = float(seen.low[index]), float(seen.high[index])
    near = NEAR * (high - low)
    if declared[0] - near <= low and high <= declared[1] + near:
        return []
    return [
        f"output {draft.name!r} goes from {low:.4g} to {high:.4g}, beyond the range "
        f"{declared[0]:g}..{declared[1]:g} that the model declares: correct one of them"
    ]


def widened(low: float, high: float) -> tuple[float, float]:
    """Return a range a little wider, its ends with two significant digits."""
    margin = MARGIN * (high - low) or max(1.0, abs(high))
    return _rounded_outwards(low - margin, high + margin, 2)


def _outwards(low: float, high: float) -> tuple[float, float]:
    """Return a range that is hardly wider, its ends with some more significant digits."""
    return _rounded_outwards(low, high, 5) if low < high else (low, high)


def _rounded_outwards(low: float, high: float, digits: int) -> tuple[float, float]:
    """Return a range whose width is rounded up to a number of significant digits."""
    places = digits - 1 - math.floor(math.log10(high - low))
    unit = 10.0**-places
    # what is an end of this kind already, but for its rounding, stays
    ends = (
        math.floor(low / unit + ROUNDING),
        math.ceil(high / unit - ROUNDING),
    )
    return round(ends[0] * unit, max(0, places)), round(ends[1] * unit, max(0, places))
