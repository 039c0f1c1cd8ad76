"""A recipe mixes kinds of excitation: this module lists them and draws from the mix.

A new kind is added to ``Excitation``; nothing else lists them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field

from slide_fmu.excitation.alone import Alone
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
from slide_fmu.excitation.point_to_point import PointToPoint
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.excitation.spectra import FilteredRandom, Harmonic, Multisine, Sweep
from slide_fmu.excitation.speed_ramps import SpeedRamps
from slide_fmu.excitation.vibration import Vibration

Excitation = Annotated[
    HeldRandom
    | MovingAverageRandom
    | FilteredRandom
    | Harmonic
    | Sweep
    | Multisine
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
    | Alone
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
    """Return the kinds that say how inputs move: ``alone`` moves one of them as another kind."""
    return [kind for kind in kinds if not isinstance(kind, Alone)]


def drawing_kind(
    chosen: Kind | LoopRecipe, usual: Sequence[Kind], rng: np.random.Generator
) -> Kind:
    """Return the kind that draws the inputs of a motion: mostly the chosen kind itself.

    A loop gets its outer inputs from a usual kind. One input that moves alone moves as in another
    usual kind.
    """
    if isinstance(chosen, LoopRecipe):
        chosen = usual[choose_kind(usual, rng)]
    if isinstance(chosen, Alone):
        others = moving_by_themselves(usual)
        return chosen.like(others[choose_kind(others, rng)])
    return chosen


def names_of(kinds: Sequence[Kind | LoopRecipe]) -> list[str]:
    """Return one name for each excitation of a recipe, in its order, all different.

    The name is the kind; if several have that kind, the position in the mix, from 1, is added.
    """
    found = [str(getattr(kind, "kind", type(kind).__name__)) for kind in kinds]
    return [
        name if found.count(name) == 1 else f"{name} {number}"
        for number, name in enumerate(found, start=1)
    ]
