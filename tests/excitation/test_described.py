"""Every kind of excitation says in words what it draws."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import TypeAdapter

from slide_fmu.core.signals import Signal
from slide_fmu.excitation.kinds import Excitation, reported_names_of

STEP = 0.01
FORCE = Signal("force", "N", -2.0, 2.0)
SHIFTED = Signal("temperature", "K", 280.0, 300.0)
SHARE = Signal("opening", "1", -1.0, 1.0)
ANGLE = (
    Signal("x", "1", -1.0, 1.0, angle="cosine"),
    Signal("y", "1", -1.0, 1.0, angle="sine"),
)
JOINTS = (Signal("a", "rad", -1.0, 1.0), Signal("b", "rad", -1.0, 1.0))
MIXED = (Signal("a", "rad", -1.0, 1.0), Signal("b", "m", -1.0, 1.0))

OF_ONE_INPUT: dict[str, tuple[dict[str, Any], str]] = {
    "held_random": (
        {"samples": [1, 5]},
        "force takes random values of up to 2 N, each for 0.01 to 0.05 s",
    ),
    "moving_average_random": (
        {"coefficients": [0.5, 0.3, 0.2]},
        "force is a weighted sum of the last 3 random values of up to 2 N, one every 0.01 s",
    ),
    "filtered_random": (
        {"amplitude": [0.3, 0.6], "angular_frequency": [5.0, 60.0]},
        "force is noise through a low-pass filter of 5 to 60 rad/s, with an RMS of 0.6 to 1.2 N, "
        "clipped to its range",
    ),
    "harmonic": (
        {"angular_frequency": [5.0, 5.0]},
        "force is a lasting sine of 5 rad/s with an amplitude of 2 N",
    ),
    "harmonic about an offset": (
        {"angular_frequency": [2.0, 5.0], "decades": True, "offset": [0.5, 1.0]},
        "force is a lasting sine of 2 to 5 rad/s, slow ones as often as fast ones, with an "
        "amplitude of 2 N, about an offset of 1 to 2 N",
    ),
    "sweep through octaves": (
        {"angular_frequency": [5.0, 60.0], "decades": True},
        "force is a sine that sweeps from 5 to 60 rad/s, or back, as long through each octave, "
        "with an amplitude of 2 N",
    ),
    "sweep": (
        {"amplitude": [0.5, 1.0], "angular_frequency": [5.0, 60.0]},
        "force is a sine that sweeps from 5 to 60 rad/s, or back, with an amplitude of 1 to 2 N",
    ),
    "multisine": (
        {"amplitude": [0.25, 0.25], "angular_frequency": [5.0, 60.0], "components": [4, 9]},
        "force is a sum of 4 to 9 sines of 5 to 60 rad/s, with an RMS of 0.5 N, clipped to its "
        "range",
    ),
    "multisine about an offset": (
        {"angular_frequency": [5.0, 6.0], "components": [1, 1], "offset": [0.5, 1.0]},
        "force is a sine of 5 to 6 rad/s, with an RMS of 2 N, about an offset of 1 to 2 N, "
        "clipped to its range",
    ),
    "multisine between points": (
        {"angular_frequency": [5.0, 6.0], "components": [2, 3], "points": [0.004, 0.08]},
        "force is a sum of 2 to 3 sines of 5 to 6 rad/s, with an RMS of 2 N, clipped to its "
        "range; it is straight or held between points 0.01 to 0.08 s apart",
    ),
    "steps": (
        {"duration": [0.3, 0.5]},
        "force steps between random levels of up to 2 N, each for 0.3 to 0.5 s",
    ),
    "ramps": (
        {"duration": [0.3, 0.5]},
        "force goes to random levels of up to 2 N, each within 0.01 s, and stays there for 0.3 to "
        "0.5 s",
    ),
    "stops": (
        {"duration": [0.3, 0.5], "angular_frequency": [1.0, 3.0]},
        "force moves by up to 2 N in sums of sines of 1 to 3 rad/s for 0.3 to 0.5 s, stops at "
        "once for 0.3 to 0.5 s, and so on",
    ),
    "binary": (
        {"duration": [0.3, 0.5]},
        "force switches between plus and minus 2 N, each for 0.3 to 0.5 s",
    ),
    "rest": (
        {"duration": [0.3, 0.5]},
        "force takes random values of up to 2 N, one every 0.01 s, for 0.3 to 0.5 s, then rests "
        "for 0.3 to 0.5 s, and so on",
    ),
}
OF_SEVERAL: dict[str, tuple[tuple[Signal, ...], dict[str, Any], str]] = {
    "speed_ramps": (
        ANGLE,
        {"speed": 8.0, "acceleration": 20.0},
        "the angle of x and y turns at up to 8 rad/s, to and fro, in phases of 0.2 to 0.6 s with "
        "constant accelerations of up to 20 rad/s^2 (no box: shorter phases were not drawn)",
    ),
    "speed_ramps with rest and noise": (
        ANGLE,
        {"speed": 8.0, "acceleration": 20.0, "samples": [5, 5], "rest": 0.2, "noise": 0.1},
        "the angle of x and y turns at up to 8 rad/s, to and fro, in phases of 0.05 s with "
        "constant accelerations of up to 20 rad/s^2 (no box: shorter phases were not drawn), and "
        "comes to rest in 20 % of them; speeds are noisy by 10 % of the limit",
    ),
    "point_to_point": (
        JOINTS,
        {"keep": 0.0},
        "all inputs together move from point to point within 100 % of their ranges, in 1 s, at "
        "speeds of up to 4 and 4 rad/s, with accelerations of up to 8 and 8 rad/s^2",
    ),
    "point_to_point with ramps": (
        JOINTS,
        {"keep": 0.0, "reach": 0.5, "duration": [0.5, 2.0], "ramp": [0.1, 0.4], "speed": [3, 2]},
        "all inputs together move from point to point within 50 % of their ranges, in 0.5 to 2 s, "
        "at speeds of up to 3 and 2 rad/s, with accelerations of up to 44.4 and 44.4 rad/s^2",
    ),
    "point_to_point with limits": (
        JOINTS,
        {
            **{"speed": [1.5, 2.0], "acceleration": [3.0, 4.0], "dwell": 0.4, "reach": 0.6},
            **{"duration": [1.0, 2.0], "single": 0.1},
        },
        "all inputs together move from point to point within 60 % of their ranges, in 1 to 2 s, "
        "at speeds of up to 1.5 and 2 rad/s, with accelerations of up to 3 and 4 rad/s^2, and "
        "rest after 40 % of the moves for 0.1 to 1 s; in 20 % of the moves some stay; in 10 % of "
        "the moves one alone moves",
    ),
    "axis_moves": (
        (*ANGLE, MIXED[1]),
        {"speed": [8.0, 0.5], "acceleration": [20.0, 2.0]},
        "every axis moves on its own from target to target, near and far, at speeds of up to 8 "
        "rad/s, 0.5 m/s and accelerations of up to 20 rad/s^2, 2 m/s^2 (a box: moves reach both); "
        "some moves stop or turn back on the way",
    ),
    "axis_moves with held set points": (
        ANGLE,
        {"speed": [0.4], "acceleration": [5.0], "hold": [2, 6]},
        "the axis moves from target to target, near and far, at speeds of up to 0.4 rad/s and "
        "accelerations of up to 5 rad/s^2 (a box: moves reach both); some moves stop or turn back "
        "on the way; set points are held for 0.02 to 0.06 s",
    ),
    "band_sines": (
        MIXED,
        {"bands": [[30.0, 90.0], [1.0, 6.0]], "offset": [0.1, 0.5], "components": [2, 4]},
        "every input on its own is 2 to 4 sines in a band of its own in rad/s (a 30 to 90, b 1 to "
        "6) with an amplitude of 100 % of half its range, about an offset of 10 to 50 % of half "
        "its range",
    ),
    "one_at_a_time": (
        MIXED,
        {},
        "one input alone moves, as in the other kinds, and the others rest",
    ),
    "one_at_a_time as a tone": (
        MIXED,
        {"moves_as": "harmonic"},
        "one input alone moves, as in harmonic, and the others rest",
    ),
    "box": (
        MIXED,
        {"duration": [2.0, 5.0], "ramp": [0.1, 1.0]},
        "all inputs are held at the ends of the range and inside of it by turns, each for 2 to 5 "
        "s; a move takes 0.1 to 1 s",
    ),
    "vibration": (
        MIXED,
        {"angular_frequency": [30.0, 90.0], "acceleration": [50.0, 2.0]},
        "every input moves from point to point within 80 % of its range, in 2 to 8 s, and shakes "
        "on the way at 30 to 90 rad/s with accelerations of up to 50 rad/s^2 and 2 m/s^2; 30 % "
        "of the times one input shakes alone",
    ),
}


def described(name: str, signals: tuple[Signal, ...], **extra: object) -> str:
    table = {"kind": name.split()[0], "weight": 1.0, **extra}
    kind = TypeAdapter(Excitation).validate_python(table)
    kind.check(signals)
    return str(kind.described(signals, STEP))


@pytest.mark.parametrize("name", OF_ONE_INPUT)
def test_kind_describes_what_it_does_to_one_input_in_its_unit(name: str) -> None:
    table, expected = OF_ONE_INPUT[name]
    assert described(name, (FORCE,), **table) == expected


@pytest.mark.parametrize("name", OF_SEVERAL)
def test_kind_of_all_inputs_describes_what_it_does_to_them(name: str) -> None:
    signals, table, expected = OF_SEVERAL[name]
    assert described(name, signals, **table) == expected


def test_all_kinds_are_described_here() -> None:
    kinds = {get_args(kind.model_fields["kind"].annotation)[0] for kind in _classes()}
    named = {name.split()[0] for name in (*OF_ONE_INPUT, *OF_SEVERAL)}
    assert kinds == named | {"file"}


def _classes() -> tuple[Any, ...]:
    return get_args(get_args(Excitation)[0])


@pytest.mark.parametrize(
    ("signals", "expected"),
    [
        (
            (SHIFTED,),
            "temperature is a lasting sine of 5 rad/s with an amplitude of 10 K about 29",
        ),
        ((SHARE,), "opening is a lasting sine of 5 rad/s with an amplitude of 1"),
        (ANGLE, "the angle of x and y is a lasting sine of 5 rad/s with an amplitude of 180 deg "),
        (
            JOINTS,
            "every input on its own is a lasting sine of 5 rad/s with an amplitude of 100 % ",
        ),
    ],
)
def test_sizes_are_in_the_unit_of_one_input_and_shares_of_several(
    signals: tuple[Signal, ...], expected: str
) -> None:
    assert described("harmonic", signals, angular_frequency=[5.0, 5.0]).startswith(expected)


@pytest.mark.parametrize(
    ("scale", "more"),
    [
        ([1.0, 1.0], ""),
        ([0.5, 2.0], ", whose deviations from the means are scaled by 0.5 to 2"),
    ],
)
def test_recorded_inputs_name_their_file(scale: list[float], more: str, tmp_path: Path) -> None:
    path = tmp_path / "road.csv"
    path.write_text("time,force\n0,1\n1,-1\n", encoding="utf-8")
    text = described("file", (FORCE,), path=str(path), scale=scale)
    assert text == f"the inputs are parts of the file road.csv{more}"


def test_kinds_of_one_name_are_told_apart_by_a_setting() -> None:
    tables = [
        {"kind": "multisine", "amplitude": [0.1, 0.5], "angular_frequency": [0.3, 5.0]},
        {"kind": "multisine", "amplitude": [0.2, 0.2], "angular_frequency": [0.3, 94.0]},
        {"kind": "multisine", "amplitude": [0.1, 0.5], "angular_frequency": [0.3, 94.0]},
        {"kind": "harmonic", "angular_frequency": [2.0, 2.0]},
        {"kind": "held_random", "amplitude": [0.1, 0.5]},
        {"kind": "held_random", "amplitude": [0.25, 0.25]},
        {"kind": "moving_average_random", "coefficients": [0.5, 0.5]},
        {"kind": "moving_average_random", "coefficients": [0.5, 0.3, 0.2]},
    ]
    kinds = TypeAdapter(list[Excitation]).validate_python([{"weight": 1.0, **t} for t in tables])
    assert reported_names_of(kinds) == [
        "multisine 1 of 0.3 to 5 rad/s",
        "multisine 2 of amplitude 0.2",
        "multisine 3",  # it shares each setting with one of the others
        "harmonic",
        "held_random 5 of amplitude 0.1 to 0.5",
        "held_random 6 of amplitude 0.25",
        "moving_average_random 7",  # of a list of numbers
        "moving_average_random 8",
    ]
