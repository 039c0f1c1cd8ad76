"""A sample step follows from the frequencies at which a machine works, where these are known.

Inputs at the highest of them have enough samples in a period. What a nonlinear machine makes of
them is faster: outputs under tones at these frequencies, over the whole ranges of all inputs, must
be seen by their samples too. What is faster than that, such as a resonance that the machine never
reaches, makes no step finer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of, on_circles, within_ranges
from slide_fmu.memory.bandwidth import PARTS, SAMPLES_PER_PERIOD, tidy_step
from slide_fmu.memory.step_remark import between_samples
from slide_fmu.systems.base import Motion, System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate_motions

LOST = 0.01
"""Outputs between samples differ by less than this part of their standard deviation from a cubic
spline through these: about the error of a good surrogate."""
FINEST = 20
"""Outputs are looked at in steps that are finer by this number; all tidy steps that are tried are
whole multiples of it."""
TONES, OCTAVES = 4, 2.0
"""Number of tones, and how far below the highest working frequency the lowest of them is at most;
slower tones hardly make faster parts."""
LASTS = 300
"""A tone lasts for this many samples of the step for the inputs, and counts in its later half."""


@dataclass(frozen=True)
class WorkingStep:
    """A WorkingStep is the sample step for a machine that works at known frequencies.

    Attributes:
        step: sample step in s.
        for_inputs: the step in s that suffices for the inputs.
        lost: largest part of its standard deviation by which an output between samples differs
            from a smooth curve through them; None where the model takes no finer step, or fails.
    """

    step: float
    for_inputs: float
    lost: float | None


def working_step(
    make: Callable[[float], System], system: System, highest: Sequence[float]
) -> WorkingStep:
    """Return the sample step for a machine that works up to some frequencies.

    Args:
        make: makes the system with a step in s.
        system: the system, with some step.
        highest: the highest working frequency of each input in Hz.
    """
    step = tidy_step(1.0 / (SAMPLES_PER_PERIOD[hold_of(system.inputs)] * max(highest)))
    seen = _outputs_at_work(make, step / FINEST, highest)
    lost = []
    for every in _multiples(step) if seen else []:
        lost.append(max(float(np.max(between_samples(rows, every))) for rows in seen))
        if lost[-1] <= LOST:
            return WorkingStep(float(f"{every * step / FINEST:.6g}"), step, lost[-1])
    return WorkingStep(step, step, lost[0] if lost else None)  # no step suffices


def _multiples(step: float) -> list[int]:
    """Return the tidy steps from one on downwards, as multiples of its part in ``FINEST``."""
    tidy = [step]
    while (finer := tidy_step(0.99 * tidy[-1])) > 1.01 * step / FINEST:
        tidy.append(finer)
    return [round(FINEST * one / step) for one in tidy]


def _outputs_at_work(
    make: Callable[[float], System], step: float, highest: Sequence[float]
) -> list[FloatArray]:
    """Return the outputs under tones at working frequencies, (samples, n_outputs) each.

    There are none where the system prescribes its own step, or fails under all of them.
    """
    try:
        system = make(step)
    except LoadError:
        return []
    for part in PARTS:
        lower = 2.0 ** np.linspace(-OCTAVES, 0.0, TONES)
        motions = [Motion(_tone(system, part, np.asarray(highest) * by)) for by in lower]
        answers = [
            answer[len(answer) // 2 :]
            for answer in simulate_motions(system, motions)
            if not isinstance(answer, SimulationError)
        ]
        if answers:
            return answers
    return []


def _tone(system: System, part: float, hz: FloatArray) -> FloatArray:
    """Return a tone in each input over a part of its range, (samples, n_inputs).

    Args:
        system: the system.
        part: the part of the ranges.
        hz: frequency in each input, (n_inputs,).
    """
    low, high = (np.array([getattr(s, end) for s in system.inputs]) for end in ("low", "high"))
    phases = np.random.default_rng(0).uniform(0.0, 2 * math.pi, len(low))
    time = system.step * np.arange(1, LASTS * FINEST + 1)
    swing = np.sin(2 * math.pi * hz * time[:, None] + phases)
    inputs = 0.5 * (low + high) + 0.5 * part * (high - low) * swing
    return on_circles(system.inputs, within_ranges(system.inputs, inputs))
