"""The window of a recipe is sized by the decay along its own motions, linearized and measured.

If the system is linearized, its eigenvalues decide; a measured decay that needs more is reported
in a remark. If not, the mean rate of the measured pairs of motions decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from slide_fmu.core.signals import within_ranges
from slide_fmu.core.window import Window
from slide_fmu.memory.decay import Decay, recommend_window, too_short
from slide_fmu.memory.decay_figures import (
    DecayTimes,
    SizingFigures,
    SystemSizing,
    WindowSize,
    linearized_times,
    mode_figures,
)
from slide_fmu.memory.modes import time_to_decay
from slide_fmu.memory.motions import (
    MEASURED_DECAYS,
    MEETING,
    LinearizedSystem,
    Motions,
    first_length,
    linearize_motions,
    measure_motions,
    motions_of,
)
from slide_fmu.memory.path_dependence import path_dependence
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.memory.time_dependence import time_dependence
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Linearizable, System
from slide_fmu.systems.simulation import simulate

FACTOR = 2.0
"""Decay times that differ by more than this factor contradict each other. Along the motions of the
project's systems the factor is 0.97 to 1.12, and 1.2 with a weak drive."""
KICK = 0.01
"""Near rest, inputs move by this fraction of half their ranges."""
KICK_SAMPLES = 64
"""Number of samples of this motion."""
FROM, TO = 0.1, 1e-3
"""The rate is taken between these fractions of the first difference: fast modes have decayed."""


class AnySizing(Protocol):
    """An AnySizing has the results of a sizing, from simulation or from fitted records."""

    @property
    def window(self) -> Window:
        """The recipe's window."""

    @property
    def remaining_amplitude(self) -> float:
        """The fraction A_rel to which initial effects must decay."""

    @property
    def forgets(self) -> bool:
        """Whether a window can cover the system's memory."""

    @property
    def problem(self) -> str | None:
        """The reason why the window is too short; None if it is long enough."""

    @property
    def remark(self) -> str | None:
        """What the user should know; None if there is nothing."""

    @property
    def left_out(self) -> str | None:
        """What was left out for want of time; None if nothing was."""

    @property
    def states(self) -> int | None:
        """The number of states of a linear fit; None without one."""

    def figures(self) -> SizingFigures:
        """Return the figures for JSON files."""


class ShortWindowError(ValueError):
    """The recipe's window is too short for its system."""


class NotForgettingError(ShortWindowError):
    """No window is long enough for the system, since it does not forget."""


@dataclass(frozen=True, eq=False)
class Sizing:
    """A Sizing has the time that the window of a recipe must cover, and the time that it covers.

    Attributes:
        window: the recipe's window.
        remaining_amplitude: fraction A_rel to which initial effects must decay.
        linearized: result from the equations; None if the system does not offer linearization.
        measured: decay of the difference of two motions under the same input, one rate for each
            pair.
        refusal: why no window can cover the system's memory, or why this is uncertain: it does not
            forget at rest, or its linearized equations contradict it; else None.
        failed: description of motions on which the system failed; None if there were none.
        left_out: what was left out for want of time; None if nothing was.
    """

    window: Window
    remaining_amplitude: float
    linearized: LinearizedSystem | None
    measured: Decay
    refusal: str | None = None
    failed: str | None = None
    left_out: str | None = None

    @property
    def states(self) -> None:
        """A system that is simulated has no linear fit."""
        return None

    @property
    def forgets(self) -> bool:
        """Whether a window can cover the system's memory."""
        return self.refusal is None and self.measured.meeting >= MEETING

    @property
    def needed(self) -> float:
        """The time in s that the window must truncate: the decay time by the deciding method."""
        decides = self.linearized
        return self.measured.mean if decides is None else decides.decay.worst

    @property
    def problem(self) -> str | None:
        """The reason why the window is too short; None if it is long enough."""
        if self.refusal is not None:
            return self.refusal
        if self.measured.meeting < MEETING:
            problem = _never_meet(self.measured, self.linearized)
            return problem if self.left_out is None else f"{self.left_out}; so far, {problem}"
        met = [float(time) for time in self.measured.times if math.isfinite(time)]
        return too_short(self.window, self.needed, max(met, default=0.0))

    @property
    def remark(self) -> str | None:
        """A text on omissions, failures, and a measured decay that needs more.

        It is None if there is none of these.
        """
        texts = self.left_out, self.failed, self._asks_for_more()
        return ". Besides, ".join(text for text in texts if text is not None) or None

    def _asks_for_more(self) -> str | None:
        """Say that the measured decay needs more than the deciding method; or None."""
        window, worst = self.window, self.measured.worst
        if self.problem is not None or worst <= window.truncation_time:
            return None
        motions = f"the slowest of {len(self.measured.rates)} measured pairs of motions"
        others = "the eigenvalues ask" if self.linearized else "the mean rate asks"
        least = f"though {others} for {self.needed:.4g} s alone"
        truncated = f"the window truncates {window.truncation_time:.4g} s"
        if not math.isfinite(worst):
            return (
                f"{motions} did not meet within several decay times; {truncated}, "
                f"{least}. Raise window.n_in, excite less (data.excitation), or give the "
                "system more damping"
            )
        needed = recommend_window(worst, window.step, window.n_out).n_in
        return (
            f"{motions} takes {worst:.4g} s to meet, but {truncated}, {least}. Raise "
            f'window.n_in from {window.n_in} to {needed} to hold that one too; n_in = "auto" '
            "leaves a margin for motions of any other seed"
        )

    def figures(self) -> SystemSizing:
        """Return the figures for JSON files."""
        sized, linearized = self.measured.meeting >= MEETING, self.linearized
        return SystemSizing(
            remaining_amplitude=self.remaining_amplitude,
            decay_time_s=linearized_times(linearized),
            modes_at_rest=mode_figures(linearized),
            rigid_body_eigenvalues=None if linearized is None else len(linearized.modes.rigid),
            measured_decay_time_s=DecayTimes.of(self.measured),
            window=WindowSize.of(self.window),
            recommended_n_in=self._recommended() if sized or linearized else None,
            sufficient=self.problem is None,
            refusal=self.refusal,
            remark=self.remark,
        )

    def _recommended(self) -> int:
        return recommend_window(self.needed, self.window.step, self.window.n_out).n_in


def size_window(
    recipe: Recipe,
    system: System,
    seed: int | None = None,
    most: int | None = None,
    patience: TimeBudget | None = None,
) -> Sizing:
    """Compute and measure the decay times of a recipe's system along its motions.

    The seed of the motions is the recipe's data seed if None. There are at most ``most`` motions
    for a first estimate; if None, the number is chosen. When the time is over, the remaining
    motions are left out. The system need only be simulated; if it offers linearization, the
    equations are used too.

    Raises:
        UnstableModeError: a mode of the system linearized at rest grows, or the slowest mode grows
            in the mean along a motion.
        NotForgettingError: the linearized system has no decay, since it does not forget at rest;
            or outputs depend on time.
        SimulationError: more motions could not be simulated than ``data.most_failures`` allows.
        ValueError: the linearized system has no damping, so that initial effects never decay.
    """
    if (clock := time_dependence(system)) is not None:
        raise NotForgettingError(f"recipe {recipe.name!r}: {clock}")
    window = recipe.window.as_window
    patience = patience or TimeBudget()
    motions = motions_of(recipe, system, seed, most, patience)
    linearized, expected = None, window.n_in * window.step
    tolerated = motions.runnable.tolerated
    if isinstance(system, Linearizable):
        linearized = tolerated(lambda: _linearized(recipe, motions))
        expected = linearized.decay.worst
    count = first_length(motions, expected)
    dependence = tolerated(lambda: path_dependence(motions, count))
    measured = tolerated(lambda: measure_motions(motions, count, grow=dependence is None))
    refusal = None if dependence is None else str(dependence)
    compared = linearized is not None and refusal is None and measured.meeting >= MEETING
    if compared and not patience.gone("a comparison of equations and motions near rest"):
        assert linearized is not None
        refusal = contradiction(motions, linearized, measured)
    remarks = motions.runnable.tolerance.remark, patience.remark
    amplitude = recipe.window.remaining_amplitude
    return Sizing(window, amplitude, linearized, measured, refusal, *remarks)


def _linearized(recipe: Recipe, motions: Motions) -> LinearizedSystem:
    """Linearize along motions; if there is no decay, look for a cause that has a name."""
    try:
        return linearize_motions(motions)
    except ValueError as error:
        dependence = path_dependence(motions, recipe.window.n_in)
        if dependence is None:
            raise
        raise NotForgettingError(f"recipe {recipe.name!r}: {dependence}") from error


def require_window(recipe: Recipe, sizing: AnySizing) -> None:
    """Refuse a recipe whose window is too short, unless it sets ``allow_short``.

    Raises:
        ShortWindowError: the window is too short; the message has the numbers and the remedy.
        NotForgettingError: no window is long enough, or the sizing contradicts itself.
    """
    if sizing.problem is not None and not recipe.window.allow_short:
        kind = ShortWindowError if sizing.forgets else NotForgettingError
        raise kind(f"recipe {recipe.name!r}: {sizing.problem}; or set window.allow_short = true")


def _never_meet(measured: Decay, linearized: LinearizedSystem | None) -> str:
    """Say that motions do not forget their start, with what is known about the cause."""
    pairs = len(measured.rates)
    apart = round(pairs * (1.0 - measured.meeting))
    known = ""
    if linearized is not None:
        rigid = len(linearized.modes.rigid)
        known = f", {rigid} eigenvalues of rigid-body modes at rest"
    return (
        f"motions from different initial states never meet in the outputs ({apart} of {pairs} "
        f"measured pairs{known}): no window can hold them; fix the free direction, give the "
        "system damping, or choose outputs that it does not move"
    )


def contradiction(motions: Motions, linearized: LinearizedSystem, measured: Decay) -> str | None:
    """Describe a contradiction of linearized equations and measured decay; None if they agree.

    Along motions of a nonlinear system the two differ. So they are also compared near rest, where
    the equations describe the system itself. Only a contradiction at both places, in the same
    direction, is a fault of the equations.
    """
    along = measured.mean / linearized.decay.mean
    if 1.0 / FACTOR <= along <= FACTOR:
        return None
    rate = _rate_near_rest(motions, max(linearized.decay.mean, _finite(measured.mean)))
    modes, amplitude = linearized.modes, linearized.decay.remaining_amplitude
    if rate is None or not modes.modes:
        near, actual, expected = along, measured.mean, linearized.decay.mean
    else:
        actual, expected = time_to_decay(rate, amplitude), modes.decay_time
        near = actual / expected
    if 1.0 / FACTOR <= near <= FACTOR or (near > 1.0) != (along > 1.0):
        return None
    if (step := motions.system.step) > linearized.decay.mean:
        return (
            f"window.step = {step:g} s is longer than {linearized.decay.mean:.4g} s, in which "
            "initial effects decay by the linearized equations, so that a simulation from sample "
            "to sample shows nothing of it; expected a small part of that time: give the step in s"
        )
    return (
        f"the linearized equations contradict the system: by their eigenvalues initial effects "
        f"decay in {linearized.decay.mean:.4g} s along motions and in {expected:.4g} s near rest, "
        f"but measured are {measured.mean:.4g} s and {actual:.4g} s; expected agreement within a "
        f"factor of {FACTOR:g}. Look for damping that linearize has and the simulation has not, "
        "or the reverse, for wrong signs, units or factors in its matrices, for springs and "
        "controls that it does not see, and for slow modes that the outputs do not show"
    )


def _finite(value: float) -> float:
    return value if np.isfinite(value) else 0.0


def _rate_near_rest(motions: Motions, expected: float) -> float | None:
    """Return the rate in 1/s at which the slowest mode decays after a small kick at rest.

    It is None if inputs cannot be moved a little, since they belong to an angle, or if the outputs
    do not show enough of the decay.
    """
    system = motions.system
    assert isinstance(system, Linearizable)
    if any(signal.angle for signal in system.inputs):
        return None
    start = np.array([signal.start_value for signal in system.inputs])
    half = np.array([0.5 * (signal.high - signal.low) for signal in system.inputs])
    rng = np.random.default_rng(0)
    kick = start + KICK * half * rng.uniform(-1.0, 1.0, (KICK_SAMPLES, len(start)))
    kick = within_ranges(system.inputs, kick)
    count = int(np.ceil(MEASURED_DECAYS * expected / system.step))
    rest, state = np.tile(start, (count, 1)), system.rest_state(start)
    quiet = simulate(system, np.concatenate([np.tile(start, (len(kick), 1)), rest]), state)
    moved = simulate(system, np.concatenate([kick, rest]), state)
    # with a first-order hold the first input at rest is reached from different values
    gap = (moved.outputs - quiet.outputs)[len(kick) + 1 :]
    gap = gap / np.array([signal.high - signal.low for signal in system.outputs])
    ahead = np.sqrt(np.cumsum(np.sum(gap[::-1] ** 2, axis=1))[::-1])
    if not ahead[0] > 0.0:
        return None
    window = (ahead < FROM * ahead[0]) & (ahead > TO * ahead[0])
    if np.sum(window) < 3:
        return None
    time = system.step * np.flatnonzero(window)
    return float(np.polyfit(time, np.log(ahead[window]), 1)[0])
