"""This module makes the default mix of excitation, which follows from the sample step.

Networks are accurate on inputs like those of their training. So the mix holds usual inputs of
machines: noise, sums of many and of few sines, single sines and sweeps in the band of the sample
step, steps and rests, each from small to large. Moving inputs go to a new level within one step
(``ramps``), unless they jump. Most smooth inputs are like sums of slow and fast
sines; a few lasting sines let a resonance build up. Set points of drives get motions from point to
point instead. An angle, whose inputs are cosine and sine, turns at a speed that rises and falls.
Both also move as drives are driven: at their limits, in jogs and long moves, with stops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, assert_never

TOP = 0.3
"""The mix reaches this part of the Nyquist frequency, which has about six samples per period."""
RESONANT = 12.0, 2.0
"""Resonances mostly lie between the highest frequency over these two numbers, if the step follows
from the bandwidth of the system."""
SLOW, FAST, RAMP = 8.0, 3.0, 60.0
"""Motions whose rates act are wide up to the highest frequency over SLOW, and small up to it over
FAST; a motion through their range takes at least RAMP samples."""
DECADES = 2.5
"""Frequencies reach this many decades below the highest one."""
CROSSING = 200
"""Number of samples in which a joint crosses its range at its limit of speed."""
SPEEDING_UP = 25
"""Number of samples in which it reaches that speed at its limit of acceleration."""
TURN = 25
"""Number of samples in which an angle makes a turn at its limit of speed."""
SAMPLES_APART = 8
"""Largest number of samples from one communication point of a master to the next."""
BOX_WEIGHT = 0.2
"""Weight, of 1 in all, of constant inputs at corners of the ranges and inside, and of the motions
between them."""
ALONE_WEIGHT = 0.2
"""Weight, of 1 in all, of motions in which one of several inputs moves alone."""
JUMP_WEIGHT = 0.25
"""Weight that kinds of moving inputs which jump add to the weight, 1 in all, of the others."""
STANDING_START = 12
"""Number of samples in which it reaches that speed at its limit of acceleration."""

KindTable = dict[str, str | bool | float | Sequence[float]]
"""The table of one kind of excitation, as a recipe may hold it."""

InputKind = Literal["held", "moving", "rates", "set_points", "angle"]
"""Kind of the inputs of a system: quantities that may jump; motions, which do not; motions whose
rates act too; set points of drives; cosine and sine of one angle."""


def default_excitation(
    step: float,
    inputs: InputKind = "held",
    widths: Sequence[float] = (),
    turning: bool = False,
    jumps: bool = False,
) -> list[KindTable]:
    """Return the tables ``data.excitation`` for a sample step in s, as a recipe may hold them.

    The widths of the ranges, in the units of the inputs, limit the speeds of set points; unknown
    widths give slower moves. Where several widths are known, some motions are of one input alone.
    Where some inputs are cosine and sine of an angle (``turning``), they have no box. Moving
    inputs that jump (``jumps``) do so in steps, from end to end, and where motions stop.
    """
    if inputs == "set_points":
        return _from_point_to_point(step, widths)
    if inputs == "angle":
        return _turning(step)
    if inputs == "rates":
        mix = _smooth(step)
    elif inputs == "held" or inputs == "moving":
        mix = _mixed(step, inputs == "moving", jumps)
    else:
        assert_never(inputs)
    *others, box = mix
    kept = [] if turning else [box]
    if len(widths) > 1:
        others = [_lighter(table, 1.0 - ALONE_WEIGHT / (1.0 - BOX_WEIGHT)) for table in others]
        kept.append({"kind": "one_at_a_time", "weight": ALONE_WEIGHT})
    return [*others, *kept]


def further_excitation(step: float, inputs: InputKind, turning: bool = False) -> list[KindTable]:
    """Return the tables ``bound.excitation`` for a step in s, from which bounds alone learn.

    Where inputs move, they are motions that are straight between communication points. Samples
    hardly show whether these bend, so a network that learnt them would lose accuracy on smooth
    ones. There are none where some inputs are cosine and sine of an angle (``turning``): a
    straight line leaves the circle.
    """
    if inputs not in ("moving", "rates") or turning:
        return []
    top = _tidy(TOP * math.pi / step)
    wide, fast = (1 / RESONANT[1], 1.0) if inputs == "moving" else (1 / SLOW, 1 / FAST)
    low, slow = _tidy(top / 10**DECADES), _tidy(wide * top)
    longest = _tidy(SAMPLES_APART * step)
    return [
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, slow], "components": [2, 8], "decades": True,
         "points": [step, longest]},
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.02, 0.2],
         "angular_frequency": [slow, _tidy(fast * top)], "components": [1, 4],
         "points": [_tidy(2 * step), longest]},
    ]  # fmt: skip


def _mixed(step: float, moving: bool, jumps: bool) -> list[KindTable]:
    """Return the mix of noise, waves and steps.

    Inputs with a first-order hold are motions (``moving``), which hardly ever change at once: they
    do so by less and more rarely than forces, within a step. If they jump (``jumps``), they do it
    as often as forces, and in the midst of motions. Held inputs may be switched: they step through
    their range, and from end to end of it, and stay there for long. All inputs together are held
    at corners of the box of their ranges and inside of it. Frequencies are angular frequencies in
    rad/s, durations in s, amplitudes parts of the range.
    """
    top = _tidy(TOP * math.pi / step)
    low = _tidy(top / 10**DECADES)
    middle = _tidy(math.sqrt(top * low))
    short, long = _tidy(5 * step), _tidy(math.pi / middle)
    largest = 0.3 if moving and not jumps else 1.0
    samples = [4, 20] if moving else [1, 20]
    sines = 0.15 if moving else 0.1
    steps = 0.05 if moving and not jumps else 0.1
    slow_and_fast, resonant = (0.15, 0.1) if moving else (0.1, 0.05)
    end = _tidy(top / RESONANT[1])
    longest = long if moving and not jumps else _tidy(4 * long)
    ends: KindTable = {
        "kind": "binary", "weight": 0.1, "amplitude": [0.5, 1.0], "duration": [short, longest]
    }  # fmt: skip
    stops: list[KindTable] = [
        {"kind": "stops", "weight": 0.1, "amplitude": [0.1, 1.0],
         "angular_frequency": [low, middle], "duration": [short, longest]}
    ]  # fmt: skip
    others: list[KindTable] = [
        {"kind": "filtered_random", "weight": 0.1, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, top]},
        {"kind": "multisine", "weight": sines, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, middle]},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.02, 0.3],
         "angular_frequency": [middle, top]},
        {"kind": "multisine", "weight": slow_and_fast, "amplitude": [0.1, 0.5],
         "angular_frequency": [low, end], "components": [2, 4], "decades": True},
        {"kind": "multisine", "weight": resonant, "amplitude": [0.1, 0.5],
         "angular_frequency": [_tidy(top / RESONANT[0]), end], "components": [1, 3]},
        {"kind": "held_random", "weight": 0.15, "amplitude": [0.05, largest], "samples": samples},
        {"kind": "sweep", "weight": 0.1, "amplitude": [0.02, 0.5],
         "angular_frequency": [low, top]},
        {"kind": "harmonic", "weight": 0.05, "amplitude": [0.02, 0.5],
         "angular_frequency": [low, top]},
        {"kind": "ramps" if moving and not jumps else "steps", "weight": steps,
         "amplitude": [0.05, largest], "duration": [short, longest]},
        *([] if moving and not jumps else [ends]),
        *(stops if moving and jumps else []),
        {"kind": "rest", "weight": 0.05, "amplitude": [0.05, largest], "duration": [short, long]},
    ]  # fmt: skip
    box: KindTable = {
        "kind": "box",
        "weight": BOX_WEIGHT,
        "duration": [long, _tidy(8 * long)],
        "ramp": [_tidy(4 * step) if moving else _tidy(0.5 * step), _tidy(4 * long)],
    }
    rest = 1.0 - BOX_WEIGHT
    if moving and jumps:  # more kinds share the same weight
        rest /= 1.0 + JUMP_WEIGHT
    return [*(_lighter(table, rest) for table in others), box]


def _lighter(table: KindTable, part: float) -> KindTable:
    """Return the table of a kind with a part of its weight."""
    weight = table["weight"]
    assert isinstance(weight, float)
    return {**table, "weight": _tidy(part * weight)}


def _smooth(step: float) -> list[KindTable]:
    """Return a mix of motions whose rates act too, with rates of realistic size.

    A jump within a sample, or a wide motion at the highest frequency, would have rates far beyond
    those of real dampers.
    """
    top = _tidy(TOP * math.pi / step)
    low, slow, fast = (_tidy(top / part) for part in (10**DECADES, SLOW, FAST))
    middle = _tidy(math.sqrt(top * low))
    long = _tidy(math.pi / middle)
    return [
        {"kind": "multisine", "weight": 0.2, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, middle]},
        {"kind": "multisine", "weight": 0.2, "amplitude": [0.1, 0.5],
         "angular_frequency": [low, slow], "components": [2, 4], "decades": True},
        {"kind": "multisine", "weight": 0.15, "amplitude": [0.02, 0.1],
         "angular_frequency": [middle, fast]},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.02, 0.2],
         "angular_frequency": [slow, fast], "components": [1, 3]},
        {"kind": "sweep", "weight": 0.1, "amplitude": [0.02, 0.1],
         "angular_frequency": [low, fast]},
        {"kind": "harmonic", "weight": 0.05, "amplitude": [0.02, 0.2],
         "angular_frequency": [low, fast]},
        {"kind": "box", "weight": BOX_WEIGHT, "duration": [long, _tidy(8 * long)],
         "ramp": [_tidy(RAMP * step), _tidy(4 * long)]},
    ]  # fmt: skip


def _from_point_to_point(step: float, widths: Sequence[float]) -> list[KindTable]:
    """Return moves from point to point: drives do not follow noise.

    Limits of speed and acceleration follow from the widths of the ranges; the times are in s.
    """
    speeds = [_tidy(width / (CROSSING * step)) for width in widths]
    limits = {
        "speed": speeds,
        "acceleration": [_tidy(speed / (SPEEDING_UP * step)) for speed in speeds],
    }
    short, long = (60, 200) if speeds else (100, 300)
    moves: KindTable = {
        "kind": "point_to_point",
        "weight": 0.4 if speeds else 0.7,
        "duration": [_tidy(short * step), _tidy(long * step)],
        "ramp": [0.2, 0.5],
        **(limits if speeds else {}),
        "dwell": 0.3,
        "dwell_duration": [_tidy(10 * step), _tidy(100 * step)],
    }
    single = {**moves, "weight": 0.2 if speeds else 0.3, "reach": 0.6, "keep": 0.3, "single": 0.3}
    on_their_own: KindTable = {"kind": "axis_moves", "weight": 0.4, **limits}
    return [moves, single, *([on_their_own] if speeds else [])]


def _turning(step: float) -> list[KindTable]:
    """Return motions of an angle; cosine and sine follow from it. Limits are in rad and s.

    Its speed rises and falls in long ramps, and in short and steep ones that come to rest.
    """
    speed = 2 * math.pi / (TURN * step)
    acceleration = _tidy(speed / (STANDING_START * step))
    ramps: KindTable = {
        "kind": "speed_ramps", "weight": 0.3, "speed": _tidy(speed), "acceleration": acceleration
    }  # fmt: skip
    steep: KindTable = {
        **ramps, "acceleration": _tidy(2 * acceleration), "samples": [2, 15], "rest": 0.1
    }  # fmt: skip
    driven: KindTable = {
        "kind": "axis_moves", "weight": 0.4, "speed": [_tidy(speed)],
        "acceleration": [acceleration],
    }  # fmt: skip
    return [ramps, steep, driven]


def _tidy(value: float) -> float:
    """Return the value with two significant digits."""
    return float(f"{value:.2g}")
