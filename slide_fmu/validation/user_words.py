"""Names of inputs as users set them say their frequencies, amplitudes, times and speeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from slide_fmu.core.units import ratio
from slide_fmu.excitation.words import between
from slide_fmu.validation.user_channels import Channel
from slide_fmu.validation.waveforms import HeldLevels, RepeatedMoves, Tonal, Waveform

SINE, TRIANGLE = "sine", "triangle"
"""Words in the names of kinds behind which frequency and amplitude stand."""


def told(name: str, channels: Sequence[Channel], motions: Sequence[Sequence[Waveform]]) -> str:
    """Return the name of a kind of input with the ranges of what was drawn.

    Args:
        name: of the kind, such as "a slow sine".
        channels: the channels.
        motions: a waveform of each channel, for each motion.
    """
    drawn = [(channel, found[k]) for found, (k, channel) in product(motions, enumerate(channels))]
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
