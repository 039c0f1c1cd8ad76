"""How finely a system must be sampled, from the spectrum of its outputs.

A step is proposed before there is a recipe: inputs are drawn anew at every sample over their whole
range, so that they move at all frequencies, and the step follows from the frequency up to which
the outputs answer. Of a recipe's own step it is found what is lost between the samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.data.draws import PROBE, PROBE_ATTEMPTS, Stream, draw
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import data_specification
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate

GAIN = 0.2
"""Beyond its bandwidth an output answers with less than this part of its largest gain: a lag of
first order at five times its corner, a weakly damped resonance a little above it. What is beyond
hardly counts, and to follow it would make the window many times as long."""
SMOOTHED = 16
"""A spectrum is the mean of about so many of parts of the record, which makes it smooth."""
SAMPLES_PER_PERIOD = 5.0
"""Samples in a period of the bandwidth; a resonance below it gets about twice as many."""
SAMPLES, LEAD_IN = 4096, 1024
"""Samples of a spectrum, and those before it in which the start is forgotten."""
RESOLVED = 0.5
"""A bandwidth above this part of the highest frequency that samples show needs a finer step."""
WASTED = 0.02
"""A bandwidth below this part of it needs a coarser step to be seen sharply."""
ZOOM, ZOOMS = 4.0, 10
"""The step is changed by this factor, at most so many times."""
STATIC = 1e-4
"""An output of which less than this part of the power is left without what follows the inputs at
once has no dynamics."""
FINER, FINE_SAMPLES = 4, 256
"""Between two samples of a recipe's step so many are simulated, along so many of its samples."""
COARSE, COARSER, WASTE = 0.1, 4, 0.005
"""Errors between samples, relative to the output's standard deviation: more than the first is too
coarse; if samples that are so many times rarer keep below the last, the step wastes samples."""
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
        part = 1.0 if found is None else 2.0 * found * step
        if WASTED <= part <= RESOLVED:
            break
        other = step / ZOOM if part > RESOLVED else step * ZOOM
        try:
            seen, failure = _seen(make(other))
        except LoadError:  # it has a step of its own
            break
        if part < WASTED and (seen is None or 2.0 * seen * other > RESOLVED):
            break
        step, found = other, seen
    failed = None if failure is None else str(failure)
    if found is not None:
        return ProposedStep(tidy_step(1.0 / (SAMPLES_PER_PERIOD * found)), found, failed)
    if failure is not None:
        raise failure
    return ProposedStep(first, None)


def _seen(system: System) -> tuple[float | None, SimulationError | None]:
    """Return the bandwidth of a system, and why it could not be simulated over whole ranges."""
    failure = None
    for part in PARTS:
        try:
            return bandwidth(system, part), failure
        except SimulationError as error:
            failure = error
    return None, failure


def bandwidth(system: System, part: float = 1.0) -> float | None:
    """Return the frequency in Hz up to which an output answers with ``GAIN`` of its largest gain.

    The inputs are white, so the spectrum of an output is that of its gain. What follows the inputs
    at once, by a linear law, is left out: it is as fast as they are. The result is None if nothing
    else is left of any output. Inputs move in a part of their ranges, about the middle.

    Raises:
        SimulationError: the system could not be simulated.
    """
    from scipy.signal import welch  # slow to import, and not needed to size a window

    rng = np.random.default_rng(0)
    low, high = (np.array([getattr(s, end) for s in system.inputs]) for end in ("low", "high"))
    low, high = (0.5 * ((1 + part) * a + (1 - part) * b) for a, b in ((low, high), (high, low)))
    inputs = rng.uniform(low, high, (LEAD_IN + SAMPLES, len(low)))
    outputs = simulate(system, inputs).outputs[LEAD_IN:-1]
    now, before = inputs[LEAD_IN:], inputs[LEAD_IN - 1 : -1]
    known = np.column_stack([np.ones(SAMPLES), now, before])
    rest = outputs - known @ np.linalg.lstsq(known, outputs, rcond=None)[0]
    own = np.sum(rest**2, axis=0) > STATIC * np.sum((outputs - outputs.mean(0)) ** 2, axis=0)
    if not own.any():
        return None
    length = SAMPLES // SMOOTHED * 2  # parts overlap by half
    frequency, power = welch(rest[:, own], 1.0 / system.step, nperseg=length, axis=0)
    answers = np.sqrt(power / power.max(axis=0)) > GAIN
    return float(frequency[max(1, int(np.flatnonzero(answers.any(axis=1))[-1]))])


def tidy_step(step: float) -> float:
    """Round a step down to a number with few digits."""
    unit = 10.0 ** math.floor(math.log10(step))
    digits = max(value for value in TIDY if value * unit <= step * (1.0 + 1e-12))
    return float(f"{digits * unit:.6g}")


def step_remark(recipe: Recipe) -> str | None:
    """Say that a recipe's step is too coarse or wastes samples; None if it does neither.

    The system is simulated more finely along a motion of the recipe. One that cannot be made with
    another step has no remark: its step is its own.

    Raises:
        SimulationError: the system could not be simulated.
    """
    step = recipe.window.step
    try:
        system = load_system(replace(data_specification(recipe), step=step / FINER))
    except LoadError:
        return None
    outputs = _finer_outputs(recipe, system)
    lost, rarer = (between_samples(outputs, FINER * times) for times in (1, COARSER))
    if lost > COARSE:
        return (
            f"window.step = {step:g} s: between its samples outputs differ by {100 * lost:.3g} % "
            f"of their standard deviation from a smooth curve through them; expected at most "
            f"{100 * COARSE:g} %: give a smaller step where what is between the samples counts"
        )
    if rarer < WASTE:
        return (
            f"window.step = {step:g} s: samples that are {COARSER} times rarer still show the "
            f"outputs to {100 * rarer:.2g} %; a larger step makes data, training and FMU cheaper"
        )
    return None


def between_samples(outputs: FloatArray, every: int) -> float:
    """Return the error of a cubic spline through every so many samples of outputs (N, n_outputs).

    It is the RMSE relative to the standard deviation, of the worst output that moves.
    """
    time = np.arange((len(outputs) - 1) // every * every + 1)
    true = outputs[: len(time)]
    moving = np.std(true, axis=0) > 0.0
    if not moving.any():
        return 0.0
    error = CubicSpline(time[::every], true[::every])(time) - true
    return float(np.max(np.sqrt(np.mean(error**2, axis=0))[moving] / np.std(true, axis=0)[moving]))


def _finer_outputs(recipe: Recipe, system: System) -> FloatArray:
    """Simulate a motion of a recipe more finely, the first on which the system does not fail."""
    for attempt in range(PROBE_ATTEMPTS):
        try:
            return simulate(system, _finer_inputs(recipe, system, attempt)).outputs
        except SimulationError as error:
            failure = error
    raise failure


def _finer_inputs(recipe: Recipe, system: System, attempt: int) -> FloatArray:
    """Draw inputs of a recipe, and put samples between them as they act between samples."""
    duration = FINE_SAMPLES * recipe.window.step
    stream = Stream(PROBE, recipe.data.seed, (1.0, 1.0), duration)
    inputs = draw(recipe, system, stream, 0, attempt).inputs[:FINE_SAMPLES]
    if hold_of(system.inputs) == "zero_order":
        return np.repeat(inputs, FINER, axis=0)
    before = np.concatenate([inputs[:1], inputs[:-1]])
    parts = np.arange(1, FINER + 1)[:, None] / FINER
    return np.concatenate([b + parts * (a - b) for b, a in zip(before, inputs, strict=True)])
