"""Inputs as users set them: tones in all inputs, triangles, levels, stops and moves.

A random trajectory of a recipe hardly ever holds a tone, a level or a limit for long. Users do.
Motions, which are angles and inputs that a recipe drives as axes, stay within the speeds and
accelerations that its excitation declares; other inputs may jump.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from typing import final

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import ratio
from slide_fmu.excitation.descriptions import between
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import motions_at_once
from slide_fmu.validation.calls import InputsLabel, MeasuredMotion
from slide_fmu.validation.reference_motion import finest, reference_motions
from slide_fmu.validation.row import AS_SET
from slide_fmu.validation.task import Task, entropy_of
from slide_fmu.validation.user_channels import Channel, channels_of
from slide_fmu.validation.waveforms import (
    HeldLevels,
    RepeatedMoves,
    StoppedTone,
    Tonal,
    Tone,
    Triangle,
    Waveform,
)

SINES = "a sine in each input"
"""Inputs that all have a tone; tones in one input alone are a group of their own (``tones``)."""

SINE, TRIANGLE = "sine", "triangle"
"""Words in the names of kinds behind which frequency and amplitude stand."""


def name_with_ranges(
    name: str, channels: Sequence[Channel], motions: Sequence[Sequence[Waveform]]
) -> str:
    """Return the name of a kind of input with the ranges of what was drawn.

    Args:
        name: of the kind, such as "a slow sine".
        channels: the channels.
        motions: a waveform of each channel, for each motion.
    """
    drawn = [
        (channel, waveforms[k])
        for waveforms, (k, channel) in product(motions, enumerate(channels))
    ]
    tones = [(channel, one) for channel, one in drawn if isinstance(one, Tonal)]
    if tones:
        word = SINE if SINE in name else TRIANGLE
        return name.replace(word, f"{word} of {_tones(tones)}", 1)
    times = [time for _, one in drawn if isinstance(one, HeldLevels) for time in one.times]
    if times:
        return f"{name} every {_range(times, 's')}"
    moves = [(channel, one) for channel, one in drawn if isinstance(one, RepeatedMoves)]
    units = {channel.unit for channel, _ in moves}
    if len(units) != 1:
        return name
    fastest = max(one.speed for _, one in moves)
    return f"{name} at up to {_range([fastest], ratio(units.pop(), 's'))}"


def _tones(tones: Sequence[tuple[Channel, Tonal]]) -> str:
    """Say frequency and amplitude, which has a unit if all channels have the same one."""
    hz = _range([one.hz for _, one in tones], "Hz")
    units = {channel.unit for channel, _ in tones}
    if len(units) == 1:
        size = _range([one.amplitude for _, one in tones], units.pop())
    else:
        shares = [100 * one.amplitude / _width(channel) for channel, one in tones]
        size = f"{_range(shares, '%')} of each range"
    return f"{hz} with an amplitude of {size}"


def _width(channel: Channel) -> float:
    """Return the width of a channel's range; of an angle it is a turn."""
    return 2 * math.pi if channel.turns else channel.high - channel.low


def _range(values: Sequence[float], unit: str) -> str:
    low, high = (float(f"{end:.2g}") for end in (min(values), max(values)))
    return between((low, high), unit)


FULL, MARGIN = 0.9, 0.999
"""Tones fill this part of the range at most; motions use this part of their limits."""

DISTANCES = (0.1, 1.0)
"""Range of the length of a move, as a part of its axis' range; angles turn by up to ``TURNS``."""

TURNS = 3.0

SLOW, WHOLE = (0.0, 0.3), (0.0, 1.0)
"""Where slow tones and all tones lie in the logarithm of the band of a channel."""

SEED = 0x05E75
"""Entropy of the draws; no training uses it."""


Drawing = Callable[[Channel, np.random.Generator], Waveform]


def _tone(channel: Channel, rng: np.random.Generator, band: tuple[float, float]) -> Tone:
    """Draw a tone within the range, and within the limits of a motion."""
    low, high = channel.frequencies
    frequency = low * (high / low) ** rng.uniform(*band)
    level = 0.0 if channel.turns else 0.5 * (channel.low + channel.high)
    most = [math.pi if channel.turns else 0.5 * (channel.high - channel.low)]
    if channel.speed is not None and channel.acceleration is not None:
        most += [channel.speed / frequency, channel.acceleration / frequency**2]
    amplitude = FULL * rng.uniform(0.3, 1.0) * min(most)
    return Tone(level, amplitude, frequency, rng.uniform(-math.pi, math.pi))


def _sine(channel: Channel, rng: np.random.Generator) -> Waveform:
    return _tone(channel, rng, WHOLE)


def _stop(channel: Channel, rng: np.random.Generator) -> Waveform:
    tone, lasts = _tone(channel, rng, SLOW), channel.times[1]
    at = lasts * rng.uniform(1.0, 3.0)
    until = _jump(channel, at + lasts * rng.uniform(1.0, 2.0))
    return StoppedTone(tone, at, until, channel.rest)


def _triangle(channel: Channel, rng: np.random.Generator) -> Waveform:
    tone = _tone(channel, rng, SLOW)
    ends = tone.level - tone.amplitude, tone.level + tone.amplitude
    return Triangle(*ends, tone.frequency, tone.phase)


def _steps(channel: Channel, rng: np.random.Generator) -> Waveform:
    levels = rng.uniform(channel.low, channel.high, 8)
    return HeldLevels(tuple(levels.tolist()), tuple(_times(channel, rng, 8)))


def _switches(channel: Channel, rng: np.random.Generator) -> Waveform:
    ends = (channel.high, channel.low) if rng.random() < 0.5 else (channel.low, channel.high)
    return HeldLevels(ends, tuple(_times(channel, rng, 2)))


def _moves(channel: Channel, rng: np.random.Generator, effort: float, rests: bool) -> Waveform:
    assert channel.speed is not None
    assert channel.acceleration is not None
    part = rng.uniform(*DISTANCES)
    if channel.turns:
        start, way = rng.uniform(-math.pi, math.pi), part * TURNS * 2 * math.pi
    else:
        way = part * (channel.high - channel.low)
        start = rng.uniform(channel.low, channel.high - way)
    share = MARGIN * rng.uniform(effort, 1.0)
    rest = _times(channel, rng, 1)[0] if rests else 0.0
    return RepeatedMoves(start, way, share * channel.speed, share * channel.acceleration, rest)


def _with_rests(channel: Channel, rng: np.random.Generator) -> Waveform:
    return _moves(channel, rng, 0.3, True)


def _at_limits(channel: Channel, rng: np.random.Generator) -> Waveform:
    return _moves(channel, rng, 1.0, False)


def _times(channel: Channel, rng: np.random.Generator, count: int) -> list[float]:
    low, high = np.log(channel.times)
    return [_jump(channel, float(value)) for value in np.exp(rng.uniform(low, high, count))]


def _jump(channel: Channel, time: float) -> float:
    """Return the time in s of a jump, or from one to the next, near a time."""
    if channel.grid is None:
        return time
    return max(1, round(time / channel.grid)) * channel.grid


OF_INPUTS: dict[str, Drawing] = {
    SINES: _sine,
    "a slow triangle": _triangle,
    "steps": _steps,
    "a slow sine that stops, then a release": _stop,
    "switches between the limits": _switches,
}
"""Kinds of inputs that may jump."""

OF_MOTIONS: dict[str, Drawing] = {
    SINES: _sine,
    "moves and rests": _with_rests,
    "moves at the limits": _at_limits,
}
"""Kinds of motions, which have limits of speed and acceleration."""


@final
@dataclass(frozen=True, eq=False)
class UserInput:
    """A UserInput has a waveform for each channel, as a function of time."""

    channels: tuple[Channel, ...]
    waveforms: tuple[Waveform, ...]

    def __call__(self, times: FloatArray) -> FloatArray:
        pairs = zip(self.channels, self.waveforms, strict=True)
        return np.concatenate([one.columns(waveform(times)) for one, waveform in pairs], axis=1)


@dataclass(frozen=True, eq=False)
class DrawnKind:
    """A DrawnKind has inputs of one kind, which are still to be simulated.

    Attributes:
        label: its group and name.
        inputs: of each motion.
        durations: of each motion behind the burn-in, in s.
    """

    label: InputsLabel
    inputs: Sequence[UserInput]
    durations: Sequence[float]


def user_kinds(surrogate: Surrogate, case: Case, task: Task, each: int) -> list[DrawnKind]:
    """Draw inputs as users set them.

    Another seed of the validation gives others, and its duration is that of the motions.

    Args:
        surrogate: the surrogate.
        case: what it was made from.
        task: the validation.
        each: number of motions of each kind.
    """
    channels = user_channels(surrogate, case)
    kinds = OF_MOTIONS if any(channel.moves for channel in channels) else OF_INPUTS
    if len(channels) == 1:  # its tones are measured alone
        kinds = {name: drawing for name, drawing in kinds.items() if name != SINES}
    drawn = []
    for number, (name, drawing) in enumerate(kinds.items()):
        of_kind = []
        for index in range(each):
            rng = np.random.default_rng([SEED, number, index, entropy_of(task.seed)])
            waveforms = tuple(drawing(channel, rng) for channel in channels)
            of_kind.append(UserInput(channels, waveforms))
        words = name_with_ranges(name, channels, [inputs.waveforms for inputs in of_kind])
        durations = [task.duration_of(case.recipe)] * each
        drawn.append(DrawnKind(InputsLabel(AS_SET, words), of_kind, durations))
    return drawn


def simulated_kinds(
    surrogate: Surrogate, case: Case, kinds: Sequence[DrawnKind], progress: Progress
) -> dict[InputsLabel, list[MeasuredMotion]]:
    """Simulate the reference on inputs of all kinds, from rest on; failures are named.

    Inputs that each move by themselves act at their own times: the reference is simulated at its
    own fine step. Planned motions and angles are given by their samples, as its models know them;
    so are all inputs of a model without a finer step. All motions go together, since a model that
    simulates many at once takes as long for few.

    Args:
        surrogate: the surrogate.
        case: what it was made from.
        kinds: the inputs.
        progress: hears of each motion.
    """
    every = [inputs for kind in kinds for inputs in kind.inputs]
    durations = [duration for kind in kinds for duration in kind.durations]
    motions = _simulated(surrogate, case, every, durations, progress)
    by_label: dict[InputsLabel, list[MeasuredMotion]] = {}
    for kind in kinds:
        found, failed = _divided(islice(motions, len(kind.inputs)))
        by_label[replace(kind.label, failed=failed)] = found
    return by_label


def user_channels(surrogate: Surrogate, case: Case) -> tuple[Channel, ...]:
    """Return the channels of a surrogate's inputs."""
    memory = surrogate.window.n_in * surrogate.window.step
    return channels_of(case.recipe, case.reference, memory)


def _divided(
    motions: Iterable[MeasuredMotion | SimulationError],
) -> tuple[list[MeasuredMotion], tuple[str, ...]]:
    """Return the motions that could be simulated, and why others could not."""
    every = list(motions)
    failed = tuple(str(one) for one in every if isinstance(one, SimulationError))
    return [one for one in every if isinstance(one, MeasuredMotion)], failed


def _simulated(
    surrogate: Surrogate,
    case: Case,
    every: Sequence[UserInput],
    durations: Sequence[float],
    progress: Progress,
) -> Iterator[MeasuredMotion | SimulationError]:
    """Simulate the reference on inputs over durations in s behind the burn-in, all from rest on.

    They act at their own times, where the model has a finer step and its inputs may jump.
    """
    step = case.recipe.window.step
    burn_in = round(case.recipe.data.burn_in / step)
    first = max(burn_in + 1, surrogate.network.memory_length)
    samples = [(burn_in + round(duration / step), first) for duration in durations]
    moving = any(channel.moves for inputs in every for channel in inputs.channels)
    fine = None if moving else finest(case)
    progress(0, len(every))
    # of motions that are simulated together, the first says nothing about the others
    each = motions_at_once(case.reference, 1) == 1
    motions = reference_motions(surrogate, case, every, fine, samples)
    for done, motion in enumerate(motions, start=1):
        if each or done == len(every):
            progress(done, len(every))
        yield motion
