"""This module makes the default mix of excitation, which follows from the sample step.

Networks are accurate on inputs like those of their training. So the mix holds usual inputs of
machines: noise, sums of many and of few sines, single sines and sweeps in the band of the sample
step, steps and rests, each from small to large. Moving inputs go to a new level within one step
(``ramps``), unless they jump. Most smooth inputs are like sums of slow and fast
sines. Lasting sines let a resonance build up: they are what people try first, so that they reach
through the whole range and the whole band. Set points of drives get motions from point to
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
TONE = "harmonic"
"""The kind of lasting tones. With one input alone, they are a kind of their own: kinds take turns
where bounds are calibrated, and else such tones were a few motions of hundreds."""
ALONE_WEIGHT = 0.2
"""Weight, of 1 in all, of motions in which one of several inputs moves alone."""
BAND_WEIGHT = 0.25
"""Weight, of 1 in all, of motions at the working frequencies."""
PINK = [8, 30]
"""Numbers of sines whose frequencies are spread evenly over all octaves, as in pink noise."""
SLOWEST_RAMP = 16
"""The slowest motion between points of the box takes this many times the half period of the middle
frequency, on a scale of octaves."""
STANDING_START = 12
"""Number of samples in which it reaches that speed at its limit of acceleration."""

Band = tuple[float, float]
"""The lowest and the highest of some frequencies."""

KindTable = dict[str, str | bool | float | Sequence[float] | Sequence[Sequence[float]]]
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
    resonances: tuple[float, float] | None = None,
    bands: Sequence[Band | None] = (),
) -> list[KindTable]:
    """Return the tables ``data.excitation`` for a sample step in s, as a recipe may hold them.

    The widths of the ranges, in the units of the inputs, limit the speeds of set points; unknown
    widths give slower moves. Where several widths are known, some motions are of one input alone.
    Where some inputs are cosine and sine of an angle (``turning``), they have no box. Moving
    inputs that jump (``jumps``) do so in steps, from end to end, and where motions stop. Some
    sines are near the resonances, from the least to the largest frequency in rad/s, if they are
    known; and sines of working frequencies (``bands``, likewise, one for each input; None for all
    that the mix has) reach through the whole range. Set points and angles have limits of their
    speed instead of both.
    """
    if inputs == "set_points":
        return _from_point_to_point(step, widths)
    if inputs == "angle":
        return _turning(step)
    if inputs == "rates":
        mix = _smooth(step)
    elif inputs == "held" or inputs == "moving":
        mix = _mixed(step, inputs == "moving", jumps, resonances)
    else:
        assert_never(inputs)
    *others, box = mix
    kept = [] if turning else [box]
    if len(widths) > 1:
        kept += _alone(others)
    at_work = _sharing(_in_bands(_all_known(bands, step)), BAND_WEIGHT) if any(bands) else []
    rest = 1.0 - BOX_WEIGHT - (ALONE_WEIGHT if len(widths) > 1 else 0.0)
    return [*_sharing(others, rest - (BAND_WEIGHT if at_work else 0.0)), *at_work, *kept]


def _alone(others: Sequence[KindTable]) -> list[KindTable]:
    """Return the tables of one input alone: lasting tones, if the mix has some, and the rest."""
    if not any(one["kind"] == TONE for one in others):
        return [{"kind": "one_at_a_time", "weight": ALONE_WEIGHT}]
    half = ALONE_WEIGHT / 2
    tones: KindTable = {"kind": "one_at_a_time", "weight": half, "moves_as": TONE}
    return [tones, {"kind": "one_at_a_time", "weight": half}]


def highest_frequency(step: float) -> float:
    """Return the highest frequency in rad/s that the mix reaches, for a sample step in s."""
    return _tidy(TOP * math.pi / step)


def full_range_below(step: float, inputs: InputKind) -> float:
    """Return the frequency in rad/s up to which the sines of the mix reach the whole range."""
    highest = highest_frequency(step)
    return _tidy(highest / SLOW) if inputs == "rates" else highest


def further_excitation(step: float, inputs: InputKind, turning: bool = False) -> list[KindTable]:
    """Return the tables ``bound.excitation`` for a step in s, from which bounds alone learn.

    Where inputs move, they are motions that are straight between communication points. Samples
    hardly show whether these bend, so a network that learnt them would lose accuracy on smooth
    ones. There are none where some inputs are cosine and sine of an angle (``turning``): a
    straight line leaves the circle.
    """
    if inputs not in ("moving", "rates") or turning:
        return []
    top = highest_frequency(step)
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


def _mixed(
    step: float, moving: bool, jumps: bool, resonances: tuple[float, float] | None
) -> list[KindTable]:
    """Return the mix of noise, waves and steps.

    Inputs with a first-order hold are motions (``moving``), which hardly ever change at once: they
    do so by less and more rarely than forces, within a step. If they jump (``jumps``), they do it
    as often as forces, and in the midst of motions. Held inputs may be switched: they step through
    their range, and from end to end of it, and stay there for long. All inputs together are held
    at corners of the box of their ranges and inside of it. Frequencies are angular frequencies in
    rad/s, durations in s, amplitudes parts of the range.
    """
    top = highest_frequency(step)
    low = _tidy(top / 10**DECADES)
    middle = _tidy(math.sqrt(top * low))
    short, long = _tidy(5 * step), _tidy(math.pi / middle)
    jumping = jumps or not moving
    largest = 1.0 if jumping else 0.3
    samples = [1, 20] if not moving else [4, 20]
    end = _tidy(top / RESONANT[1])
    resonant = [_tidy(end) for end in resonances or (top / RESONANT[0], end)]
    longest = _tidy(4 * long) if jumping else long
    at_once: list[KindTable] = [
        {"kind": "steps", "weight": 0.1, "amplitude": [0.05, largest],
         "duration": [short, longest]},
        {"kind": "binary", "weight": 0.1, "amplitude": [0.5, 1.0], "duration": [short, longest]},
    ]  # fmt: skip
    if moving and jumps:
        at_once.append(
            {"kind": "stops", "weight": 0.1, "amplitude": [0.1, 1.0],
             "angular_frequency": [low, middle], "duration": [short, longest]}
        )  # fmt: skip
    if not jumping:
        at_once = [
            {"kind": "ramps", "weight": 0.05, "amplitude": [0.05, largest],
             "duration": [short, longest]}
        ]  # fmt: skip
    others: list[KindTable] = [
        {"kind": "filtered_random", "weight": 0.1, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, top]},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.05, 0.4],
         "angular_frequency": [low, middle]},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.02, 0.3],
         "angular_frequency": [middle, top]},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.05, 0.35],
         "angular_frequency": [low, top], "components": PINK, "decades": True},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.1, 0.5],
         "angular_frequency": [low, end], "components": [2, 4], "decades": True},
        {"kind": "multisine", "weight": 0.1, "amplitude": [0.1, 0.5],
         "angular_frequency": resonant, "components": [1, 3]},
        *_tones(low, top, (0.02, 1.0)),
        {"kind": "sweep", "weight": 0.1, "amplitude": [0.02, 1.0],
         "angular_frequency": [low, top], "decades": True},
        {"kind": "held_random", "weight": 0.15, "amplitude": [0.05, largest], "samples": samples},
        *at_once,
        {"kind": "rest", "weight": 0.05, "amplitude": [0.05, largest], "duration": [short, long]},
    ]  # fmt: skip
    box: KindTable = {
        "kind": "box",
        "weight": BOX_WEIGHT,
        "duration": [long, _tidy(8 * long)],
        "ramp": [_tidy(4 * step) if moving else _tidy(0.5 * step), _tidy(SLOWEST_RAMP * long)],
    }
    return [*others, box]


def _tones(low: float, high: float, amplitude: tuple[float, float]) -> list[KindTable]:
    """Return lasting sines, slow and fast alike, about the middle of the range and elsewhere."""
    smallest, largest = amplitude
    sine: KindTable = {
        "kind": "harmonic",
        "weight": 0.15,
        "amplitude": [smallest, largest],
        "angular_frequency": [low, high],
        "decades": True,
    }
    beside: KindTable = {
        "weight": 0.1,
        "amplitude": [smallest, 0.5 * largest],
        "offset": [0.1, 0.5],
    }
    return [sine, {**sine, **beside}]


def _all_known(bands: Sequence[Band | None], step: float) -> list[Band]:
    """Return the band of each input in rad/s, that of the whole mix where it is not known."""
    top = highest_frequency(step)
    return [band or (top / 10**DECADES, top) for band in bands]


def _in_bands(bands: Sequence[Band]) -> list[KindTable]:
    """Return motions at working frequencies in rad/s, up to the whole range."""
    tidy = [[_tidy(end) for end in band] for band in bands]
    if any(band != tidy[0] for band in tidy):
        sines: KindTable = {"kind": "band_sines", "bands": tidy}
        return [
            {**sines, "weight": 0.15, "amplitude": [0.1, 1.0]},
            {**sines, "weight": 0.1, "amplitude": [0.1, 0.5], "offset": [0.1, 0.5]},
            {**sines, "weight": 0.15, "amplitude": [0.14, 0.7], "components": [2, 4]},
        ]
    low, high = tidy[0]
    sine, beside = _tones(low, high, (0.1, 1.0))
    return [
        {**sine, "decades": False},
        {**beside, "decades": False},
        {"kind": "multisine", "weight": 0.15, "amplitude": [0.1, 0.5],
         "angular_frequency": [low, high], "components": [2, 4]},
    ]  # fmt: skip


def _sharing(tables: Sequence[KindTable], total: float) -> list[KindTable]:
    """Return tables whose weights have the same ratios, and add up to a total."""
    weights = [table["weight"] for table in tables]
    part = total / math.fsum(weight for weight in weights if isinstance(weight, float))
    return [_lighter(table, part) for table in tables]


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
    top = highest_frequency(step)
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
        *_tones(low, slow, (0.02, 1.0)),
        {"kind": "harmonic", "weight": 0.1, "amplitude": [0.02, 0.2],
         "angular_frequency": [slow, fast]},
        {"kind": "box", "weight": BOX_WEIGHT, "duration": [long, _tidy(8 * long)],
         "ramp": [_tidy(RAMP * step), _tidy(SLOWEST_RAMP * long)]},
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
