"""How fast a system forgets its initial state decides how long the window must be.

The decay time comes in two independent ways: from the equations linearized along a motion (paper,
section "Computation of decay time in linearized multibody systems"), and measured, as the time in
which two motions under the same input meet.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.core.window import Window
from slide_fmu.memory.modes import UnstableModeError, slowest_rate, time_to_decay
from slide_fmu.systems.base import Linearizable, RandomStates, State, System
from slide_fmu.systems.simulation import simulate

LEAST_MET = 3
"""A rate is measured on so many samples; motions that meet faster count as meeting in these."""


class NoGapError(ValueError):
    """Two motions never differ, as within a dead zone: there is nothing to measure."""


class MetAtOnceError(ValueError):
    """Two motions meet within fewer samples than a rate can be measured on."""


@dataclass(frozen=True, eq=False)
class Decay:
    """A decay holds the rates of several motions, or those at several instants of one motion.

    Attributes:
        rates: real part Re(v) in 1/s of each, shape (n,); that of a motion is the mean along it.
        remaining_amplitude: fraction A_rel to which initial effects decay.
    """

    rates: FloatArray
    remaining_amplitude: float

    @property
    def times(self) -> FloatArray:
        """Each rate has a decay time in s, shape (n,); it is infinite where nothing decays."""
        return np.array([time_to_decay(rate, self.remaining_amplitude) for rate in self.rates])

    @property
    def mean(self) -> float:
        """The mean rate has this decay time in s."""
        return time_to_decay(float(np.mean(self.rates)), self.remaining_amplitude)

    @property
    def worst(self) -> float:
        """The slowest motion or instant has this decay time in s."""
        return float(np.max(self.times))

    @property
    def meeting(self) -> float:
        """This part of the motions or instants decays at all."""
        return float(np.mean(self.rates < 0.0))

    @property
    def slowest(self) -> float:
        """The slowest of those that decay at all has this decay time in s; infinite if none do."""
        decaying = self.times[self.rates < 0.0]
        return float(np.max(decaying)) if len(decaying) else math.inf


def decay_along(
    system: Linearizable, states: Sequence[State], remaining_amplitude: float = 0.01
) -> Decay:
    """Compute the rates of the slowest mode at states in equal distances along a motion.

    What was there at the motion's start decays with the mean of these rates, by exp(Re(v) h) from
    state to state (paper, section "Spatial 6R manipulator on a flexible socket"). So a mode may
    grow for a moment.

    Raises:
        UnstableModeError: the mode grows in the mean; the message names the rates.
        ValueError: there is no state.
    """
    if not states:
        raise ValueError("decay along a motion: no states; expected at least one")
    rates = np.array([slowest_rate(system.linearize(state)) for state in states])
    _refuse_growing_motion(rates)
    return Decay(rates, remaining_amplitude)


def decay_in_stretches(motions: Sequence[Decay], length: int) -> Decay:
    """Return the mean rates over stretches of motions, each of ``length`` instants at least.

    A motion that is shorter is one stretch.

    Raises:
        UnstableModeError: a mode grows in the mean over a stretch.
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


def measured_rate(
    system: System,
    inputs: FloatArray,
    first: State,
    second: State,
    remaining_amplitude: float = 0.01,
) -> float:
    """Measure the rate Re(v) in 1/s at which outputs from two states meet under the same inputs.

    The energy that the difference still has ahead of it, E(t) = sum over t' >= t of |e(t')|^2,
    falls like exp(2 Re(v) t) without the zero crossings of e itself (backward integration, as for
    the decay of sound in rooms: Schroeder, 1965). A line through log E, from the start until E has
    fallen to the square of the remaining amplitude, gives Re(v). The inputs, shape (N, n_inputs),
    take about twice the expected decay time. The result is 0 if the outputs have not met after
    three quarters of the record: it is too short, or the motion depends on its start for good.

    Raises:
        ValueError: the outputs never differ, or meet within two samples.
        SimulationError: a motion could not be simulated.
    """
    if hold_of(system.inputs) == "first_order":  # both motions see the same input from the start
        second = State(second.coordinates, second.velocities, first.last_input)
    one, other = (simulate(system, inputs, state).outputs for state in (first, second))
    return meeting_rate(system, one - other, remaining_amplitude)


def rate_after(
    system: System,
    inputs: FloatArray,
    histories: tuple[FloatArray, FloatArray],
    remaining_amplitude: float = 0.01,
) -> float:
    """Measure the rate Re(v) in 1/s at which outputs meet after two histories of inputs.

    This asks nothing of the system but to be simulated. The inputs, shape (N, n_inputs), follow
    each of the histories, (M, n_inputs); rate and record are as of ``measured_rate``.

    Raises:
        ValueError, SimulationError: as of ``measured_rate``.
    """
    # with a first-order hold the first input of the record is reached on different ways
    first = 1 if hold_of(system.inputs) == "first_order" else 0
    one, other = (
        simulate(system, np.concatenate([history, inputs])).outputs[len(history) + first :]
        for history in histories
    )
    return meeting_rate(system, one - other, remaining_amplitude)


def meeting_rate(system: System, gap: FloatArray, remaining_amplitude: float = 0.01) -> float:
    """Return the rate Re(v) in 1/s at which a gap between outputs, (N, n_outputs), closes.

    The result is 0 if it has not closed after three quarters of the record.

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
            "that differ at first: check that they follow from the inputs and states at all"
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
) -> Decay:
    """Measure the decay on several input records, (N, n_inputs), each from its own random states.

    Of a system that draws no states, one motion comes from another record, and one from rest.

    A nonlinear motion decays faster at some times than at others; the mean over several records is
    what compares with the linearized equations. A record in which the outputs do not meet counts
    with the rate 0 and has an infinite decay time. One in which they meet within fewer samples
    than a rate can be measured on counts as if they met in ``LEAST_MET`` samples; one in which
    they never differ is left out.

    Raises:
        NoGapError: there is no record in which outputs differ.
        ValueError: there is no record.
        SimulationError: a motion could not be simulated.
    """
    if not inputs:
        raise ValueError("measured decay: no inputs; expected at least one record")
    rates: list[float] = []
    same: NoGapError | None = None
    for index, record in enumerate(inputs):
        try:
            rates.append(
                _rate_of_pair(system, record, inputs[index - 1], rng, remaining_amplitude)
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
    record: FloatArray,
    before: FloatArray,
    rng: np.random.Generator,
    remaining_amplitude: float,
) -> float:
    """Measure the rate of two motions, from random states or after a record and after rest."""
    if isinstance(system, RandomStates):
        one, other = (system.random_state(rng, record[0]) for _ in range(2))
        return measured_rate(system, record, one, other, remaining_amplitude)
    histories = before, np.repeat(before[:1], len(before), axis=0)
    return rate_after(system, record, histories, remaining_amplitude)


def recommend_window(decay_time: float, step: float, n_out: int) -> Window:
    """Return the shortest window whose truncated part (n_in - n_out) h holds the decay time in s.

    This is the paper's condition on the window, with equality allowed.

    Raises:
        ValueError: the decay time is infinite or negative.
    """
    return Window(step, n_out + _needed_samples(decay_time, step), n_out)


def too_short(window: Window, decay_time: float) -> str | None:
    """Say why a window is too short for a system of this decay time in s; None if it is not."""
    needed = _needed_samples(decay_time, window.step)
    if window.n_truncated >= needed:
        return None
    return (
        f"window: n_in - n_out = {window.n_in} - {window.n_out} = {window.n_truncated} samples "
        f"({window.truncation_time:.4g} s) are truncated, but initial effects need {needed} "
        f"samples ({decay_time:.4g} s) to decay: give n_in >= {window.n_out + needed}, a larger "
        "step, or a larger remaining amplitude"
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
