"""Channels are inputs as users see them: an angle is one channel, and axes have limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, by_axis
from slide_fmu.data.draws import TEST, Stream, draw_inputs
from slide_fmu.excitation.speed_ramps import SpeedRamps
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System

MEASURED = 8
"""Limits of a motion that a recipe does not declare are the largest ones of this many draws."""

HIGHEST, OCTAVES = 0.8, 7
"""Without frequencies in the recipe, tones reach this part of the highest frequency that samples
can show, and begin where the memory of the surrogate ends, but this many octaves lower at most."""

SLOWEST = 4
"""The slowest tones of a motion have a period of this many memories of the surrogate: only slow
ones go far within the limits of a motion."""

LEAST = 1e-3
"""Where an axis rests in all motions of a recipe, its limits are this part of its range, or of
1 rad, per s and per s^2."""

Axis = tuple[Signal, ...]
"""One input, or cosine and sine of an angle."""


@dataclass(frozen=True)
class Channel:
    """A Channel is one input, or one angle with its cosine and sine, and how it may be driven.

    Attributes:
        signals: the input, or cosine and sine.
        low, high: its range, in its unit; infinite for an angle, which is in rad.
        rest: value to which it is released.
        frequencies: range of the angular frequencies of tones, in rad/s.
        times: range of the times for which levels are held, in s.
        speed, acceleration: limits of a motion, in its unit per s and per s^2; None of an input
            that may jump.
        grid: time in s of which jumps are whole multiples, or None: a held input jumps where an
            importer sets it, at a communication point.
    """

    signals: Axis
    low: float
    high: float
    rest: float
    frequencies: tuple[float, float]
    times: tuple[float, float]
    speed: float | None = None
    acceleration: float | None = None
    grid: float | None = None

    @property
    def moves(self) -> bool:
        """Whether it is a motion, with limits of speed and acceleration."""
        return self.speed is not None

    @property
    def turns(self) -> bool:
        """Whether it is an angle that turns without end."""
        return len(self.signals) == 2

    @property
    def unit(self) -> str:
        """Its unit."""
        return "rad" if self.turns else self.signals[0].unit

    @property
    def name(self) -> str:
        """Its name."""
        names = " and ".join(signal.name for signal in self.signals)
        return f"angle of {names}" if self.turns else names

    def columns(self, values: FloatArray) -> FloatArray:
        """Return values, (N,), as columns of the inputs: (N, 1), or cosine and sine, (N, 2)."""
        if not self.turns:
            return np.clip(values, self.low, self.high)[:, None]  # of rounding
        length = 1.0 if self.signals[0].angle is None else self.signals[0].high
        return length * np.stack([np.cos(values), np.sin(values)], axis=1)


def channels_of(recipe: Recipe, system: System, memory: float) -> tuple[Channel, ...]:
    """Return the channels of a system, with what the recipe's excitation says about them.

    Limits of speed and acceleration are the largest that a kind of excitation declares. Where none
    declares one for an axis, they are measured on motions that are drawn from the recipe.

    Args:
        recipe: the recipe; its kinds can drive the system.
        system: it has the signals; it is not simulated.
        memory: time in s for which the surrogate remembers its inputs.
    """
    kinds, step = recipe.data.excitation, recipe.window.step
    axes = _axes(system.inputs, any(isinstance(kind, SpeedRamps) for kind in kinds))
    top = math.pi / step
    declared = [pair for kind in kinds if (pair := getattr(kind, "angular_frequency", None))]
    least, most = max(2 * math.pi / memory, HIGHEST * top / 2**OCTAVES), HIGHEST * top
    if declared:
        least, most = (f(pair[i] for pair in declared) for i, f in ((0, min), (1, max)))
        most = min(most, top)
    frequencies, times = (min(least, 0.5 * most), most), (step, max(memory, 10 * step))
    channels = []
    for axis, limits in zip(axes, _limits(recipe, system, axes), strict=True):
        low, high, rest = axis[0].low, axis[0].high, axis[0].start_value
        if len(axis) == 2:
            low, high, rest = -math.inf, math.inf, 0.0
        slow, fast = frequencies
        if limits[0] is not None:
            slow = min(slow, 2 * math.pi / (SLOWEST * memory))
        grid = step if axis[0].hold == "zero_order" else None
        speed, acceleration = limits
        channels.append(
            Channel(axis, low, high, rest, (slow, fast), times, speed, acceleration, grid)
        )
    return tuple(channels)


def _limits(
    recipe: Recipe, system: System, axes: Sequence[Axis]
) -> Sequence[tuple[float, float] | tuple[None, None]]:
    """Return the limits of speed and acceleration of each axis; None of inputs that may jump."""
    driven = any(kind.drives_axes for kind in recipe.data.excitation)
    moving = [driven or len(axis) == 2 for axis in axes]
    if not any(moving):
        return [(None, None)] * len(axes)
    speed, acceleration = (
        _declared(recipe, name, len(axes)) for name in ("speed", "acceleration")
    )
    if not (speed and acceleration):
        speeds, accelerations = _measured(recipe, system, axes)
        speed, acceleration = speed or speeds, acceleration or accelerations
    pairs = zip(speed, acceleration, strict=True)
    return [pair if moves else (None, None) for pair, moves in zip(pairs, moving, strict=True)]


def _axes(signals: Sequence[Signal], ramps: bool) -> list[Axis]:
    """Return each input, or both of an angle; ``speed_ramps`` drives its two as an angle."""
    if ramps:
        return [tuple(signals)]
    return by_axis(signals)


def _declared(recipe: Recipe, name: str, count: int) -> tuple[float, ...]:
    """Return the largest limits of each axis that kinds declare; empty if none does."""
    limits = []
    for kind in recipe.data.excitation:
        values = getattr(kind, name, ()) if kind.drives_axes else ()
        values = (values,) if isinstance(values, float) else tuple(values)
        if len(values) == count:
            limits.append(values)
    return tuple(max(values) for values in zip(*limits, strict=True))


def _measured(
    recipe: Recipe, system: System, axes: Sequence[Axis]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the largest speeds and accelerations of each axis in motions of the recipe."""
    step = recipe.window.step
    stream = Stream(TEST, recipe.data.seed, (1.0, 1.0), recipe.data.duration)
    widths = np.array([1.0 if len(axis) == 2 else axis[0].high - axis[0].low for axis in axes])
    fastest = LEAST * np.stack([widths, widths])
    for index in range(MEASURED):
        inputs, column = draw_inputs(recipe, system, stream, index).inputs, 0
        for place, axis in enumerate(axes):
            values = inputs[:, column]
            if len(axis) == 2:
                values = np.unwrap(np.arctan2(inputs[:, column + 1], inputs[:, column]))
            for order in (1, 2):
                change = np.abs(np.diff(values, order)).max(initial=0.0) / step**order
                fastest[order - 1, place] = max(fastest[order - 1, place], change)
            column += len(axis)
    speeds, accelerations = fastest.tolist()
    return tuple(speeds), tuple(accelerations)
