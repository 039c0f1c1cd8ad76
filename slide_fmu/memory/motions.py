"""The memory of a system along the motions of its recipe is linearized, and measured.

The equations are linearized along motions where the system offers that. The decay is measured on
pairs of motions of any system, in records that grow until the motions meet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.draws import Draw, Stream, draw, split_stream
from slide_fmu.data.failing_motions import Failing
from slide_fmu.memory.convergence import measured_decay
from slide_fmu.memory.decay import (
    Decay,
    decay_along,
    decay_in_stretches,
    recommend_window,
)
from slide_fmu.memory.modes import Spectrum, UnstableModeError, spectrum
from slide_fmu.memory.time_budget import TIMED_SAMPLES, TimeBudget
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Linearizable, State, System

MOTIONS = 40
"""At most this many pairs of motions are measured."""
LINEARIZED_MOTIONS = 20
"""The equations are linearized along at most this many motions."""
LINEARIZED_SAMPLES = 40_000
"""No more motions are linearized after this many samples, but at least ``LEAST_MEASURED``."""
WINDOWS_PER_MOTION = 10
"""These motions are at most this many input windows long."""
POINTS_PER_WINDOW = 8
"""The equations are linearized at this many states in each of these windows."""
MEASURED_DECAYS = 3.0
"""The measured motions are at least this many decay times long."""
MEASURED_SAMPLES, LEAST_MEASURED = 20_000, 4
"""No more motions are measured after this many samples, but at least this many motions: where the
decay takes long, a few pairs show what the window needs."""
GROWTH = 32
"""Records grow to this many times their first length before motions count as never meeting."""
FURTHER, LINEARIZING = "further motions to linearize along", 0.4
"""Of a limited time this part is there to linearize: measuring shows more."""
MEETING = 0.5
"""This part of the measured pairs must meet, or the system counts as one that does not forget."""


@dataclass(frozen=True, eq=False)
class Linearized:
    """A system was linearized at rest and along motions.

    Attributes:
        modes: modes of the system linearized at rest.
        decay: decay along stretches of the recipe's motions, each as long as the input window, or
            as the mean decay time if that is longer.
        local_worst: the longest decay time in s at a single instant; infinite where a mode grows
            for a moment.
    """

    modes: Spectrum
    decay: Decay
    local_worst: float


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions along which a recipe's window is sized.

    Attributes:
        recipe: what they are drawn from.
        system: the recipe's system.
        stream: their seeds, and how long those are that are linearized.
        most: so many motions, or pairs of them, at most.
        failing: leaves out draws on which the system fails.
        patience: how long they may take in all.
    """

    recipe: Recipe
    system: System
    stream: Stream
    most: int
    failing: Failing
    patience: TimeBudget

    def inputs(self, index: int, count: int) -> FloatArray:
        """Draw the inputs of a motion of at least so many samples, shape (count, n_inputs)."""
        duration = max(self.stream.duration, count * self.recipe.window.step)
        whole = replace(self.stream, duration=duration)
        return self._drawn(whole, index, count).inputs

    def drawn(self, index: int) -> Draw:
        """Draw a motion as long as the stream says."""
        return self._drawn(self.stream, index, None)

    def _drawn(self, stream: Stream, index: int, count: int | None) -> Draw:
        return self.failing.drawn(
            index, count, lambda attempt: draw(self.recipe, self.system, stream, index, attempt)
        )


def motions_of(
    recipe: Recipe, system: System, seed: int | None, most: int | None, patience: TimeBudget
) -> Motions:
    """Return the motions along which a recipe's window is sized.

    The seed is the recipe's data seed if None; there are ``MOTIONS`` at most if ``most`` is None.
    Where the time is limited, motions of a slow system are shorter.
    """
    training, window = split_stream(recipe, "train", 0), recipe.window
    entropy = recipe.data.seed if seed is None else seed
    duration = min(training.duration, WINDOWS_PER_MOTION * window.n_in * window.step)
    stream = Stream(training.number, entropy, (1.0, 1.0), duration)
    failing = Failing(system, recipe.data.most_failures)
    most = MOTIONS if most is None else most
    motions = Motions(recipe, system, stream, most, failing, patience)
    if math.isinf(patience.seconds):
        return motions
    samples = failing.tolerated(lambda: patience.samples(system, motions.inputs(0, TIMED_SAMPLES)))
    allowed = max(window.n_in, samples) * window.step
    if allowed >= duration:
        return motions
    patience.leave_out(f"motions of more than {allowed:.3g} s")
    return replace(motions, stream=replace(stream, duration=allowed))


def linearize_motions(motions: Motions) -> Linearized:
    """Linearize a system, which offers that, at rest and along motions of its recipe.

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
    enough = max(LEAST_MEASURED, LINEARIZED_SAMPLES // samples)
    followed = range(min(motions.most, LINEARIZED_MOTIONS, enough))
    draws = [motions.drawn(index) for index in followed]
    stride = -(-window.n_in // POINTS_PER_WINDOW)  # rounded up
    along = _decay_along_motions(motions, draws, stride)
    decay = _decay_over_windows(along, window, stride)
    recommend_window(decay.worst, window.step, window.n_out)  # raises for an infinite time
    return Linearized(modes, decay, max(each.worst for each in along))


def first_record(motions: Motions, expected: float) -> int:
    """Return how many samples are measured at first, for an expected decay time in s."""
    window = motions.recipe.window
    return max(window.n_in, math.ceil(MEASURED_DECAYS * expected / window.step))


def measure_motions(motions: Motions, count: int, grow: bool = True) -> Decay:
    """Measure the decay of the difference of two motions under the same input, on several pairs.

    The records have ``count`` samples at first. They grow, if they may, while most pairs have not
    met, and where a pair has not met, until the record is several times as long as the slowest of
    the others took.

    Raises:
        SimulationError: a motion could not be simulated.
        ValueError: the motions meet within two samples.
    """
    longest = GROWTH * count if grow else count
    while True:
        measured = _measure(motions, count)
        needed = _needed_record(measured, count, motions.recipe.window.step)
        if not count < needed <= longest or motions.patience.gone("longer records"):
            return measured
        count = needed


def _needed_record(measured: Decay, count: int, step: float) -> int:
    """Return how many samples a record needs after what was measured on one of ``count``."""
    meeting = measured.meeting
    if meeting == 1.0:
        return count
    if meeting < MEETING:
        return 2 * count
    return max(count, math.ceil(MEASURED_DECAYS * measured.slowest / step))


def _measure(motions: Motions, count: int) -> Decay:
    """Measure the decay on records of ``count`` samples."""
    stream, amplitude = motions.stream, motions.recipe.window.remaining_amplitude
    pairs = min(motions.most, max(LEAST_MEASURED, MEASURED_SAMPLES // count))
    records = [motions.inputs(index, count) for index in range(pairs)]
    rng = np.random.default_rng(np.random.SeedSequence(stream.seed, spawn_key=(stream.number,)))
    return measured_decay(motions.system, records, rng, amplitude, motions.patience)


def _decay_along_motions(motions: Motions, draws: list[Draw], stride: int) -> list[Decay]:
    """Compute the decay along each of the motions, at every ``stride``-th sample.

    When the time is over, those that were not begun are left out.
    """
    system, amplitude = motions.system, motions.recipe.window.remaining_amplitude
    assert isinstance(system, Linearizable)
    along: list[Decay] = []
    for index, drawn in enumerate(draws):
        if along and motions.patience.gone(FURTHER, LINEARIZING):
            break
        states = _states_along(system, drawn.initial, drawn.inputs, stride)
        try:
            along.append(decay_along(system, states, amplitude))
        except UnstableModeError as error:
            raise UnstableModeError(f"motion {index} of {len(draws)}: {error}") from error
    return along


def _decay_over_windows(along: list[Decay], window: Window, stride: int) -> Decay:
    """Return the decay over stretches of the motions, one mean rate for each.

    A stretch is as long as the input window, as in the paper, but not shorter than the decay
    takes in the mean: rates at single instants say little where the decay takes many windows.
    """
    decay_time = Decay(
        np.concatenate([decay.rates for decay in along]), along[0].remaining_amplitude
    ).mean
    recommend_window(decay_time, window.step, window.n_out)  # raises for an infinite time
    samples = max(window.n_in, decay_time / window.step)
    return decay_in_stretches(along, math.ceil(samples / stride))


def _states_along(
    system: Linearizable, initial: State | None, inputs: FloatArray, stride: int
) -> list[State]:
    """Simulate a motion and return its states at every ``stride``-th sample."""
    system.begin(inputs[0]) if initial is None else system.set_state(initial)
    states = []
    for k, row in enumerate(inputs):
        system.advance(row)
        if (k + 1) % stride == 0:
            states.append(system.get_state())
    return states
