"""The time in which a system forgets its past is measured: two motions meet after it.

Both have the same input. The system need only be simulated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.systems.base import RandomStates, State, System
from slide_fmu.systems.simulation import simulate

LEAST_MET = 3
"""Number of samples that a rate needs; motions that meet faster count as meeting in these."""


class NoGapError(ValueError):
    """Two motions never differ, for example in a dead zone: there is nothing to measure."""


class MetAtOnceError(ValueError):
    """Two motions meet within fewer samples than a rate can be measured on."""


def measured_rate(
    system: System,
    inputs: FloatArray,
    first: State,
    second: State,
    remaining_amplitude: float = 0.01,
) -> float:
    """Measure the rate Re(v) in 1/s at which outputs from two states meet under the same inputs.

    The energy of the remaining difference, E(t) = sum over t' >= t of |e(t')|^2, falls like exp(2
    Re(v) t) without the zero crossings of e itself (backward integration, as for the decay of
    sound in rooms: Schroeder, 1965). A line through log E, from the start until E has fallen to
    the square of the remaining amplitude, gives Re(v). The inputs, shape (N, n_inputs), last about
    twice the expected decay time. The result is 0 if the outputs have not met after three quarters
    of the samples: then there are too few, or the motion depends on its start for ever.

    Raises:
        ValueError: the outputs never differ, or meet within two samples.
        SimulationError: a motion could not be simulated.
    """
    if hold_of(system.inputs) == "first_order":  # both motions see the same input from the start
        second = State(second.coordinates, second.velocities, first.last_input)
    one, other = (simulate(system, inputs, state).outputs for state in (first, second))
    return convergence_rate(system, one - other, remaining_amplitude)


def convergence_rate(system: System, gap: FloatArray, remaining_amplitude: float = 0.01) -> float:
    """Return the rate Re(v) in 1/s at which a gap between outputs, (N, n_outputs), closes.

    The result is 0 if it has not closed after three quarters of the samples.

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
    for index, sequence in enumerate(inputs):
        if rates and patience is not None and patience.gone("further pairs of motions"):
            break
        try:
            rates.append(
                _rate_of_pair(system, sequence, inputs[index - 1], rng, remaining_amplitude)
            )
        except MetAtOnceError:
            rates.append(math.log(remaining_amplitude) / (LEAST_MET * system.step))
        except NoGapError as error:
            same = error
    if same is not None and not rates:
        raise same
    return Decay(np.array(rates), remaining_amplitude)


def _rate_of_pair(
    system: System,
    sequence: FloatArray,
    before: FloatArray,
    rng: np.random.Generator,
    remaining_amplitude: float,
) -> float:
    """Measure the rate of two motions: from random states, or after other inputs and rest."""
    if isinstance(system, RandomStates):
        one, other = (system.random_state(rng, sequence[0]) for _ in range(2))
        return measured_rate(system, sequence, one, other, remaining_amplitude)
    # with a first-order hold the first input is reached from different values
    first = len(before) + (hold_of(system.inputs) == "first_order")
    after_motion, after_rest = (
        simulate(system, np.concatenate([past, sequence])).outputs[first:]
        for past in (before, np.repeat(before[:1], len(before), axis=0))
    )
    return convergence_rate(system, after_motion - after_rest, remaining_amplitude)
