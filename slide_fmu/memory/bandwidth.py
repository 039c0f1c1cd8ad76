"""A sample step is proposed for a system, from the spectrum of its outputs.

A step is proposed before there is a recipe: inputs are drawn anew over their whole range every few
samples, so that they move at all frequencies, and the step follows from the frequency up to which
the outputs answer. In between the inputs go back to the same values, and outputs are looked at
there alone: what follows the inputs at once, by whatever law, is then always the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of, on_circles
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate

GAIN = 0.2
"""Beyond its bandwidth an output answers with less than this part of its largest gain: a lag of
first order at five times its corner, a weakly damped resonance a little above it. What is beyond
hardly counts, and to follow it would make the window many times as long."""
SMOOTHED = 16
"""A spectrum is the mean over about this many parts of a motion, which makes it smooth."""
SAMPLES_PER_PERIOD = {"zero_order": 5.0, "first_order": 10.0}
"""Samples in a period of the bandwidth; a resonance below it gets about twice as many. How inputs
that move go on within a step is forecast from their past: that takes more samples."""
SAMPLES, LEAD_IN = 4096, 1024
"""Samples of a spectrum, and those before it in which the start is forgotten."""
RESOLVED = 0.5
"""A bandwidth above this part of the highest frequency that samples show needs a finer step."""
WASTED = 0.04
"""A bandwidth below this part of it needs a coarser step to be seen sharply."""
BACK = 0.6
"""Inputs go back to this part of their ranges: not to the middle, where a product of an input and
a state may hide the state."""
EVERY = {"zero_order": 2, "first_order": 3}
"""Inputs are drawn at every such sample: those that are held are back one sample later, those that
move linearly rest there another sample later."""
ZOOM, ZOOMS = 4.0, 10
"""The step is changed by this factor, at most so many times."""
STATIC = 1e-4
"""An output of which less than this part of the power is left where the inputs are back has no
dynamics."""
PARTS = (1.0, 0.5, 0.25)
"""A system that fails under inputs over their whole ranges is given these parts of them."""
TIDY = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)


@dataclass(frozen=True)
class ProposedStep:
    """A step is proposed for a system.

    Attributes:
        step: sample step h in s.
        bandwidth: frequency in Hz up to which an output answers with ``GAIN`` of its largest gain;
            None where no output has dynamics that a spectrum shows.
        failed: what the system said where it failed under inputs over their whole ranges, so that
            they moved in a part of them; None if it did not.
    """

    step: float
    bandwidth: float | None
    failed: str | None = None


@dataclass(frozen=True)
class Bandwidth:
    """A bandwidth was seen in samples.

    Attributes:
        frequency: frequency in Hz up to which an output answers.
        part: the same relative to the highest frequency that the samples show.
    """

    frequency: float
    part: float


def proposed_step(make: Callable[[float], System], first: float = 0.01) -> ProposedStep:
    """Propose a sample step for a system.

    Args:
        make: makes the system with a step in s.
        first: the step in s that is tried first, which is also the answer where no output has
            dynamics.

    Raises:
        LoadError: the system cannot be made with the first step.
        SimulationError: it cannot be simulated with any step that was tried.
    """
    step, (found, failure) = first, _seen(make(first))
    for _ in range(ZOOMS):
        # where nothing is seen, only a finer step may show more
        part = 1.0 if found is None else found.part
        if WASTED <= part <= RESOLVED:
            break
        other = step / ZOOM if part > RESOLVED else step * ZOOM
        try:
            seen, failure = _seen(make(other))
        except LoadError:  # it has a step of its own
            break
        if part < WASTED and (seen is None or seen.part > RESOLVED):
            break
        step, found = other, seen
    else:
        if found is not None and found.part > RESOLVED:
            found = None  # it follows the step, as of a simulation that does not know its step
    failed = None if failure is None else str(failure)
    if found is not None:
        width = found.frequency
        samples = SAMPLES_PER_PERIOD[hold_of(make(step).inputs)]
        return ProposedStep(tidy_step(1.0 / (samples * width)), width, failed)
    if failure is not None:
        raise failure
    return ProposedStep(first, None)


def _seen(system: System) -> tuple[Bandwidth | None, SimulationError | None]:
    """Return the bandwidth of a system, and why it could not be simulated over whole ranges."""
    failure = None
    for part in PARTS:
        try:
            return bandwidth(system, part), failure
        except SimulationError as error:
            failure = error
    return None, failure


def bandwidth(system: System, part: float = 1.0) -> Bandwidth | None:
    """Return the frequency in Hz up to which an output answers with ``GAIN`` of its largest gain.

    What is drawn is white, so the spectrum of an output is that of its gain. The result is None if
    no output shows dynamics of its own. Inputs move in a part of their ranges, about the middle.

    Raises:
        SimulationError: the system could not be simulated.
    """
    from scipy.signal import welch  # slow to import, and not needed to size a window

    every = EVERY[hold_of(system.inputs)]
    outputs = simulate(system, _returning_inputs(system, every, part)).outputs[LEAD_IN:]
    # a system that grows has outputs whose squares are too large for a number
    outputs = outputs / np.maximum(np.max(np.abs(outputs), axis=0), np.finfo(np.float64).tiny)
    first = (every - LEAD_IN) % every
    back = outputs[first::every]
    own = np.var(back, axis=0) > STATIC * np.var(outputs, axis=0)
    if not own.any():
        return None
    length = SAMPLES // every // SMOOTHED * 2  # parts overlap by half
    rate = 1.0 / (every * system.step)
    frequency, power = welch(back[:, own], rate, nperseg=length, axis=0)
    answers = np.sqrt(power / power.max(axis=0)) > GAIN
    found = float(frequency[max(1, int(np.flatnonzero(answers.any(axis=1))[-1]))])
    return Bandwidth(found, 2.0 * found / rate)


def _returning_inputs(system: System, every: int, part: float) -> FloatArray:
    """Draw inputs at every so many samples; in between they are back at the same values."""
    rng = np.random.default_rng(0)
    low, high = (np.array([getattr(s, end) for s in system.inputs]) for end in ("low", "high"))
    low, high = (0.5 * ((1 + part) * a + (1 - part) * b) for a, b in ((low, high), (high, low)))
    inputs = np.tile(low + BACK * (high - low), (LEAD_IN + SAMPLES, 1))
    drawn = inputs[::every]
    drawn[:] = rng.uniform(low, high, drawn.shape)
    return on_circles(system.inputs, inputs)


def tidy_step(step: float) -> float:
    """Round a step down to a number with few digits."""
    unit = 10.0 ** math.floor(math.log10(step))
    digits = max(value for value in TIDY if value * unit <= step * (1.0 + 1e-12))
    return float(f"{digits * unit:.6g}")
