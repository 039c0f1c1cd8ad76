"""The window must be as long as a system takes to forget its initial state.

This time follows here from the equations linearized along a motion (paper, section "Computation of
decay time in linearized multibody systems"); ``convergence`` measures it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.memory.modes import UnstableModeError, slowest_rate, time_to_decay
from slide_fmu.systems.base import Linearizable, State


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
