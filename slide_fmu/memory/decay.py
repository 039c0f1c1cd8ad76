"""The window must be as long as a system takes to forget its initial state.

This time follows from the equations linearized along a motion (paper, section "Computation of
decay time in linearized multibody systems"). Or it is measured: two motions with the same input
meet after it. For that the system need only be simulated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.core.window import Window
from slide_fmu.memory.modes import UnstableModeError, slowest_rate, time_to_decay
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.systems.base import Linearizable, Motion, RandomStates, State, System
from slide_fmu.systems.simulation import motions_at_once, outputs_of, simulate_motions

LEAST_MET = 3
"""Number of samples that a rate needs; motions that meet faster count as meeting in these."""


@dataclass(frozen=True, eq=False)
class Decay:
    """A Decay has the rates of several motions, or of several instants of one motion.

    Attributes:
        rates: real part Re(v) in 1/s of each, shape (n,); the rate of a motion is the mean along
            it.
        remaining_amplitude: fraction A_rel to which initial effects decay.
    """

    rates: FloatArray
    remaining_amplitude: float

    @property
    def times(self) -> FloatArray:
        """The decay times in s, shape (n,); infinite where nothing decays."""
        return np.array([time_to_decay(rate, self.remaining_amplitude) for rate in self.rates])

    @property
    def mean(self) -> float:
        """The decay time in s of the mean rate."""
        return time_to_decay(float(np.mean(self.rates)), self.remaining_amplitude)

    @property
    def worst(self) -> float:
        """The decay time in s of the slowest motion or instant."""
        return float(np.max(self.times))

    @property
    def meeting(self) -> float:
        """The fraction of the motions or instants that decay at all."""
        return float(np.mean(self.rates < 0.0))

    @property
    def slowest(self) -> float:
        """The longest finite decay time in s; infinite if nothing decays."""
        decaying = self.times[self.rates < 0.0]
        return float(np.max(decaying)) if len(decaying) else math.inf


def decay_along(
    system: Linearizable, states: Sequence[State], remaining_amplitude: float = 0.01
) -> Decay:
    """Compute the rates of the slowest mode at states in equal distances along a motion.

    An effect at the motion's start decays with the mean of these rates, by exp(Re(v) h) from state
    to state (paper, section "Spatial 6R manipulator on a flexible socket"). So a mode may grow for
    a moment.

    Raises:
        UnstableModeError: the mode grows in the mean; the message names the rates.
        ValueError: there is no state.
    """
    if not states:
        raise ValueError("decay along a motion: no states; expected at least one")
    rates = np.array([slowest_rate(system.linearize(state)) for state in states])
    _refuse_growing_motion(rates)
    return Decay(rates, remaining_amplitude)


def decay_in_pieces(motions: Sequence[Decay], length: int) -> Decay:
    """Return the mean rates over parts of motions, each of ``length`` instants at least.

    A motion that is shorter is one part.
    """
    parts = [
        part
        for motion in motions
        for part in np.array_split(motion.rates, max(1, len(motion.rates) // length))
    ]
    for part in parts:
        _refuse_growing_motion(part)
    means = np.array([np.mean(part) for part in parts])
    return Decay(means, motions[0].remaining_amplitude)


def recommend_window(decay_time: float, step: float, n_out: int) -> Window:
    """Return the shortest window whose truncated part (n_in - n_out) h covers the decay time in s.

    This is the paper's condition on the window, with equality allowed.

    Raises:
        ValueError: the decay time is infinite or negative.
    """
    return Window(step, n_out + _needed_samples(decay_time, step), n_out)


DECAY_MARGIN = 1.25
"""Factor on the longest decay time that was found: a window that truncates this time covers all
but rare motions of any other seed (training/README.md has the figures)."""


def too_short(window: Window, decay_time: float, slowest: float = 0.0) -> str | None:
    """Explain that a window is too short for a system of this decay time in s; None if it is not.

    The message suggests one length that is enough for other seeds too: it has a margin above
    ``slowest``, the time in s of the slowest measured pair of motions.
    """
    needed = _needed_samples(decay_time, window.step)
    if window.n_truncated >= needed:
        return None
    enough = _needed_samples(DECAY_MARGIN * max(decay_time, slowest), window.step)
    return (
        f"window: n_in - n_out = {window.n_in} - {window.n_out} = {window.n_truncated} samples "
        f"({window.truncation_time:.4g} s) are truncated, but initial effects need {needed} "
        f"samples ({decay_time:.4g} s) to decay: give n_in >= {window.n_out + needed}; n_in = "
        f"{window.n_out + enough} has a margin for motions of any other seed, and n_in = "
        '"auto" finds such a length; or give a larger step, or a larger remaining amplitude'
    )


def _needed_samples(decay_time: float, step: float) -> int:
    """Return the number of whole steps that cover the decay time; a rounding error adds none."""
    if not 0.0 <= decay_time < math.inf:
        raise ValueError(
            f"decay time = {decay_time} s; expected a finite time: no window can hold a motion "
            "that does not decay, so give the system damping"
        )
    return math.ceil(decay_time / step * (1.0 - 1e-12))


def _refuse_growing_motion(rates: FloatArray) -> None:
    """Raise UnstableModeError for a motion on which initial effects grow in the mean."""
    mean = float(np.mean(rates))
    if mean > 0.0:
        raise UnstableModeError(
            "initial effects grow along the motion: the slowest mode has Re(v) = "
            f"{mean:.4g} 1/s in the mean over {len(rates)} instants ({np.min(rates):.4g} .. "
            f"{np.max(rates):.4g}); expected a mean below 0: no window can hold such a "
            "motion, so give the system more damping, check the signs of its control gains, or "
            "excite it less (data.excitation)"
        )


class NoGapError(ValueError):
    """Two motions never differ, for example in a dead zone: there is nothing to measure."""


class MetAtOnceError(ValueError):
    """Two motions meet within fewer samples than a rate can be measured on."""


def convergence_rate(system: System, gap: FloatArray, remaining_amplitude: float = 0.01) -> float:
    """Return the rate Re(v) in 1/s at which a gap between outputs, (N, n_outputs), closes.

    The energy of the remaining difference, E(t) = sum over t' >= t of |e(t')|^2, falls like exp(2
    Re(v) t) without the zero crossings of e itself (backward integration, as for the decay of
    sound in rooms: Schroeder, 1965). A line through log E, from the start until E has fallen to
    the square of the remaining amplitude, gives Re(v). The gap lasts about twice the expected
    decay time. The result is 0 if it has not closed after three quarters of the samples: then
    there are too few, or the motion depends on its start for ever.

    Raises:
        NoGapError: there is no gap.
        MetAtOnceError: it closes within two samples.
    """
    ranges = np.array([signal.high - signal.low for signal in system.outputs])
    difference = gap / ranges
    ahead = np.cumsum(np.sum(difference[::-1] ** 2, axis=1))[::-1]
    if ahead[0] == 0.0:
        raise NoGapError(
            "measured decay: the outputs are the same after two different pasts; expected outputs "
            "that differ at first: check that they depend on the inputs and on the states"
        )
    count = int(np.sum(ahead > remaining_amplitude**2 * ahead[0]))
    if count < LEAST_MET:
        raise MetAtOnceError(
            f"measured decay: the outputs meet within {count} samples of {system.step} s; "
            f"expected at least {LEAST_MET}: sample the system more finely"
        )
    if count > 0.75 * len(ahead):
        return 0.0
    time = system.step * np.arange(count)
    return 0.5 * float(np.polyfit(time, np.log(ahead[:count]), 1)[0])


def measured_decay(
    system: System,
    inputs: Sequence[FloatArray],
    rng: np.random.Generator,
    remaining_amplitude: float = 0.01,
    patience: TimeBudget | None = None,
) -> Decay:
    """Measure the decay under several input sequences, (N, n_inputs), from random states.

    If the system draws no states, one motion of a pair follows another sequence, and one follows
    rest.

    A nonlinear motion decays faster at some times than at others; the mean over several sequences
    is compared with the linearized equations. If the outputs do not meet, the sequence has the
    rate 0 and an infinite decay time. If they meet too fast to measure a rate, they count as
    meeting in ``LEAST_MET`` samples. Sequences in which they never differ are left out, as are
    those that have not begun when the time is over.

    Raises:
        NoGapError: the outputs differ in no sequence.
        ValueError: there are no sequences.
        SimulationError: a motion could not be simulated.
    """
    if not inputs:
        raise ValueError("measured decay: no inputs; expected at least one sequence")
    rates: list[float] = []
    same: NoGapError | None = None
    at_once = max(1, motions_at_once(system, 2 * len(inputs[0])) // 2)
    for first in range(0, len(inputs), at_once):
        if rates and patience is not None and patience.gone("further pairs of motions"):
            break
        numbers = range(first, min(first + at_once, len(inputs)))
        for gap in _gaps(system, [_pair(system, inputs[k], inputs[k - 1], rng) for k in numbers]):
            try:
                rates.append(convergence_rate(system, gap, remaining_amplitude))
            except MetAtOnceError:
                rates.append(math.log(remaining_amplitude) / (LEAST_MET * system.step))
            except NoGapError as error:
                same = error
    if same is not None and not rates:
        raise same
    return Decay(np.array(rates), remaining_amplitude)


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two motions under the same inputs from some sample on.

    Attributes:
        motions: the two.
        first: the sample from which on their outputs are compared.
    """

    motions: tuple[Motion, Motion]
    first: int


def _gaps(system: System, pairs: Sequence[_Pair]) -> Iterator[FloatArray]:
    """Simulate pairs of motions, and give the gaps between their outputs, (N, n_outputs)."""
    answers = simulate_motions(system, [motion for pair in pairs for motion in pair.motions])
    for pair in pairs:
        one, other = outputs_of(next(answers)), outputs_of(next(answers))
        yield (one - other)[pair.first :]


def _pair(
    system: System, sequence: FloatArray, before: FloatArray, rng: np.random.Generator
) -> _Pair:
    """Return two motions: from random states, or after other inputs and after rest."""
    moves = hold_of(system.inputs) == "first_order"
    if isinstance(system, RandomStates):
        one, other = (system.random_state(rng, sequence[0]) for _ in range(2))
        if moves:  # both motions see the same input from the start
            other = State(other.coordinates, other.velocities, one.last_input)
        return _Pair((Motion(sequence, one), Motion(sequence, other)), 0)
    rest = np.repeat(before[:1], len(before), axis=0)
    after_motion, after_rest = (
        Motion(np.concatenate([past, sequence])) for past in (before, rest)
    )
    # with a first-order hold the first input is reached from different values
    return _Pair((after_motion, after_rest), len(before) + moves)
