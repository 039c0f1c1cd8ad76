"""Coordinates are the moving quantities: single inputs, and one angle for each cosine and sine."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal


@dataclass(frozen=True)
class Coordinate:
    """A Coordinate is one number that a motion moves.

    Attributes:
        name: name of the input; of the cosine for an angle given by cosine and sine.
        unit: its unit; ``"rad"`` for an angle.
        low, high: its range; infinite for an angle.
        radius: radius of the circle of an angle; None for a single input.
    """

    name: str
    unit: str
    low: float
    high: float
    radius: float | None = None

    @property
    def title(self) -> str:
        """The name for people: that of the input, or of the angle that it is the cosine of."""
        return self.name if self.radius is None else f"angle of {self.name}"


def coordinates_of(signals: tuple[Signal, ...]) -> tuple[Coordinate, ...]:
    """List the coordinates of a system's inputs, in their order."""
    return tuple(
        Coordinate(signal.name, signal.unit, signal.low, signal.high)
        if signal.angle is None
        else Coordinate(signal.name, "rad", -math.inf, math.inf, signal.high)
        for signal in signals
        if signal.angle != "sine"
    )


def inputs_of(coordinates: tuple[Coordinate, ...], motion: FloatArray) -> FloatArray:
    """Turn motions of coordinates, (..., n_coordinates), into inputs, (..., n_inputs)."""
    columns: list[FloatArray] = []
    for index, coordinate in enumerate(coordinates):
        values = motion[..., index]
        if coordinate.radius is None:
            columns.append(values)
        else:
            columns += [coordinate.radius * np.cos(values), coordinate.radius * np.sin(values)]
    return np.stack(columns, axis=-1)
