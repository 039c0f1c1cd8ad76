"""A sample step is proposed for a system from the spectrum of its outputs.

The step is proposed before there is a recipe. Inputs are drawn over their whole range every few
samples, so that they contain all frequencies. The step follows from the frequency up to which the
outputs respond. In between the inputs return to the same values, and outputs are evaluated only
there: a static part of the response, of any law, is then always the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.signals import FloatArray, hold_of, on_circles
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate

GAIN = 0.2
"""Beyond its bandwidth an output responds with less than this fraction of its largest gain: a lag
of first order at five times its corner frequency, a weakly damped resonance a little above its
own. Higher frequencies hardly count, and following them would lengthen the window many times."""
SMOOTHED = 16
"""Approximate number of parts of a motion over which a spectrum is averaged, to smooth it."""
SAMPLES_PER_PERIOD = {"zero_order": 5.0, "first_order": 10.0}
"""Samples in a period of the bandwidth; a resonance below it gets about twice that number. Moving
inputs are forecast within a step from their past, which takes more samples."""
SAMPLES, LEAD_IN = 4096, 1024
"""Samples of a spectrum, and samples before it in which the initial state is forgotten."""
RESOLVED = 0.5
"""A bandwidth above this fraction of the highest frequency in the samples needs a finer step."""
WASTED = 0.04
"""A bandwidth below this fraction of it needs a coarser step to be resolved."""
BACK = 0.6
"""Inputs return to this fraction of their ranges. It is not the middle, where a product of an
input and a state may hide the state."""
EVERY = {"zero_order": 2, "first_order": 3}
"""Inputs are drawn once in this number of samples. A held input has returned one sample later; a
linearly moving one stays there for one more sample."""
ZOOM, ZOOMS = 4.0, 10
"""Factor by which the step is changed, and the largest number of changes."""
STATIC = 1e-4
"""An output has no dynamics if less than this fraction of its power remains where the inputs have
returned."""
PARTS = (1.0, 0.5, 0.25)
"""Fractions of the input ranges, tried one after the other if the system fails."""
TIDY = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)


@dataclass(frozen=True)
class ProposedStep:
    """A ProposedStep is the sample step proposed for a system.

    Attributes:
        step: sample step h in s.
        bandwidth: frequency in Hz up to which an output responds with ``GAIN`` of its largest
            gain; None if no output shows dynamics in its spectrum.
        failed: error of the system under inputs over their whole ranges, so that a fraction of the
            ranges was used; None if it did not fail.
    """

    step: float
    bandwidth: float | None
    failed: str | None = None


@dataclass(frozen=True)
class Bandwidth:
    """A Bandwidth was measured in samples of outputs.

    Attributes:
        frequency: frequency in Hz up to which an output responds.
        part: this frequency relative to the highest one that the samples resolve.
    """

    frequency: float
    part: float


def proposed_step(
    make: Callable[[float], System],
    first: float = 0.01,
    progress: Progress = quiet,
    enough: float | None = None,
) -> ProposedStep:
    """Propose a sample step for a system.

    Args:
        make: makes the system with a step in s.
        first: the step in s that is tried first; it is also the result if no output has dynamics.
        progress: shows how many steps were tried.
        enough: frequency in Hz for outputs that follow the rates of inputs; the search ends where
            a bandwidth above it is seen, or none: in finer steps, rates hide the rest even more.

    Raises:
        LoadError: the system cannot be made with the first step.
        SimulationError: it cannot be simulated with any step that was tried.
    """
    most = ZOOMS + 1
    progress(0, most)
    step, (found, failure) = first, _seen(make(first))
    for tried in range(1, most):
        progress(tried, most)
        # if nothing is visible, only a finer step may show more
        part = 1.0 if found is None else found.part
        if WASTED <= part <= RESOLVED:
            break
        if enough is not None and (found is None or found.frequency > enough):
            break
        other = step / ZOOM if part > RESOLVED else step * ZOOM
        try:
            seen, failure = _seen(make(other))
        except LoadError:  # the system prescribes its own step
            break
        if part < WASTED and (seen is None or seen.part > RESOLVED):
            break
        step, found = other, seen
    else:
        if found is not None and found.part > RESOLVED:
            found = None  # it scales with the step, as in a simulation that ignores its step
    progress(most, most)
    failed = None if failure is None else str(failure)
    if found is not None:
        width = found.frequency
        samples = SAMPLES_PER_PERIOD[hold_of(make(step).inputs)]
        return ProposedStep(tidy_step(1.0 / (samples * width)), width, failed)
    if failure is not None:
        raise failure
    return ProposedStep(first, None)


def _seen(system: System) -> tuple[Bandwidth | None, SimulationError | None]:
    """Return the bandwidth of a system, and the error if it failed over its whole ranges."""
    failure = None
    for part in PARTS:
        try:
            return bandwidth(system, part), failure
        except SimulationError as error:
            failure = error
    return None, failure


def bandwidth(system: System, part: float = 1.0) -> Bandwidth | None:
    """Return the frequency in Hz up to which an output responds with ``GAIN`` of its largest gain.

    The drawn values are white noise, so the spectrum of an output is that of its gain. The result
    is None if no output shows its own dynamics. Inputs move in a fraction of their ranges, about
    the middle.

    Raises:
        SimulationError: the system could not be simulated.
    """
    from scipy.signal import welch  # slow to import, and not needed to size a window

    every = EVERY[hold_of(system.inputs)]
    outputs = simulate(system, _returning_inputs(system, every, part)).outputs[LEAD_IN:]
    # outputs of a growing system have squares that overflow
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
    """Draw inputs at every ``every``-th sample; in between they return to the same values."""
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
