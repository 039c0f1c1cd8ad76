"""A sample step is proposed for a system from the spectrum of its outputs.

The step is proposed before there is a recipe. Inputs are drawn over their whole range every few
samples, so that they contain all frequencies. The step follows from the frequency up to which the
outputs respond. In between the inputs return to the same values, and outputs are evaluated only
there: a static part of the response, of any law, is then always the same.

Drives do not follow such noise, and what answers to the rates of its inputs answers the more the
faster they are: no step would be fine enough. There, the step follows from the motion that is left
after the inputs have come to rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.signals import FloatArray, Hold, hold_of, on_circles
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate

GAIN = 0.2
"""Beyond its bandwidth an output responds with less than this fraction of its largest gain: a lag
of first order at five times its corner frequency, a weakly damped resonance a little above its
own. Higher frequencies hardly count, and following them would lengthen the window many times."""
SMOOTHED = 16
"""Approximate number of parts of a motion over which a spectrum is averaged, to smooth it."""
SAMPLES_PER_PERIOD: dict[Hold, float] = {"zero_order": 10.0, "first_order": 20.0}
"""Least number of samples in a period of the bandwidth; a resonance below it gets about twice that
number. Moving inputs are forecast within a step from their past, which takes more samples."""
OWN_SAMPLES = 10.0
"""Least number of samples in a period of a mode, or of the motion that is left, where the step
follows from that. Set points and rates are drawn the faster the finer the step is."""
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
TIDY = (1.0, 2.0, 5.0)
"""Steps are these numbers times a power of ten: the usual steps of importers, 1, 2, 5 and 10 ms,
then divide them or are divided by them, or both fit soon into the same time."""
GROWS = 3
"""A bandwidth beyond what can be seen at this many steps, each finer by ``ZOOM``, is taken for a
response to the rates of the inputs if the system moves on by itself far more slowly."""
PIECES, PIECE, AT_ONCE, AT_END = 24, 64, 4, 8
"""The motion that is left is seen in this many pieces of this many samples. Inputs go to new
values in the first sample of a piece and rest there; its first samples, in which a spline arrives,
do not count, and the mean of its last ones stands for where it goes."""
LEFT = 0.02
"""What is left must be this part of the standard deviation of an output to say something."""
FEW, MANY = 8.0, 64.0
"""With fewer or more samples in a period of the motion that is left, another step is tried."""
GENTLE = (1.0, 0.25, 0.05)
"""Fractions of the input ranges in which inputs go to rest, tried as ``PARTS`` are."""


@dataclass(frozen=True)
class ProposedStep:
    """A ProposedStep is the sample step proposed for a system.

    Attributes:
        step: sample step h in s.
        bandwidth: frequency in Hz up to which an output responds with ``GAIN`` of its largest
            gain; None if no output shows dynamics in its spectrum.
        own: frequency in Hz of the motion that is left after the inputs have come to rest, where
            the step follows from it; else None.
        failed: error of the system under inputs over their whole ranges, so that a fraction of the
            ranges was used; None if it did not fail.
    """

    step: float
    bandwidth: float | None
    failed: str | None = None
    own: float | None = None


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
    driven: bool = False,
) -> ProposedStep:
    """Propose a sample step for a system.

    Args:
        make: makes the system with a step in s.
        first: the step in s that is tried first; it is also the result if no output has dynamics.
        progress: shows how many steps were tried.
        enough: frequency in Hz for outputs that follow the rates of inputs; the search ends where
            a bandwidth above it is seen, or none: in finer steps, rates hide the rest even more.
        driven: whether the inputs are set points of drives or an angle, which follow no noise:
            the step follows from the motion that is left after they have come to rest.

    Raises:
        LoadError: the system cannot be made with the first step.
        SimulationError: it cannot be simulated with any step that was tried.
    """
    most = ZOOMS + 1
    progress(0, most)
    if driven:
        proposed = _by_itself(make, first, progress) or ProposedStep(first, None)
    else:
        proposed = _from_bandwidth(make, first, progress, enough)
    progress(most, most)
    return proposed


def _from_bandwidth(
    make: Callable[[float], System], first: float, progress: Progress, enough: float | None
) -> ProposedStep:
    """Propose a step from the bandwidth that is seen at some steps; as ``proposed_step``."""
    step, (band, failure) = first, _measured(make(first))
    beyond, most = 0, ZOOMS + 1
    for tried in range(1, most):
        progress(tried, most)
        beyond = beyond + 1 if _is_beyond(band) else 0
        if beyond == GROWS:
            with suppress(SimulationError):  # it may not be simulated with the first step
                own = _by_itself(make, first)
                if own is not None:
                    return own
        other = _next_step(step, band, enough)
        if other is None:
            break
        try:
            seen, failure = _measured(make(other))
        except LoadError:  # the system prescribes its own step
            break
        if other > step and (seen is None or _is_beyond(seen)):
            break
        step, band = other, seen
    else:
        if _is_beyond(band):
            band = None  # it scales with the step, as in a simulation that ignores its step
    if band is None:
        if failure is not None:
            raise failure
        return ProposedStep(first, None)
    width, samples = band.frequency, SAMPLES_PER_PERIOD[hold_of(make(step).inputs)]
    failed = None if failure is None else str(failure)
    return ProposedStep(tidy_step(1.0 / (samples * width)), width, failed)


def _is_beyond(band: Bandwidth | None) -> bool:
    """Return whether a bandwidth lies beyond what its samples resolve."""
    return band is not None and band.part > RESOLVED


def _next_step(step: float, band: Bandwidth | None, enough: float | None) -> float | None:
    """Return the step in s to try after one; None where the bandwidth that it shows will do."""
    # if nothing is visible, only a finer step may show more
    part = 1.0 if band is None else band.part
    if WASTED <= part <= RESOLVED:
        return None
    if enough is not None and (band is None or band.frequency > enough):
        return None
    return step / ZOOM if part > RESOLVED else step * ZOOM


def _measured(system: System) -> tuple[Bandwidth | None, SimulationError | None]:
    """Return the bandwidth of a system, and the error if it failed over its whole ranges."""
    return _in_parts(partial(bandwidth, system), PARTS)


Result = TypeVar("Result")


def _in_parts(
    see: Callable[[float], Result], parts: Sequence[float]
) -> tuple[Result | None, SimulationError | None]:
    """Return what is seen in the first fraction of the ranges without a failure, and the last one.

    The first is None if the system failed in all of them.
    """
    failure = None
    for part in parts:
        try:
            return see(part), failure
        except SimulationError as error:
            failure = error
    return None, failure


def _by_itself(
    make: Callable[[float], System], first: float, progress: Progress = quiet
) -> ProposedStep | None:
    """Propose a step from the motion that is left after the inputs have come to rest.

    The result is None if nothing is left at the step that is tried first, or if no step that was
    tried shows its period by ``FEW`` samples or more.
    """
    step, tried, proposed = first, set[float](), None
    while step not in tried and len(tried) <= ZOOMS:
        progress(len(tried), ZOOMS + 1)
        tried.add(step)
        try:
            system = make(step)
        except LoadError:  # the system prescribes its own step
            break
        seen, failure = _in_parts(partial(own_frequency, system), GENTLE)
        if failure is not None and seen is None and proposed is None:
            raise failure
        if seen is None:
            break
        failed = None if failure is None else str(failure)
        in_period = 1.0 / (seen * step)
        if in_period >= FEW:
            proposed = ProposedStep(tidy_step(1.0 / (OWN_SAMPLES * seen)), None, failed, seen)
        if FEW <= in_period <= MANY:
            break
        step = step / ZOOM if in_period < FEW else step * ZOOM
    return proposed


def own_frequency(system: System, part: float = 1.0) -> float | None:
    """Return the mean frequency in Hz of the motion that is left when the inputs rest again.

    It is the RMS of the rate of an output over the RMS of its distance from where it goes, over 2
    pi: the frequency of a weakly damped vibration, and the corner frequency of a lag. The fastest
    output counts. The result is None if no output moves on. Inputs go to values in a fraction of
    their ranges, about the middle.
    """
    rng = np.random.default_rng(0)
    low, high = _ends(system, part)
    values = rng.uniform(low, high, (PIECES, len(low)))
    inputs = on_circles(system.inputs, np.repeat(values, PIECE, axis=0))
    outputs = simulate(system, inputs).outputs[1:]
    moved = np.std(outputs, axis=0)
    pieces = outputs.reshape(PIECES, PIECE, -1)
    ends = pieces[:, -AT_END:].mean(axis=1, keepdims=True)
    left = (pieces - ends)[:, AT_ONCE:-AT_END]
    size, rate = (np.sqrt(np.mean(part**2, axis=(0, 1))) for part in (left, np.diff(left, axis=1)))
    own = size > LEFT * moved
    if not own.any():
        return None
    return float(np.max(rate[own] / size[own])) / (2 * math.pi * system.step)


def bandwidth(system: System, part: float = 1.0) -> Bandwidth | None:
    """Return the frequency in Hz up to which an output responds with ``GAIN`` of its largest gain.

    The drawn values are white noise, so the spectrum of an output is that of its gain. The result
    is None if no output shows its own dynamics. Inputs move in a fraction of their ranges, about
    the middle.
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
    highest = float(frequency[max(1, int(np.flatnonzero(answers.any(axis=1))[-1]))])
    return Bandwidth(highest, 2.0 * highest / rate)


def _returning_inputs(system: System, every: int, part: float) -> FloatArray:
    """Draw inputs at every ``every``-th sample; in between they return to the same values."""
    rng = np.random.default_rng(0)
    low, high = _ends(system, part)
    inputs = np.tile(low + BACK * (high - low), (LEAD_IN + SAMPLES, 1))
    drawn = inputs[::every]
    drawn[:] = rng.uniform(low, high, drawn.shape)
    return on_circles(system.inputs, inputs)


def _ends(system: System, part: float) -> tuple[FloatArray, FloatArray]:
    """Return the ends of a fraction of the input ranges about their middle, (n_inputs,) each."""
    low, high = (np.array([getattr(s, end) for s in system.inputs]) for end in ("low", "high"))
    return (
        0.5 * ((1 + part) * low + (1 - part) * high),
        0.5 * ((1 + part) * high + (1 - part) * low),
    )


def lost_by_lines(frequency: float, step: float) -> float:
    """Return which part of the amplitude of a sine straight lines between its samples lose.

    Args:
        frequency: frequency of the sine in Hz.
        step: time between the samples in s.
    """
    return (2 * math.pi * frequency * step) ** 2 / 12


def tidy_step(step: float) -> float:
    """Round a step down to 1, 2 or 5 times a power of ten."""
    unit = 10.0 ** math.floor(math.log10(step))
    digits = max(value for value in TIDY if value * unit <= step * (1.0 + 1e-12))
    return float(f"{digits * unit:.6g}")
