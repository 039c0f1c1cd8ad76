"""Tones that last at the resonances of a system show how far its outputs can go.

The gains of all outputs are measured under small sines in all inputs at once: each of them has
frequencies of its own, and what returns at these is its share. Where an output has its largest
gain besides that at rest, all inputs swing over their whole ranges, in the phases in which their
shares add up. A spring that hardens moves the resonance away from there, so frequencies around it
are swept through, too, upwards and downwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

LINES = 2048
"""The small sines have this number of samples in common, after which all of them begin again."""
PERIODS = (2, 6)
"""They are simulated this number of times; the last one shows gains without the beginning. The
second number is for systems that have not forgotten it after the first."""
FORGOTTEN = 0.02
"""Part of the outputs by which the last two times may differ."""
SMALL = (0.25, 0.05, 0.01)
"""Parts of the ranges over which they go, tried one after the other if the system fails."""
OVER = 1.2
"""A resonance has at least this multiple of the gain at the lowest frequency."""
TOP = 0.8
"""Resonances lie below this part of the highest frequency that the samples show."""
MOST = 6
"""Largest number of tones."""
SHORTEST, LONGEST = 500, 4000
"""Samples of a tone."""
SETTLED = 5.0
"""It lasts for this many times the time constant that the width of the resonance shows."""
SWEPT = (0.7, 1.5)
"""The sweeps go between these multiples of a resonance's frequency, each as long as its tone."""
FRACTIONS = (1.0, 0.5, 0.25)
"""Parts of the ranges over which a tone goes, tried one after the other if the system fails."""


@dataclass(frozen=True, eq=False)
class Tone:
    """A Tone swings all inputs of a system over their ranges at a resonance.

    Attributes:
        frequency: periods per sample.
        phases: of the inputs in rad, shape (n_inputs,).
        samples: how long it lasts.
        output: name of the output that answers most.
    """

    frequency: float
    phases: FloatArray
    samples: int
    output: str

    def inputs(self, system: System, part: float, swept: bool) -> FloatArray:
        """Return the inputs over a part of their ranges, about the middle, (samples, n_inputs)."""
        time = np.arange(self.samples)
        turned = self.frequency * time
        if swept:
            there = np.linspace(*SWEPT, self.samples)
            turned = self.frequency * np.cumsum(np.concatenate([there, there[::-1]]))
        swing: FloatArray = np.sin(2 * math.pi * turned[:, None] + self.phases)
        low, high = _ends(system)
        inputs: FloatArray = 0.5 * (low + high) + 0.5 * part * (high - low) * swing
        return inputs


def tones_of(system: System, seed: int) -> list[Tone]:
    """Return a tone for each output with a resonance, those of the same kind once.

    Raises:
        SimulationError: the system fails under small sines of all sizes.
    """
    tones = list[Tone]()
    gains = _gains(system, seed)
    low, high = _ends(system)
    for index, signal in enumerate(system.outputs):
        found = _resonance(np.abs(gains[:, index]) @ (0.5 * (high - low)))
        if found is None:
            continue
        line, place, constant = found
        phases = -np.angle(gains[line, index])
        samples = int(np.clip(SETTLED * constant, SHORTEST, LONGEST))
        tone = Tone(place / LINES, phases - phases[0], samples, signal.name)
        if len(tones) < MOST and not any(_alike(tone, other) for other in tones):
            tones.append(tone)
    return tones


def answers_to(
    system: System, tone: Tone
) -> tuple[list[FloatArray], tuple[float, SimulationError] | None]:
    """Return the outputs under a tone and its sweeps, each of shape (samples + 1, n_outputs).

    The second result is None, or the largest part of the ranges at which the system did not fail,
    0 if there is none, with its failure.
    """
    failed: SimulationError | None = None
    for part in FRACTIONS:
        try:
            answers = [
                simulate(system, tone.inputs(system, part, swept)).outputs
                for swept in (False, True)
            ]
        except SimulationError as error:
            failed = failed or error
            continue
        return answers, None if failed is None else (part, failed)
    assert failed is not None
    return [], (0.0, failed)


def _gains(system: System, seed: int) -> NDArray[np.complex128]:
    """Return gains of the outputs, shape (LINES // 2, n_outputs, n_inputs), at k / LINES a sample.

    Each input has every n-th line of n inputs. In between its gain has an inverse that goes
    straight, as it does near a resonance.
    """
    inputs, part = len(system.inputs), LINES // 2
    rng = np.random.default_rng(seed)
    lines, own = np.arange(1, part), np.arange(1, part) % inputs
    drawn = np.zeros((part + 1, inputs), dtype=np.complex128)
    drawn[lines, own] = np.exp(2j * math.pi * rng.uniform(size=len(lines)))
    waves = np.fft.irfft(drawn, LINES, axis=0)
    waves /= np.max(np.abs(waves), axis=0)
    small, outputs = _under(system, waves)
    answer = np.fft.rfft(outputs, axis=0)[:part]
    given = np.fft.rfft(small, axis=0)[:part]
    gains = np.zeros((part, outputs.shape[1], inputs), dtype=np.complex128)
    for index in range(inputs):
        mine = lines[own == index]
        measured = answer[mine] / given[mine, index][:, None]
        gains[:, :, index] = _between(measured, mine, part)
    return gains


def _under(system: System, waves: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return inputs over small parts of their ranges, (LINES, n_inputs), and the lasting outputs.

    The waves are between -1 and 1. The outputs have the shape (LINES, n_outputs).
    """
    low, high = _ends(system)
    failed: SimulationError | None = None
    for size in SMALL:
        small = 0.5 * (low + high) + 0.5 * size * (high - low) * waves
        try:
            for periods in PERIODS:
                outputs = simulate(system, np.tile(small, (periods, 1))).outputs[1:]
                before, last = outputs[-2 * LINES : -LINES], outputs[-LINES:]
                if np.all(np.std(last - before, axis=0) <= FORGOTTEN * np.std(last, axis=0)):
                    break
        except SimulationError as error:
            failed = failed or error
            continue
        return small, last
    assert failed is not None
    raise failed


def _between(
    gains: NDArray[np.complex128], lines: FloatArray, count: int
) -> NDArray[np.complex128]:
    """Return gains at ``count`` lines, (count, n_outputs), from those at some, (n, n_outputs)."""
    inverse = 1.0 / (gains + np.finfo(np.float64).tiny)
    columns = [np.interp(np.arange(count), lines, column) for column in inverse.T]
    return np.asarray(1.0 / np.stack(columns, axis=1), dtype=np.complex128)


def _resonance(gain: FloatArray) -> tuple[int, float, float] | None:
    """Return the line of the largest resonance of a gain, shape (LINES // 2,), or None.

    With it come its place between the lines, and its time constant in samples. Near a resonance,
    the inverse square of the gain is a parabola over the frequency.
    """
    inner = gain[1 : int(TOP * len(gain))]
    peaks = np.flatnonzero((inner[1:-1] > inner[:-2]) & (inner[1:-1] >= inner[2:])) + 2
    if not len(peaks):
        return None
    line = int(peaks[np.argmax(gain[peaks])])
    if gain[line] < OVER * gain[1]:
        return None
    before, here, after = (float(gain[line + k] ** -2) for k in (-1, 0, 1))
    bend = 0.5 * (before + after) - here
    shift = 0.25 * (before - after) / bend if bend > 0 else 0.0
    lowest = max(here - bend * shift**2, 0.0)
    half = math.sqrt(lowest / bend) if bend > 0 else math.inf  # where the power is a half
    return line, line + shift, LINES / (2 * math.pi * max(half, 1e-3))


def _alike(tone: Tone, other: Tone) -> bool:
    """Return whether two tones have nearly the same frequency and the same phases."""
    apart = np.angle(np.exp(1j * (tone.phases - other.phases)))
    near = abs(tone.frequency - other.frequency) < 1.5 / LINES
    return bool(near and np.max(np.abs(apart)) < 0.25 * math.pi)


def _ends(system: System) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the ranges of the inputs, shape (n_inputs,) each."""
    low, high = (np.array([getattr(s, end) for s in system.inputs]) for end in ("low", "high"))
    return low, high
