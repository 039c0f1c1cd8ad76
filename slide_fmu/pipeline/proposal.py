"""A first recipe is proposed for a model: what it declares is found, the rest is assumed."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import Signal, hold_of
from slide_fmu.data.apart import guarded
from slide_fmu.pipeline.first_look import FirstLook, Looking, look, quiet
from slide_fmu.pipeline.job import make_importable
from slide_fmu.pipeline.proposed_chain import are_angles, proposed_chain
from slide_fmu.recipe.default_excitation import default_excitation, set_point_excitation
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import Draft, DraftSignal, recipe_name, recipe_text
from slide_fmu.systems.base import System, chain_of
from slide_fmu.systems.found import Found
from slide_fmu.systems.loading import describe_model, load_system
from slide_fmu.systems.specification import SignalChoice, Specification

MARGIN = 0.2
"""Ranges of outputs are wider than what was seen, by this part of it at both ends."""
MOVING = ("m", "mm", "rad", "deg")
"""Inputs in these units are motions, which have no jumps: their hold is of first order."""
FIRST_STEP = 0.01
"""A model without a step is made with this one, in s, to see what it offers."""
UNSEEN = (-1.0, 1.0)
"""Outputs whose range is still to be found are made with this one, which nothing depends on."""


@dataclass(frozen=True)
class Wish:
    """A Wish is what the user said about the recipe to be.

    Attributes:
        model: path of an FMU or a Python file, or ``"package.module:Class"``.
        inputs: ranges of inputs by name, None where the model shall say it; the surrogate has
            these inputs in this order, or all of the model if there are none here.
        outputs: names of the outputs, likewise.
        kind: kind of the system; found out if None.
        step: sample step in s; found out if None.
        name: name of the recipe; that of the model if None.
        folder: folder of the recipe to be, from which its model is found.
        chain: URDF of the robot whose joints' set points the inputs are; the only one beside the
            model if None, where it fits.
    """

    model: str
    inputs: Mapping[str, tuple[float, float] | None] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    kind: str | None = None
    step: float | None = None
    name: str | None = None
    folder: Path = Path()
    chain: Path | None = None


@dataclass(frozen=True)
class Proposal:
    """A Proposal is a first recipe, and what was found and assumed on the way.

    Attributes:
        text: the recipe as TOML.
        draft: what it says.
        remarks: one sentence each on what was assumed.
    """

    text: str
    draft: Draft
    remarks: tuple[str, ...]


def propose(wish: Wish, progress: Progress) -> Proposal:
    """Propose a recipe for a model, which is simulated for some seconds.

    Raises:
        LoadError: the model cannot be made.
        RecipeError: the range of an input is not known, a name is not one of the model, or the
            inputs are not the set points of the chain that is given.
        UrdfError: that chain cannot be read.
        SimulationError: the model could not be simulated, or crashed.
    """
    make_importable(Path(wish.model).parent)
    found = describe_model(wish.model, wish.kind)
    own = found.kind == "class"
    inputs = [_input(choice, wish, own) for choice in _chosen("input", found, wish)]
    outputs = [DraftSignal(choice, "") for choice in _chosen("output", found, wish)]
    chain = proposed_chain(found.model, wish.chain, [signal.choice for signal in inputs])
    specification = _specification(found, inputs, outputs, wish.step)
    system = load_system(replace(specification, step=specification.step or FIRST_STEP))
    set_points = chain.path is not None or _has_set_points(system)
    make_tables = partial(_tables, system.inputs, set_points)
    looking = Looking(specification, _origin(wish), None if own else make_tables)
    seen = guarded(
        system, (found.model, found.kind), look, looking, quiet if system.may_crash else progress
    )
    name = wish.name or recipe_name(Path(found.model.replace(":", "_")).stem)
    draft = Draft(
        name,
        f"{name}: inputs {_names(inputs)}, outputs {_names(outputs)}",
        replace(found, model=_from_folder(found.model, wish.folder)),
        tuple(inputs),
        tuple(outputs if own else _with_ranges(outputs, seen)),
        seen.step,
        seen.origin,
        make_tables(seen.step),
        declares_signals=own,
        set_points=set_points,
        chain=None if chain.path is None else _from_folder(str(chain.path), wish.folder),
    )
    told = [] if chain.remark is None else [chain.remark]
    return Proposal(recipe_text(draft), draft, (*found.remarks, *told, *seen.remarks))


def _has_set_points(system: System) -> bool:
    """Whether the inputs of a system are set points of drives: of its chain, or all angles."""
    return chain_of(system) is not None or are_angles(system.inputs)


def _tables(
    inputs: tuple[Signal, ...], set_points: bool, step: float
) -> Sequence[Mapping[str, Any]]:
    """Return the tables of the excitation for a sample step in s."""
    if set_points:
        return set_point_excitation(step, [signal.high - signal.low for signal in inputs])
    return default_excitation(step, hold_of(inputs) == "first_order")


def parse_range(texts: Sequence[str]) -> dict[str, tuple[float, float] | None]:
    """Read inputs of the command line: ``NAME=LOW..HIGH``, or ``NAME`` for the model's range.

    Raises:
        RecipeError: a text is neither of them.
    """
    found: dict[str, tuple[float, float] | None] = {}
    for text in texts:
        name, given, limits = text.partition("=")
        low, dots, high = limits.partition("..")
        try:
            found[name] = (float(low), float(high)) if given else None
        except ValueError:
            found[name] = (math.nan, math.nan)
        ends = found[name]
        if not name or (ends is not None and not (dots and ends[0] < ends[1])):
            raise RecipeError(
                f"--input {text}; expected NAME=LOW..HIGH with two numbers, the smaller one "
                "first, as in --input road=-0.05..0.05"
            )
    return found


def _from_folder(model: str, folder: Path) -> str:
    """Return how a recipe in a folder names a model: a file by its path from there."""
    file, colon, name = model.partition(":")
    if not Path(file).is_file():
        return model
    return Path(os.path.relpath(file, folder)).as_posix() + colon + name


def _chosen(what: str, found: Found, wish: Wish) -> list[SignalChoice]:
    """Return the inputs or outputs that the surrogate shall have, in the user's order if given."""
    offered = {choice.name: choice for choice in getattr(found, f"{what}s")}
    names = list(getattr(wish, f"{what}s"))
    unknown = [name for name in names if name not in offered]
    if unknown:
        raise RecipeError(
            f"--{what} {unknown[0]}: the model has no such {what}; expected some of "
            f"{list(offered)}"
        )
    if not offered:
        raise RecipeError(
            f"{found.model}: the model declares no {what}s; expected at least one: a surrogate "
            "takes inputs and gives outputs"
        )
    return [offered[name] for name in names or offered]


def _input(choice: SignalChoice, wish: Wish, declared: bool) -> DraftSignal:
    """Return an input with its range, from the user or from the model."""
    given = wish.inputs.get(choice.name)
    if given is not None:
        choice = replace(choice, low=given[0], high=given[1])
        origin = "The range was given."
    else:
        origin = "The model declares the range."
    if choice.low is None or choice.high is None:
        raise RecipeError(
            f"input {choice.name!r} ({choice.unit or 'no unit'}): the model declares no range; "
            f"expected one: give --input {choice.name}=LOW..HIGH"
        )
    if choice.hold is None and not declared:
        moves = choice.unit in MOVING
        choice = replace(choice, hold="first_order" if moves else "zero_order")
        origin += (
            " The input moves linearly between samples, as motions do."
            if moves
            else " The input is held between samples, as co-simulation tools do."
        )
    return DraftSignal(choice, origin)


def _specification(
    found: Found, inputs: list[DraftSignal], outputs: list[DraftSignal], step: float | None
) -> Specification:
    """Return what the system is made from; its step is None where it is to be proposed."""
    own, (low, high) = found.kind == "class", UNSEEN
    return Specification(
        found.model,
        kind=found.kind,
        step=found.step if step is None else step,
        inputs=() if own else tuple(signal.choice for signal in inputs),
        outputs=() if own else tuple(replace(s.choice, low=low, high=high) for s in outputs),
    )


def _origin(wish: Wish) -> str:
    """Say where a step comes from that is not proposed."""
    if wish.step is not None:
        return "The sample step in s that was given."
    return "The sample step in s that the model suggests."


def _with_ranges(outputs: list[DraftSignal], seen: FirstLook) -> list[DraftSignal]:
    """Return the outputs with ranges that hold what was seen in a few motions."""
    drafts = []
    for index, draft in enumerate(outputs):
        choice = draft.choice
        if choice.low is not None and choice.high is not None:
            drafts.append(replace(draft, origin="The model declares the range."))
            continue
        ends = _widened(float(seen.low[index]), float(seen.high[index]))
        origin = (
            f"Seen in {seen.motions} motions, and widened by {100 * MARGIN:.0f} % at both ends."
        )
        drafts.append(DraftSignal(replace(choice, low=ends[0], high=ends[1]), origin))
    return drafts


def _widened(low: float, high: float) -> tuple[float, float]:
    """Return a range a little wider, its ends with two digits that count."""
    margin = MARGIN * (high - low) or max(1.0, abs(high))
    digits = 1 - math.floor(math.log10(high - low + 2 * margin))
    unit = 10.0**-digits
    ends = math.floor((low - margin) / unit), math.ceil((high + margin) / unit)
    return round(ends[0] * unit, max(0, digits)), round(ends[1] * unit, max(0, digits))


def _names(signals: list[DraftSignal]) -> str:
    return ", ".join(signal.choice.name for signal in signals)
