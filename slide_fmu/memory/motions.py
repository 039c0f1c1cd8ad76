"""The memory of a system is linearized, and measured, along the motions of its recipe.

The equations are linearized along motions if the system offers that. The decay is measured on
pairs of motions of any system, which are lengthened until they meet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.draws import Draw, Stream, draw, split_stream
from slide_fmu.data.failing_motions import RunnableDraws
from slide_fmu.memory.decay import (
    Decay,
    decay_along,
    decay_in_pieces,
    measured_decay,
    recommend_window,
)
from slide_fmu.memory.modes import Spectrum, UnstableModeError, spectrum
from slide_fmu.memory.time_budget import TIMED_SAMPLES, TimeBudget
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Linearizable, Motion, RandomStates, System
from slide_fmu.systems.simulation import states_along

MOTIONS = 40
"""Largest number of pairs of motions that are measured."""
LINEARIZED_MOTIONS = 20
"""Largest number of motions along which the equations are linearized."""
LINEARIZED_SAMPLES = 40_000
"""After this number of samples linearizing stops, but not before ``LEAST_MEASURED`` motions."""
SHARE = 0.5
"""Linearizing simulates at most this share of the samples of the data, and measuring at most as
many as these, so that a window costs a small recipe little more time than its data."""
WINDOWS_PER_MOTION = 10
"""Largest length of these motions, in input windows."""
POINTS_PER_WINDOW = 8
"""Number of states in each window at which the equations are linearized."""
MEASURED_DECAYS = 3.0
"""Smallest length of the measured motions, in decay times."""
MEASURED_SAMPLES, LEAST_MEASURED = 20_000, 4
"""After the first number of samples measuring stops, but not before the second number of motions:
if the decay takes long, a few pairs show what the window needs."""
GROWTH = 32
"""Motions grow to this multiple of their first length before they count as never meeting."""
FURTHER, LINEARIZING = "further motions to linearize along", 0.4
"""Fraction of a limited time for linearizing: measuring shows more."""
MEETING = 0.5
"""Fraction of the measured pairs that must meet; otherwise the system does not forget."""


@dataclass(frozen=True, eq=False)
class LinearizedSystem:
    """A LinearizedSystem is a system linearized at rest and along motions.

    Attributes:
        modes: modes of the system linearized at rest.
        decay: decay along parts of the recipe's motions, each as long as the input window, or as
            the mean decay time if that is longer.
        local_worst: the longest decay time in s at a single instant; infinite if a mode grows for
            a moment.
    """

    modes: Spectrum
    decay: Decay
    local_worst: float


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions are drawn to size a recipe's window.

    Attributes:
        recipe: the recipe whose excitation is drawn.
        system: the recipe's system.
        stream: their seeds, and the length of motions to linearize.
        most: largest number of motions, or of pairs of them.
        runnable: skips draws on which the system fails.
        patience: the time that they may take in total.
    """

    recipe: Recipe
    system: System
    stream: Stream
    most: int
    runnable: RunnableDraws
    patience: TimeBudget

    @property
    def data_samples(self) -> int:
        """The number of samples of all trajectories of the recipe, burn-in included."""
        data = self.recipe.data
        length = (data.duration + data.burn_in) / self.recipe.window.step
        return int(self.recipe.total_count * length)

    def inputs(self, index: int, count: int) -> FloatArray:
        """Draw the inputs of a motion of at least ``count`` samples, shape (count, n_inputs)."""
        duration = max(self.stream.duration, count * self.recipe.window.step)
        whole = replace(self.stream, duration=duration)
        return self._drawn(whole, index, count).inputs

    def drawn(self, index: int) -> Draw:
        """Draw a motion of the stream's length."""
        return self._drawn(self.stream, index, None)

    def _drawn(self, stream: Stream, index: int, count: int | None) -> Draw:
        return self.runnable.drawn(
            index, count, lambda attempt: draw(self.recipe, self.system, stream, index, attempt)
        )


def motions_of(
    recipe: Recipe, system: System, seed: int | None, most: int | None, patience: TimeBudget
) -> Motions:
    """Return the motions along which a recipe's window is sized.

    The seed is the recipe's data seed if None; ``most`` is ``MOTIONS`` if None. If the time is
    limited, motions of a slow system are shorter.
    """
    training, window = split_stream(recipe, "train", 0), recipe.window
    entropy = recipe.data.seed if seed is None else seed
    duration = min(training.duration, WINDOWS_PER_MOTION * window.n_in * window.step)
    stream = Stream(training.number, entropy, (1.0, 1.0), duration)
    runnable = RunnableDraws(system, recipe.data.most_failures)
    most = MOTIONS if most is None else most
    motions = Motions(recipe.without_loops(), system, stream, most, runnable, patience)
    if math.isinf(patience.seconds):
        return motions
    samples = runnable.tolerated(
        lambda: patience.samples(system, motions.inputs(0, TIMED_SAMPLES))
    )
    allowed = max(window.n_in, samples) * window.step
    if allowed >= duration:
        return motions
    patience.leave_out(f"motions of more than {allowed:.3g} s")
    return replace(motions, stream=replace(stream, duration=allowed))


def linearize_motions(motions: Motions) -> LinearizedSystem:
    """Linearize a system at rest and along motions of its recipe; the system must offer that.

    Raises:
        UnstableModeError: a mode of the system linearized at rest grows, or the slowest mode grows
            in the mean along a motion.
        SimulationError: a motion could not be simulated.
        ValueError: the system has no damping, so that initial effects never decay.
    """
    recipe, system = motions.recipe, motions.system
    assert isinstance(system, Linearizable)
    amplitude, window = recipe.window.remaining_amplitude, recipe.window.as_window
    rest = system.rest_state(np.array([signal.start_value for signal in system.inputs]))
    modes = spectrum(system.linearize(rest), amplitude)
    samples = round((motions.stream.duration + recipe.data.burn_in) / window.step)
    most = min(LINEARIZED_SAMPLES, round(SHARE * motions.data_samples))
    enough = max(LEAST_MEASURED, most // samples)
    followed = range(min(motions.most, LINEARIZED_MOTIONS, enough))
    draws = [motions.drawn(index) for index in followed]
    stride = -(-window.n_in // POINTS_PER_WINDOW)  # rounded up
    along = _decay_along_motions(motions, draws, stride)
    decay = _decay_over_windows(along, window, stride)
    recommend_window(decay.worst, window.step, window.n_out)  # raises for an infinite time
    return LinearizedSystem(modes, decay, max(each.worst for each in along))


def first_length(motions: Motions, expected: float) -> int:
    """Return the number of samples to measure at first, for an expected decay time in s."""
    window = motions.recipe.window
    return max(window.n_in, math.ceil(MEASURED_DECAYS * expected / window.step))


def measure_motions(motions: Motions, count: int, grow: bool = True) -> Decay:
    """Measure the decay of the difference of two motions under the same input, on several pairs.

    The motions have ``count`` samples at first. If ``grow``, they are lengthened while most pairs
    have not met. If single pairs have not met, they are lengthened to several times the slowest
    meeting time of the others.

    Raises:
        SimulationError: a motion could not be simulated.
        ValueError: the motions meet within two samples.
    """
    longest = GROWTH * count if grow else count
    while True:
        measured = _measure(motions, count)
        needed = _needed_length(measured, count, motions.recipe.window.step)
        if not count < needed <= longest or motions.patience.gone("longer motions"):
            return measured
        count = needed


def _needed_length(measured: Decay, count: int, step: float) -> int:
    """Return the number of samples to measure after a measurement with ``count`` samples."""
    meeting = measured.meeting
    if meeting == 1.0:
        return count
    if meeting < MEETING:
        return 2 * count
    return max(count, math.ceil(MEASURED_DECAYS * measured.slowest / step))


def _measure(motions: Motions, count: int) -> Decay:
    """Measure the decay on motions of ``count`` samples."""
    stream, amplitude = motions.stream, motions.recipe.window.remaining_amplitude
    # a pair is two motions, each with another one ahead where no states can be drawn
    both = 2 if isinstance(motions.system, RandomStates) else 4
    enough = min(MEASURED_SAMPLES, motions.data_samples // both) // count
    pairs = min(motions.most, max(LEAST_MEASURED, enough))
    sequences = [motions.inputs(index, count) for index in range(pairs)]
    rng = np.random.default_rng(np.random.SeedSequence(stream.seed, spawn_key=(stream.number,)))
    return measured_decay(motions.system, sequences, rng, amplitude, motions.patience)


def _decay_along_motions(motions: Motions, draws: list[Draw], stride: int) -> list[Decay]:
    """Compute the decay along each of the motions, at every ``stride``-th sample.

    If the time is over, motions that have not begun are left out.
    """
    system, amplitude = motions.system, motions.recipe.window.remaining_amplitude
    assert isinstance(system, Linearizable)
    along: list[Decay] = []
    states = states_along(system, [Motion(one.inputs, one.initial) for one in draws], stride)
    for index in range(len(draws)):
        if along and motions.patience.gone(FURTHER, LINEARIZING):
            break
        try:
            along.append(decay_along(system, next(states), amplitude))
        except UnstableModeError as error:
            raise UnstableModeError(f"motion {index} of {len(draws)}: {error}") from error
    return along


def _decay_over_windows(along: list[Decay], window: Window, stride: int) -> Decay:
    """Return the decay over parts of the motions, one mean rate for each.

    A part is as long as the input window, as in the paper, but not shorter than the mean decay
        time: rates at single instants are not significant if the decay takes many windows.
    """
    decay_time = Decay(
        np.concatenate([decay.rates for decay in along]), along[0].remaining_amplitude
    ).mean
    recommend_window(decay_time, window.step, window.n_out)  # raises for an infinite time
    samples = max(window.n_in, decay_time / window.step)
    return decay_in_pieces(along, math.ceil(samples / stride))
