"""Lasting tones in one input at a time: what people try first, over the whole band and range.

The plane of frequency and amplitude is divided into cells, each with as many motions as a kind of
input has. The other inputs are at rest, or constant elsewhere in their ranges.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slide_fmu.core.readable import decimal
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.calls import InputsLabel
from slide_fmu.validation.row import TONES, ToneCell
from slide_fmu.validation.task import Task, entropy_of
from slide_fmu.validation.user_channels import Channel
from slide_fmu.validation.user_inputs import DrawnKind, UserInput, user_channels
from slide_fmu.validation.waveforms import Tone

COLUMNS, WIDEST = 5, 2.0
"""Number of parts of the band, and the largest ratio of the ends of one. The slowest part has what
is left: errors grow where a system cannot follow slowly any more."""

AMPLITUDES = (0.1, 0.5, 1.0)
"""Ends of the parts of the amplitudes, as parts of half the range of an input."""

PERIODS, SAMPLES = 3, 100
"""A tone lasts for this number of periods and of samples at least once outputs and bounds count,
unless motions of the validation are shorter."""

SEED = 0x70E5
"""Entropy of the draws; no training uses it."""


@dataclass(frozen=True, eq=False)
class _ToneMotion:
    """A tone in one input, and its frequency in Hz."""

    inputs: UserInput
    hz: float


def tone_kinds(surrogate: Surrogate, case: Case, task: Task, each: int) -> list[DrawnKind]:
    """Draw lasting tones in one input at a time, by their cells.

    Inputs take turns. In every other motion the tone has an offset, and the other inputs are
    constant somewhere in their ranges; in the others all are as near to their start values as the
    ranges allow. Motions keep their limits of speed and acceleration, so that cells of fast and
    large ones may be empty; these are left out.

    Args:
        surrogate: the surrogate.
        case: what it was made from.
        task: the validation.
        each: number of motions of each cell.
    """
    channels = user_channels(surrogate, case)
    kinds = []
    for number, cell in enumerate(_cells(channels)):
        of_cell: list[_ToneMotion] = []
        for index in range(each):
            rng = np.random.default_rng([SEED, number, index, entropy_of(task.seed)])
            of_cell += list(_drawn(channels, cell, index, rng))
        if of_cell:
            label = InputsLabel(TONES, name_of_cell(cell), tones=cell)
            durations = [_duration(surrogate, case, task, motion.hz) for motion in of_cell]
            kinds.append(DrawnKind(label, [motion.inputs for motion in of_cell], durations))
    return kinds


def name_of_cell(cell: ToneCell) -> str:
    """Say which tones are in a cell."""
    side = "below" if cell.amplitude[0] == AMPLITUDES[0] else "above"
    return f"tones of {band_text(cell.hz)} Hz {side} half of the range"


def band_text(hz: tuple[float, float]) -> str:
    """Write a band in Hz without its unit."""
    return " to ".join(decimal(float(f"{end:.2g}")) for end in hz)


def _cells(channels: Sequence[Channel]) -> Iterator[ToneCell]:
    """Yield all cells, slow ones first, and those of one band behind each other."""
    low = min(channel.frequencies[0] for channel in channels) / (2 * math.pi)
    high = max(channel.frequencies[1] for channel in channels) / (2 * math.pi)
    ratio = min(WIDEST, (high / low) ** (1 / COLUMNS))
    parts = [low, *(high / ratio**place for place in reversed(range(COLUMNS)))]
    edges = [float(f"{edge:.2g}") for edge in parts]
    for hz in pairwise(edges):
        for amplitude in pairwise(AMPLITUDES):
            yield ToneCell(hz=hz, amplitude=amplitude)


def _drawn(
    channels: Sequence[Channel], cell: ToneCell, index: int, rng: np.random.Generator
) -> Iterator[_ToneMotion]:
    """Draw a tone of a cell in the input whose turn it is; nothing where it may not move so."""
    chosen, offset = index % len(channels), bool(index // len(channels) % 2)
    low, high = cell.hz
    hz = float(low * (high / low) ** rng.uniform())
    part, size = rng.uniform(), _most(channels[chosen], 2 * math.pi * hz)
    least, most = cell.amplitude[0], min(cell.amplitude[1], size)
    if most <= least:
        return
    waveforms = []
    for place, channel in enumerate(channels):
        half = _half(channel)
        amplitude = (least + part * (most - least)) * half if place == chosen else 0.0
        level, phase = rng.uniform(-1, 1), rng.uniform(-math.pi, math.pi)
        waveforms.append(
            Tone(
                _level(channel, amplitude, level if offset else None),
                amplitude,
                2 * math.pi * hz,
                float(phase),
            )
        )
    yield _ToneMotion(UserInput(tuple(channels), tuple(waveforms)), hz)


def _half(channel: Channel) -> float:
    """Return half the range of a channel; half a turn of an angle."""
    return math.pi if channel.turns else 0.5 * (channel.high - channel.low)


def _most(channel: Channel, frequency: float) -> float:
    """Return the largest amplitude of a tone in rad/s, as a part of half the range."""
    most = [1.0]
    if channel.speed is not None and channel.acceleration is not None:
        half = frequency * _half(channel)
        most += [channel.speed / half, channel.acceleration / (frequency * half)]
    return min(most)


def _level(channel: Channel, amplitude: float, offset: float | None) -> float:
    """Return the middle of a tone: near rest, or an offset from -1 to 1 within the range."""
    if channel.turns:
        return 0.0 if offset is None else math.pi * offset
    low, high = channel.low + amplitude, channel.high - amplitude
    if offset is None:
        return min(max(channel.rest, low), high)
    return 0.5 * (low + high) + 0.5 * offset * (high - low)


def _duration(surrogate: Surrogate, case: Case, task: Task, hz: float) -> float:
    """Return how long a tone lasts behind the burn-in, in s."""
    step, burn_in = case.recipe.window.step, case.recipe.data.burn_in
    filled = 0 if surrogate.bound is None else surrogate.bound.filling_length
    first = max(surrogate.network.memory_length, filled) * step - burn_in
    lasting = max(PERIODS / hz, SAMPLES * step)
    return min(max(first, 0.0) + lasting, task.duration_of(case.recipe))
