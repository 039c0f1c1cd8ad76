"""All kinds of excitation are listed here; a recipe mixes them, and motions draw from the mix.

A new kind is added to ``Excitation``. Nothing else lists all kinds: what other rooms ask of a kind
is in its attributes (``Kind``).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field

from slide_fmu.excitation.axis_moves import AxisMoves
from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.box import Box
from slide_fmu.excitation.channels import (
    Binary,
    HeldRandom,
    MovingAverageRandom,
    Ramps,
    Rest,
    Steps,
    Stops,
)
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.excitation.one_at_a_time import OneAtATime
from slide_fmu.excitation.point_to_point import PointToPoint
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.excitation.spectra import BandSines, FilteredRandom, Harmonic, Multisine, Sweep
from slide_fmu.excitation.speed_ramps import SpeedRamps
from slide_fmu.excitation.vibration import Vibration

Excitation = Annotated[
    HeldRandom
    | MovingAverageRandom
    | FilteredRandom
    | Harmonic
    | Sweep
    | Multisine
    | BandSines
    | Steps
    | Ramps
    | Stops
    | Binary
    | Rest
    | SpeedRamps
    | PointToPoint
    | AxisMoves
    | Vibration
    | Box
    | OneAtATime
    | Recorded,
    Field(discriminator="kind"),
]
"""One entry of a recipe's mix; its ``kind`` selects the class that reads it."""


def choose_kind(kinds: Sequence[Kind | LoopRecipe], rng: np.random.Generator) -> int:
    """Draw the index of a kind, with probabilities in proportion to the weights."""
    weights = np.array([kind.weight for kind in kinds])
    return int(rng.choice(len(kinds), p=weights / weights.sum()))


Described = TypeVar("Described", bound=Kind)


def moving_by_themselves(kinds: Iterable[Described]) -> list[Described]:
    """Return the kinds that say how inputs move: not ``one_at_a_time``, which moves as another."""
    return [kind for kind in kinds if not isinstance(kind, OneAtATime)]


def drawing_kind(
    chosen: Kind | LoopRecipe, usual: Sequence[Kind], rng: np.random.Generator
) -> Kind:
    """Return the kind that draws the inputs of a motion: mostly the chosen kind itself.

    A loop gets its outer inputs from a usual kind. One input that moves alone moves as in another
    usual kind.
    """
    if isinstance(chosen, LoopRecipe):
        chosen = usual[choose_kind(usual, rng)]
    if isinstance(chosen, OneAtATime):
        others = [one for one in moving_by_themselves(usual) if chosen.may_move_as(one)]
        return chosen.like(others[choose_kind(others, rng)])
    return chosen


def names_of(kinds: Sequence[Kind | LoopRecipe]) -> list[str]:
    """Return one name for each excitation of a recipe, in its order, all different.

    The name is the kind; if several have that kind, the position in the mix, from 1, is added.
    """
    names = [str(getattr(kind, "kind", type(kind).__name__)) for kind in kinds]
    return [
        name if names.count(name) == 1 else f"{name} {number}"
        for number, name in enumerate(names, start=1)
    ]


FIRST_REPORTED = "angular_frequency"
"""The setting that says most about a kind; in rad/s."""


def reported_names_of(kinds: Sequence[Kind | LoopRecipe]) -> list[str]:
    """Return the names of excitations, those of one kind with a setting in which they differ.

    It is the first one that no other excitation of this kind shares, if there is one, such as
    ``multisine 2 of 0.3 to 5.3 rad/s``. A list or a switch is not reported.
    """
    names = names_of(kinds)
    settings = [_reported_settings(kind) for kind in kinds]
    own = [str(getattr(kind, "kind", type(kind).__name__)) for kind in kinds]
    for place, kind in enumerate(own):
        others = [s for k, s in enumerate(settings) if own[k] == kind and k != place]
        for setting, text in settings[place].items():
            if others and all(other.get(setting) != text for other in others):
                names[place] += f" of {text}"
                break
    return names


def _reported_settings(kind: Kind | LoopRecipe) -> dict[str, str]:
    """Return settings that are a number, a range or a name, as they stand in names of rows."""
    settings = {}
    for name, text in kind.settings().items():
        if "," in text or text == "yes":
            continue
        words = " to ".join(dict.fromkeys(map(_short, text.split(" .. "))))
        settings[name] = f"{words} rad/s" if name == FIRST_REPORTED else f"{name} {words}"
    return dict(sorted(settings.items(), key=lambda item: item[0] != FIRST_REPORTED))


def _short(text: str) -> str:
    """Return a number without zeros at its end; another text stays."""
    try:
        return f"{float(text):g}"
    except ValueError:
        return text
