"""A recipe that says nothing about its excitation gets this mix, which follows from its step.

Networks answer what they have been taught. So the mix holds what inputs of machines usually do:
noise, sums of sines, single sines and sweeps in the band that the sample step can show, steps and
rests, each from small to large. Set points of drives get motions from point to point instead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

TOP = 0.3
"""The mix reaches this part of the highest frequency that samples show (that of Nyquist): at six
samples per period a network still sees the waves."""
DECADES = 2.5
"""Frequencies reach this many decades below the highest one."""
CROSSING = 200
"""At its limit of speed a joint crosses its range in so many samples."""
SPEEDING_UP = 25
"""It reaches that speed in so many samples, at its limit of acceleration."""


def default_excitation(step: float, moving: bool = False) -> list[dict[str, Any]]:
    """Return the tables ``data.excitation`` for a sample step in s, as a recipe may hold them.

    Inputs with a first-order hold are motions (``moving``), which hardly ever jump: their jumps
    are smaller and rarer than those of forces. Inputs that are held are switched on and off: they
    step through their whole range, and stay there for long. Frequencies are angular frequencies
    in rad/s, durations in s, amplitudes parts of the range.
    """
    top = _tidy(TOP * math.pi / step)
    low = _tidy(top / 10**DECADES)
    middle = _tidy(math.sqrt(top * low))
    short, long = _tidy(5 * step), _tidy(math.pi / middle)
    largest, samples = (0.3, [4, 20]) if moving else (1.0, [1, 20])
    steps, longest = (0.05, long) if moving else (0.15, 4 * long)
    return [
        {"kind": "filtered_random", "weight": 0.3 - steps, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, top]},
        {"kind": "multisine", "weight": 0.2, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, middle]},
        {"kind": "multisine", "weight": 0.15, "amplitude": [0.02, 0.3],
         "angular_frequency": [middle, top]},
        {"kind": "held_random", "weight": 0.15, "amplitude": [0.05, largest], "samples": samples},
        {"kind": "sweep", "weight": 0.1, "amplitude": [0.02, 0.5],
         "angular_frequency": [low, top]},
        {"kind": "harmonic", "weight": 0.05, "amplitude": [0.02, 0.5],
         "angular_frequency": [low, top]},
        {"kind": "steps", "weight": steps, "amplitude": [0.05, largest],
         "duration": [short, longest]},
        {"kind": "rest", "weight": 0.05, "amplitude": [0.05, largest], "duration": [short, long]},
    ]  # fmt: skip


def set_point_excitation(step: float, widths: Sequence[float] = ()) -> list[dict[str, Any]]:
    """Return the tables ``data.excitation`` for inputs that are the set points of drives.

    Drives do not follow noise: their set points go from point to point. Limits of speed and
    acceleration follow from the widths of the ranges, in the units of the inputs; moves are slower
    instead where these are not known. The times are in s, the sample step too.
    """
    speeds = [_tidy(width / (CROSSING * step)) for width in widths]
    limits = {
        "speed": speeds,
        "acceleration": [_tidy(speed / (SPEEDING_UP * step)) for speed in speeds],
    }
    short, long = (60, 200) if speeds else (100, 300)
    moves: dict[str, Any] = {
        "kind": "point_to_point",
        "weight": 0.7,
        "duration": [_tidy(short * step), _tidy(long * step)],
        "ramp": [0.2, 0.5],
        **(limits if speeds else {}),
        "dwell": 0.3,
        "dwell_duration": [_tidy(10 * step), _tidy(100 * step)],
    }
    single = {**moves, "weight": 0.3, "reach": 0.6, "keep": 0.3, "single": 0.3}
    return [moves, single]


def _tidy(value: float) -> float:
    """Return the value with two digits that count, as people write it."""
    return float(f"{value:.2g}")
