"""The kinds of excitation that a recipe may mix, and drawing from the mix."""

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


def draw_inputs(
    kind: Kind,
    signals: tuple[Signal, ...],
    time: FloatArray,
    factor: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw one realisation of an excitation.

    Args:
        signals: the inputs.
        time: sample times in s, evenly spaced, shape (N,).
        factor: on the amplitude; above 1 the inputs leave their range, or move faster.

    Returns:
        Inputs in their units, shape (N, n_inputs).

    Raises:
        ValueError: the kind cannot drive these inputs.
    """
    kind.check(signals)
    return kind.inputs(signals, time, factor, rng)


def choose_kind(kinds: Sequence[Kind], rng: np.random.Generator) -> int:
    """Draw the index of a kind by the weights."""
    weights = np.array([kind.weight for kind in kinds])
    return int(rng.choice(len(kinds), p=weights / weights.sum()))


def names_of(kinds: Sequence[Kind]) -> list[str]:
    """Names that tell the excitations of a recipe apart, in its order.

    The kind alone where there is one of it, else with the number of the excitation, from 1.
    """
    found = [str(getattr(kind, "kind", type(kind).__name__)) for kind in kinds]
    return [
        name if found.count(name) == 1 else f"{name} {number}"
        for number, name in enumerate(found, start=1)
    ]
