"""This module writes a first recipe, with a comment on every assumed line."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slide_fmu.features.drive_law import DEFAULT_LAW, DRIVE_LAWS
from slide_fmu.recipe.default_excitation import InputKind, KindTable
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.declared import DeclaredModel, DeclaredParameter, SignalTable

WIDTH = 96
"""Comments are wrapped to this many columns."""

NO_UNIT_KNOWN = '"N"  # the model names none: write yours, as "m", "rad/s" or "degC"'
"""What stands behind the key of a unit that is not known."""

SHORT, LONG = 6, 60
"""Numbers of steps over which an error bound averages."""


@dataclass(frozen=True)
class DraftSignal:
    """A DraftSignal is the table of an input or output, with the origin of its range.

    ``acts`` says of an input how it acts between samples, as the comment of its hold.
    """

    name: str
    table: SignalTable
    origin: str
    acts: str = ""


@dataclass(frozen=True)
class Draft:
    """A Draft holds the contents of a first recipe of any kind of system.

    Attributes:
        name: name of the recipe, a C identifier.
        description: one line for people.
        inputs, outputs: signals of the surrogate, in its order.
        step: sample step h in s.
        step_origin: origin of the step.
    """

    name: str
    description: str
    inputs: tuple[DraftSignal, ...]
    outputs: tuple[DraftSignal, ...]
    step: float
    step_origin: str


@dataclass(frozen=True)
class DraftLoop:
    """A DraftLoop is a table ``[[loop]]`` with its comments, the last ones of which are warnings.

    Attributes:
        table: keys and values.
        comments: a paragraph each.
        warnings: sentences for people.
    """

    table: dict[str, Any]
    comments: tuple[str, ...]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class ModelDraft(Draft):
    """A ModelDraft holds the contents of a first recipe of a model.

    Attributes:
        declared: declarations of the model.
        excitation: tables of the inputs of the training.
        further: tables of the inputs that the bound alone learns from.
        declares_signals: whether the model declares its signals with their ranges itself, so that
            the recipe has no tables for them.
        kind_of_inputs: kind of the inputs.
        chain: path of the URDF of the serial chain whose joints' set points the inputs are.
        substeps: parts of a sample step in which moving inputs bend.
        fmu_step: step in s by which an importer runs the FMU; None if its inputs move smoothly.
        loops: loops in which motions are drawn.
        jumps: whether inputs that move may jump; None where they cannot.
        inputs_file: lines of the table of the user's own inputs.
    """

    declared: DeclaredModel
    excitation: Sequence[KindTable]
    declares_signals: bool = False
    further: Sequence[KindTable] = ()
    kind_of_inputs: InputKind = "held"
    chain: str | None = None
    substeps: int = 1
    fmu_step: float | None = None
    loops: tuple[DraftLoop, ...] = ()
    jumps: bool | None = None
    inputs_file: Sequence[str] = ()


def recipe_text(draft: ModelDraft) -> str:
    """Write a recipe as TOML; ``slide_fmu.recipe.reading.parse_recipe`` reads it."""
    declared = draft.declared
    lines = [
        *heading_lines(draft.name, draft.description),
        "[system]",
        f"kind = {value_text(declared.kind)}",
        f"model = {value_text(declared.model)}",
        *_chain_lines(draft.chain),
        *_parameter_lines(declared.parameters, draft.fmu_step),
        "",
    ]
    if not draft.declares_signals:
        lines += signals_lines(draft.inputs, draft.outputs)
    lines += [
        "[window]",
        *comment_lines(draft.step_origin),
        f"step = {value_text(draft.step)}",
        *comment_lines(
            "The window is as long as the memory of the system: after it, this part is left of "
            "what happened before. slide-fmu finds its lengths n_in and n_out. A larger number, "
            "such as the default 0.01, gives a shorter window and larger errors."
        ),
        "remaining_amplitude = 0.001",
        "",
        *_data_lines(draft.substeps, draft.jumps),
        *_excitation_lines(draft),
        *(line for loop in draft.loops for line in _loop_lines(loop)),
        *_bound_lines(draft.step),
        *_further_lines(draft.further),
        *(_STABILITY if draft.kind_of_inputs in ("set_points", "angle") else ()),
    ]
    return "\n".join(lines)


def recipe_name(text: str) -> str:
    """Make a C identifier of the name of a file or a class."""
    plain = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text)
    plain = re.sub(r"\W+", "_", plain, flags=re.ASCII).strip("_").lower() or "model"
    return plain if plain[0].isalpha() else f"model_{plain}"


def tables_text(tables: Mapping[str, Any]) -> str:
    """Write the tables of a recipe as TOML; keys whose value is None are left out.

    Raises:
        RecipeError: a value is of a type that TOML does not have.
    """
    plain = {key: value for key, value in tables.items() if not isinstance(value, Mapping)}
    lines = _lines(plain, "recipe")
    for name, table in tables.items():
        if isinstance(table, Mapping):
            lines += ["", f"[{_key(name)}]", *_lines(table, name)]
    return "\n".join([*lines, ""])


def _lines(table: Mapping[str, Any], name: str) -> list[str]:
    try:
        return [f"{_key(k)} = {value_text(v)}" for k, v in table.items() if v is not None]
    except TypeError as error:
        raise RecipeError(
            f"{name}: {dict(table)} ({error}); expected numbers, texts, lists and dictionaries"
        ) from error


def _bound_lines(step: float) -> list[str]:
    """Return the tables of an error bound, with averaging times that suit the step in s."""
    short, long = (value_text(float(f"{count * step:.3g}")) for count in (SHORT, LONG))
    return [
        *comment_lines(
            "This table gives the FMU a bound of its error at every step. The FMU also estimates "
            "its RMS error over the last estimate_span seconds. slide-fmu chooses the number of "
            "trajectories for this by the time that it takes to simulate one."
        ),
        "[bound]",
        f"estimate_span = {long}",
        "",
        "[bound.expert]",
        f"short_span = {short}",
        f"long_span = {long}",
        "",
        "# A second network helps to find the bound. One random start is enough for its training.",
        "[bound.expert.companion]",
        "starts = 1",
        "",
    ]


def _further_lines(kinds: Sequence[KindTable]) -> list[str]:
    """Return the kinds of input that only the bound learns from."""
    lines = comment_lines(
        "Only the error bound learns from these inputs. They are straight between points, as "
        "inputs from coarse tables and from importers with longer steps are. The bound is not "
        "calibrated on them, so it may cover less than 95 % of their errors."
    )
    return [*lines, *kind_tables("bound.excitation", kinds)] if kinds else []


_STABILITY = (
    "# The network is tested with motions that are faster by these factors. They have the same",
    "# positions. Twice the speed means four times the load.",
    "[stability]",
    "amplitudes = [1.0, 1.5, 2.0]",
    "",
)
"""Table of a recipe whose inputs are set points of drives, or an angle."""


_LIMITS: dict[InputKind, str] = {
    "rates": (
        "The rates of the inputs act on the model too, so all inputs here are smooth. If yours "
        "are faster, or have steps, change these tables."
    ),
    "set_points": (
        "The inputs are set points of drives, which move from point to point. The keys speed and "
        "acceleration are limits of each input, in its unit per s and per s^2. They are assumed "
        "from its range and the step. Write the limits of your drives."
    ),
    "angle": (
        "The inputs are cosine and sine of one angle, whose speed goes up and down. The keys "
        "speed and acceleration are its limits in rad/s and rad/s^2. They are assumed from the "
        "step. Write the limits of your machine."
    ),
}
"""Comments on assumed limits, by the kind of the inputs."""


def _chain_lines(chain: str | None) -> list[str]:
    """Return the lines about a serial chain: its URDF, and how its joints are driven."""
    if chain is None:
        return []
    return [
        *comment_lines(
            "The inputs are the set points of the joints of this robot. The network also sees "
            "what follows from its geometry and masses."
        ),
        f"chain = {value_text(chain)}",
        *comment_lines(
            "This key says how the joints follow their set points. It is one of "
            f"{', '.join(DRIVE_LAWS)}, or weights (docs/robots.md)."
        ),
        f"drive = {value_text(DEFAULT_LAW)}",
    ]


def _parameter_lines(parameters: Sequence[DeclaredParameter], fmu_step: float | None) -> list[str]:
    if not parameters and fmu_step is None:
        return []
    lines = ["", "[system.parameters]"]
    if fmu_step is not None:
        lines += comment_lines(
            "The FMU runs with this step, in s. Its inputs are held over the step, as fmpy does."
        )
        lines.append(f"fmu-step = {value_text(fmu_step)}")
    if parameters:
        lines.append("# Parameters of the model with their values; remove the # to change one.")
    for parameter in parameters:
        text = " ".join(part for part in (parameter.unit, parameter.description) if part)
        remark = f"  # {_plain(text)}" if text else ""
        lines.append(f"# {_key(parameter.name)} = {value_text(parameter.value)}{remark}")
    return lines


def heading_lines(name: str, description: str) -> list[str]:
    """Write the heading of every proposed recipe."""
    return [
        *comment_lines(
            "slide-fmu init proposed this recipe. You may change every line. A key that is not "
            "here has its default. Check the recipe with: slide-fmu try. Then make the FMU with: "
            "slide-fmu run."
        ),
        f"name = {value_text(name)}",
        f"description = {value_text(description)}",
        "",
    ]


def signals_lines(inputs: Sequence[DraftSignal], outputs: Sequence[DraftSignal]) -> list[str]:
    """Write a table for each input and output."""
    pairs = [("inputs", one) for one in inputs] + [("outputs", one) for one in outputs]
    return [line for what, signal in pairs for line in _signal_lines(what, signal)]


def _signal_lines(what: str, signal: DraftSignal) -> list[str]:
    lines = [
        f"[system.{what}.{_key(signal.name)}]",
        *comment_lines(f"{signal.origin} {signal.acts}".strip()),
    ]
    lines.append(f"range = {value_text(signal.table.range)}")
    kept = ("column", "unit", "start", "hold", "angle", "description")
    for key in kept:
        value = getattr(signal.table, key)
        if value is not None:
            lines.append(f"{key} = {value_text(value)}")
        elif key == "unit":
            lines.append(f"# unit = {NO_UNIT_KNOWN}")
    return [*lines, ""]


def _data_lines(substeps: int, jumps: bool | None) -> list[str]:
    """Return the table of the data: what inputs do between samples."""
    lines = []
    if substeps > 1:
        lines += comment_lines(
            "Sines are curved between samples. So the model gets the inputs in this many parts of "
            "each step."
        )
        lines.append(f"substeps = {substeps}")
    if jumps is not None:
        lines += comment_lines(
            "Inputs jump, as with a switch, a valve or an emergency stop: the kinds steps, "
            "held_random, binary and stops do so, at samples and at any time within a step. Leave "
            "this out where yours do not; then they go straight to the next value within one step."
            if jumps
            else "Do your inputs jump, as with a switch, a valve or an emergency stop? Then write "
            "jumps = true. The kinds steps, held_random, binary and stops then jump at any time "
            "within a step. With jumps = false, the default, inputs go straight to the next value "
            "within one step, and the error bound does not know jumps. A recipe of slide-fmu init "
            "--jumps has more and larger jumps, and the kinds binary and stops."
        )
        lines.append("jumps = true" if jumps else "# jumps = true")
    return ["[data]", *lines, ""] if lines else []


def _excitation_lines(draft: ModelDraft) -> list[str]:
    lines = comment_lines(
        "Each of these tables is a kind of input for the training. Its weight says how often it "
        "is drawn. Amplitudes are parts of half the range of an input. Angular frequencies are in "
        "rad/s, durations in s. slide-fmu run --inputs FILE adds inputs of your own, from a file."
    )
    lines += comment_lines(_LIMITS.get(draft.kind_of_inputs, ""))
    return [*lines, *kind_tables("data.excitation", draft.excitation), *draft.inputs_file]


def kind_tables(name: str, kinds: Sequence[KindTable]) -> list[str]:
    """Write kinds of excitation as the tables of a name."""
    lines = []
    for table in kinds:
        lines += [f"[[{name}]]", *(f"{key} = {value_text(v)}" for key, v in table.items()), ""]
    return lines


def _loop_lines(loop: DraftLoop) -> list[str]:
    comments = [line for text in (*loop.comments, *loop.warnings) for line in comment_lines(text)]
    keys = [f"{key} = {value_text(value)}" for key, value in loop.table.items()]
    return [*comments, "[[loop]]", *keys, ""]


def comment_lines(text: str) -> list[str]:
    """Wrap a text into lines of comment."""
    return [f"# {line}" for line in textwrap.wrap(_plain(text), WIDTH)]


def _plain(text: str) -> str:
    """Return text on one line, since line ends in a model's texts would end a comment."""
    return " ".join(text.split())


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name)


def value_text(value: Any) -> str:
    """Write a value as TOML, in which texts, numbers and lists are as in JSON."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(value_text(item) for item in value)}]"
    if isinstance(value, Mapping):
        inner = (f"{_key(k)} = {value_text(v)}" for k, v in value.items() if v is not None)
        return f"{{ {', '.join(inner)} }}"
    return json.dumps(value, ensure_ascii=False)
