"""A recipe mixes kinds of excitation: this module lists them and draws from the mix.

A new kind is added to ``Excitation``; nothing else lists them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.channels import (
    Harmonic,
    HeldRandom,
    MovingAverageRandom,
    Multisine,
    Rest,
    Steps,
    Sweep,
)
from slide_fmu.excitation.point_to_point import PointToPoint
from slide_fmu.excitation.speed_ramps import SpeedRamps

Excitation = Annotated[
    HeldRandom
    | MovingAverageRandom
    | Harmonic
    | Sweep
    | Multisine
    | Steps
    | Rest
    | SpeedRamps
    | PointToPoint,
    Field(discriminator="kind"),
]
"""The value is one entry of a recipe's mix; its ``kind`` says which class reads it."""


def draw_inputs(
    kind: Kind,
    signals: tuple[Signal, ...],
    time: FloatArray,
    factor: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw one realisation of an excitation, after a check that it suits the inputs.

    Args:
        kind: the excitation.
        signals: the inputs of the system, in channel order.
        time: sample times in s, evenly spaced, shape (N,).
        factor: amplitude factor; above 1 the inputs leave their range, or move faster.
        rng: the only source of randomness.

    Returns:
        Inputs in the units of their signals, time first, then channel: shape (N, n_inputs).

    Raises:
        ValueError: the kind cannot drive these inputs.
    """
    kind.check(signals)
    return kind.inputs(signals, time, factor, rng)


def choose_kind(kinds: Sequence[Kind], rng: np.random.Generator) -> int:
    """Draw the index of a kind, with probabilities in proportion to the weights."""
    weights = np.array([kind.weight for kind in kinds])
    return int(rng.choice(len(kinds), p=weights / weights.sum()))


def names_of(kinds: Sequence[Kind]) -> list[str]:
    """Return one name for each excitation of a recipe, in its order, all different.

    The name is the kind alone where the recipe has one of that kind; else the position of the
    excitation in the mix, counted from 1, follows it.
    """
    found = [str(getattr(kind, "kind", type(kind).__name__)) for kind in kinds]
    return [
        name if found.count(name) == 1 else f"{name} {number}"
        for number, name in enumerate(found, start=1)
    ]
