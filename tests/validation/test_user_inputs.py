"""Inputs as users set them keep their ranges and limits, and their words repeat them."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.data.draws import TEST, Stream, draw_inputs
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System
from slide_fmu.validation.user_channels import Channel, channels_of
from slide_fmu.validation.user_inputs import KINDS, Point
from tests.recipes import tiny_state_space_recipe

STEP = 0.02
TIME = STEP * np.arange(1500)

FREQUENCIES, TIMES = (1.0, 60.0), (0.02, 2.0)
FORCE = Channel((Signal("force", "N", -300.0, 1000.0),), -300.0, 1000.0, 0.0, FREQUENCIES, TIMES)
HEATED = Channel((Signal("heat", "K", 280.0, 320.0),), 280.0, 320.0, 290.0, FREQUENCIES, TIMES)
JOINT = Channel(
    (Signal("joint", "rad", 0.1234567, 2.5),), 0.1234567, 2.5, 0.5, FREQUENCIES, TIMES, 1.4, 5.7
)
COSINE, SINE = (
    Signal(f"{part}_of", "1", -2.0, 2.0, hold="first_order", angle=part)
    for part in ("cosine", "sine")
)
ANGLE = Channel((COSINE, SINE), -math.inf, math.inf, 0.0, FREQUENCIES, TIMES, 8.0, 20.0)

NUMBER = r"(-?[\d.]+(?:e-?\d+)?)"


def repeated(words: str, unit: str, time: FloatArray) -> FloatArray:
    """The values of one channel, made of the words alone."""
    of_unit = f"(?: {re.escape(unit)})?" if unit else ""
    if words.startswith("moves"):
        found = re.fullmatch(
            rf"moves from {NUMBER}{of_unit} (to|on by) {NUMBER}{of_unit} "
            rf"(and back|again and again), at up to {NUMBER}\D+ and {NUMBER}\D[^,]*"
            rf"(?:, and rests {NUMBER} s after each move)?",
            words,
        )
        assert found is not None, words
        start, target, speed, acceleration = (float(found[k]) for k in (1, 3, 5, 6))
        way = target if found[2] == "on by" else target - start
        rest = float(found[7] or 0.0)
        return stepped(start, way, speed, acceleration, rest, found[2] == "on by", time)
    body = words.removeprefix("= ")
    if body.endswith("and so on"):
        parts = re.findall(rf"{NUMBER}{of_unit} for {NUMBER} s", body)
        levels, times = np.array(parts, dtype=np.float64).T
        index = np.searchsorted(np.cumsum(times), np.mod(time + 1e-9, times.sum()), side="right")
        return np.asarray(levels[np.minimum(index, len(levels) - 1)])
    unit_text = r"(?: [^\s(]+)?"
    level = re.match(rf"{NUMBER}{of_unit}(?= [+-] |$)", body)
    total = np.full(len(time), float(level[1]) if level else 0.0)
    for sign, rate in re.findall(rf"(^|[+-] ){NUMBER}{unit_text} t(?= |$)", body):
        total += float(rate) * time * (-1.0 if sign == "- " else 1.0)
    for tone in re.findall(rf"{NUMBER}{unit_text} sin\({NUMBER} t \+ {NUMBER}\)", body):
        amplitude, frequency, phase = map(float, tone)
        total += amplitude * np.sin(frequency * time + phase)
    return total


def stepped(
    start: float,
    way: float,
    speed: float,
    most: float,
    rest: float,
    onward: bool,
    time: FloatArray,
) -> FloatArray:
    """Trapezoids of speed, integrated piece by piece."""
    way_of_ramp = speed**2 / most
    peak = speed if abs(way) > way_of_ramp else math.sqrt(abs(way) * most)
    ramp, cruise = peak / most, max(abs(way) - peak**2 / most, 0.0) / peak
    begin, position, sign, found = 0.0, start, math.copysign(1.0, way), np.empty(len(time))
    while begin <= time[-1]:
        t = time - begin
        first = 0.5 * most * np.clip(t, 0, ramp) ** 2
        middle = peak * np.clip(t - ramp, 0, cruise)
        late = np.clip(t - ramp - cruise, 0, ramp)
        now = t >= -1e-12
        found[now] = (position + sign * (first + middle + peak * late - 0.5 * most * late**2))[now]
        position += sign * abs(way)
        begin += 2 * ramp + cruise + rest
        sign = sign if onward else -sign
    return found


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("channel", [FORCE, HEATED, JOINT, ANGLE], ids=lambda one: one.name)
def test_inputs_keep_their_limits_and_are_repeated_by_their_words(
    channel: Channel, kind: str
) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        made = Point.random(kind, 1, rng).user_input((channel,))
        (waveform,) = made.waveforms
        values = waveform.values(TIME)
        words = waveform.words(channel.unit)
        assert made.words == f"{channel.name} {words}"
        np.testing.assert_allclose(repeated(words, channel.unit, TIME), values, atol=2e-6)
        assert channel.low - 1e-9 <= values.min() < values.max() <= channel.high + 1e-9
        if channel.speed is not None and channel.acceleration is not None:
            assert np.abs(np.diff(values)).max() <= channel.speed * STEP * (1 + 1e-6)
            assert np.abs(np.diff(values, 2)).max() <= channel.acceleration * STEP**2 * (1 + 1e-6)


def test_switches_reach_both_limits() -> None:
    made = Point.random("limits", 1, np.random.default_rng(0)).user_input((FORCE,))
    assert set(made.inputs(TIME).ravel()) == {-300.0, 1000.0}
    (waveform,) = (
        Point.random("limits", 1, np.random.default_rng(0)).user_input((ANGLE,)).waveforms
    )
    assert (waveform.speed, waveform.acceleration) == (8.0, 20.0)  # type: ignore[attr-defined]


def test_angles_are_given_by_cosine_and_sine_of_their_length() -> None:
    inputs = Point.random("tone", 1, np.random.default_rng(0)).user_input((ANGLE,)).inputs(TIME)
    np.testing.assert_allclose(np.hypot(*inputs.T), 2.0)


def test_one_input_alone_or_all_are_driven() -> None:
    rng, counts = np.random.default_rng(0), set()
    for _ in range(20):
        inputs = Point.random("tone", 3, rng).user_input((FORCE, HEATED, JOINT)).inputs(TIME)
        counts.add(int(np.sum(np.ptp(inputs, axis=0) > 0)))
    assert counts == {1, 3}


def test_point_near_another_has_nearly_its_input() -> None:
    rng = np.random.default_rng(1)
    point = Point.random("tone", 2, rng)
    near = point.near(1e-6, rng)
    first, second = (one.user_input((FORCE, HEATED)).inputs(TIME[:50]) for one in (point, near))
    assert np.abs(first - second).max() < 3.0  # N and K, by rounding
    far = point.near(5.0, rng)
    assert far.place.min() >= 0.0
    assert far.place.max() <= 1.0


class Driven(System):
    """A system of signals alone."""

    def __init__(self, inputs: tuple[Signal, ...]) -> None:
        self.step, self.inputs, self.outputs = STEP, inputs, ()

    def simulate(self, inputs: FloatArray) -> FloatArray:
        raise NotImplementedError


def recipe_of(*kinds: dict[str, object]) -> Recipe:
    return tiny_state_space_recipe(
        data={"excitation": [{"weight": 1.0, **kind} for kind in kinds]}
    )


def test_limits_of_motions_are_the_largest_that_a_kind_declares() -> None:
    ramps = [
        {"kind": "speed_ramps", "speed": speed, "acceleration": acceleration}
        for speed, acceleration in ((8.0, 20.0), (2.0, 60.0))
    ]
    (angle,) = channels_of(recipe_of(*ramps), Driven((COSINE, SINE)), 1.0)
    assert (angle.speed, angle.acceleration, angle.unit) == (8.0, 60.0, "rad")
    joints = tuple(Signal(f"q{k}", "rad", -1.0, 1.0, hold="first_order") for k in (1, 2))
    moves = {"kind": "point_to_point", "speed": [1.0, 2.0], "acceleration": [5.0, 6.0]}
    found = channels_of(recipe_of(moves, {"kind": "point_to_point"}), Driven(joints), 1.0)
    assert [(one.speed, one.acceleration) for one in found] == [(1.0, 5.0), (2.0, 6.0)]


def test_limits_that_no_kind_declares_are_measured() -> None:
    recipe = recipe_of({"kind": "harmonic", "angular_frequency": [2.0, 5.0]})
    system = Driven((COSINE, SINE))
    (angle,) = channels_of(recipe, system, 1.0)
    assert angle.frequencies == (0.5 * math.pi, 5.0)
    assert angle.speed is not None
    assert angle.acceleration is not None
    assert 2.0 < angle.speed <= 5.0 * math.pi
    assert angle.acceleration <= 25.0 * math.pi
    stream = Stream(TEST, recipe.data.seed, (1.0, 1.0), recipe.data.duration)
    inputs = draw_inputs(recipe, system, stream, 0).inputs
    turned = np.abs(np.diff(np.unwrap(np.arctan2(inputs[:, 1], inputs[:, 0]))))
    assert turned.max() / recipe.window.step <= angle.speed


def test_inputs_that_may_jump_have_no_limits() -> None:
    recipe = tiny_state_space_recipe()
    (force,) = channels_of(recipe, case_of(recipe).system, 1.0)
    assert (force.speed, force.acceleration) == (None, None)
    assert force.frequencies[1] < math.pi / recipe.window.step
