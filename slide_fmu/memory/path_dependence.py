"""A system that forgets comes to rest at the same outputs after any past.

Motions with different pasts get the same constant input. A system that forgets ends at the same
outputs, however slowly. For other systems the end, and the effect of a strong common input on the
difference, show the cause: with hysteresis there are many ends, and a strong input erases the
past; several equilibria give few ends; an integral keeps its difference under every input.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, final

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray, on_circles, within_ranges
from slide_fmu.memory.modes import slowest_rate
from slide_fmu.memory.motions import Motions
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.systems.base import Linearizable, Motion, RandomStates, State, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate_motions

PASTS, CERTAIN_PASTS = 3, 8
"""Number of pasts compared at first, and if the outputs stayed apart."""
RAMP = 32
"""Number of samples in which the inputs of a past change to the constant ones."""
LONGEST = 8
"""Largest time at rest, as a multiple of the first one."""
FLAT = 0.99
"""A difference stays if this fraction of it remains while the time at rest grows fourfold."""
GROWN = 2.0
"""Outputs that have grown apart by this factor are those of a mode that grows at rest, or else of
a free direction: these grow with the time or its square."""
BY_ITSELF = 100.0
"""A difference that grows by this factor while the time at rest grows fourfold grows by itself:
that of a free direction grows with the time or its square."""
ALONE = 0.2
"""If a strong input changes a difference by more than this fraction, it is not a sum of past and
present: the system is not linear in it."""
MOVING = 0.05
"""Outputs are not at rest if they still move by more than this fraction of their distance."""
TINY = 1e-300
"""Smallest divisor of differences."""
SAME = 0.02
"""Equilibria are the same if they differ by less than this fraction of their spread."""
FEW = 2
"""Up to this number of equilibria, the cause is a spring that snaps through."""
TURNS = (0.0, 0.02, 0.06, 0.2)
"""Fractions of the range by which pasts turn back beyond the constant input."""

PAST, EVERY, AT_REST, MET = 100, 10, 500, 0.2
"""Without a recipe, the inputs of a past have the first number of samples, and jump after every
second one. The third is the number of samples at rest at first; it is lengthened once. Outputs
have met if their remaining difference is below the last one."""

Reason = Literal["hysteresis", "rests", "integral", "growing"]


@dataclass(frozen=True)
class PathDependence:
    """A difference stays at rest: the system does not forget its past.

    Attributes:
        reason: ``"hysteresis"``, several equilibria (``"rests"``), an ``"integral"`` or free
            direction, or a ``"growing"`` motion.
        part: remaining difference of two motions, relative to the first difference.
        time: time in s at rest after which this remains.
        rests: number of different equilibria among ``CERTAIN_PASTS`` motions; 0 of growing ones.
    """

    reason: Reason
    part: float
    time: float
    rests: int

    def __str__(self) -> str:
        """Describe the finding, and the remedy."""
        if self.reason == "growing":
            return (
                "an unstable system: the difference of motions with different pasts has grown to "
                f"{self.part:.3g} times the first one after {self.time:.4g} s under the same "
                "constant input. Give every motion damping: look for a damping with the wrong "
                "sign, a spring that pushes, or a controller that is unstable"
            )
        left = (
            f"motions with different pasts stay apart by {percent(self.part)} of their first "
            f"difference after {self.time:.4g} s under the same constant input, and no time "
            "reduces it"
        )
        if self.reason == "hysteresis":
            return (
                f"hysteresis: {left}; they rest at {self.rests} different outputs after "
                f"{CERTAIN_PASTS} pasts, and a strong input changes the difference. Such a system "
                "keeps in mind where it last turned round, however long ago: no window can hold "
                "it. Leave the hysteretic element out, replace it by a smooth friction that "
                "creeps, or give what it keeps (its internal force) as an input"
            )
        if self.reason == "rests":
            return (
                f"several positions of rest: {left}; they rest at {self.rests} different outputs "
                f"after {CERTAIN_PASTS} pasts. In which of them the system is, no window tells: "
                "excite it less (data.excitation), so that it stays near one of them, or fix what "
                "lets it change over"
            )
        return (
            f"an integral or a free direction: {left}, whatever the input. No window can hold it: "
            "fix the free direction, give the system damping and a spring, or choose outputs that "
            "it does not move, such as its rate"
        )


def path_dependence(motions: Motions, count: int) -> PathDependence | None:
    """Find out along the motions of a recipe whether a difference stays at rest.

    It is None if the outputs meet, however slowly; if they still move, as without damping, since
    they are not at rest then; and if there is no time to find out.

    The time at rest is ``count`` samples at first. It is lengthened while outputs differ by more
    than the remaining amplitude, until the remaining difference is constant.

    Raises:
        SimulationError: a motion could not be simulated.
    """
    if motions.patience.gone("motions that come to rest after different pasts"):
        return None
    return _lasting(
        _along(motions, count), count, motions.recipe.window.remaining_amplitude, LONGEST * count
    )


def path_dependence_without_recipe(system: System) -> PathDependence | None:
    """Find out before there is a recipe whether outputs integrate their inputs, or grow.

    Other reasons depend on the motions, which are not known yet: they are let through. It is also
    None if a simulation fails.
    """
    try:
        lasting = _lasting(_jumping(system), AT_REST, MET, AT_REST)
    except SimulationError:
        return None
    return lasting if lasting is not None and lasting.reason in {"integral", "growing"} else None


def _lasting(pasts: _Pasts, count: int, amplitude: float, longest: int) -> PathDependence | None:
    """Return the difference that stays at rest, if one does.

    The time at rest is ``count`` samples at first. It grows fourfold while the difference is above
    an amplitude, until it is more than the longest number of samples.
    """
    times, parts = [count], [pasts.part_left(PASTS, count)]
    while parts[-1] > amplitude and not pasts.patience.gone("a longer time at rest"):
        if len(parts) > 1 and pasts.grows(parts, times[-1]):
            return PathDependence("growing", parts[-1], times[-1] * pasts.step, 0)
        if len(parts) > 1 and parts[-1] > max(GROWN * parts[-2], GROWN):
            return PathDependence("integral", parts[-1], times[-1] * pasts.step, CERTAIN_PASTS)
        if len(parts) > 1 and parts[-1] > FLAT * parts[-2]:
            still = pasts.moving(PASTS, times[-1]) < MOVING
            return _reason(pasts, times[-1], parts[-1]) if still else None
        if times[-1] > longest:
            return None  # it still falls: the system is slow, but it forgets
        times.append(4 * times[-1])
        parts.append(pasts.part_left(PASTS, times[-1]))
    return None


def _along(motions: Motions, count: int) -> _Pasts:
    """Return pasts of ``count`` samples along the motions of a recipe."""
    system, stream = motions.system, motions.stream
    middle = [0.5 * (signal.low + signal.high) for signal in system.inputs]
    # the middle of the ranges of cosine and sine is not a direction
    turning = any(signal.angle for signal in system.inputs)
    held = motions.inputs(0, 1) if turning else np.array([middle])
    states = list[State]()
    if isinstance(system, RandomStates):
        seeds = np.random.SeedSequence(stream.seed, spawn_key=(stream.number, 1))
        rng = np.random.default_rng(seeds)
        drawn = (system.random_state(rng, held[0]) for _ in range(CERTAIN_PASTS))
        states = [State(s.coordinates, s.velocities, held[0]) for s in drawn]
    step, patience = motions.recipe.window.step, motions.patience
    return _Pasts(system, step, held, motions.inputs, count, states, patience)


def _jumping(system: System) -> _Pasts:
    """Return pasts whose inputs jump over their ranges, before the start values of the inputs."""
    signals = system.inputs
    low, high = (np.array([getattr(s, end) for s in signals]) for end in ("low", "high"))

    def inputs(index: int, count: int) -> FloatArray:
        rng = np.random.default_rng([PAST, index])
        levels = rng.uniform(low, high, (-(-count // EVERY), len(low)))
        return on_circles(signals, np.repeat(levels, EVERY, axis=0)[:count])

    start = on_circles(signals, np.array([[signal.start_value for signal in signals]]))
    return _Pasts(system, system.step, start, inputs, PAST, [], TimeBudget())


def _reason(pasts: _Pasts, samples: int, part: float) -> PathDependence:
    ends = pasts.at_rest(CERTAIN_PASTS, pasts.count)[:, -1]
    rests = _different(ends)
    strong = pasts.under_motion(PASTS)
    quiet = pasts.at_rest(PASTS, pasts.count)
    change = _apart(strong[:, -1] - quiet[:, -1]) / max(_apart(quiet[:, -1]), TINY)
    reason: Reason = "rests"
    if rests > FEW:
        reason = "integral" if change < ALONE else "hysteresis"
    return PathDependence(reason, part, samples * pasts.step, rests)


@final
@dataclass(frozen=True, eq=False)
class _Pasts:
    """_Pasts are motions with different pasts and the same continuation.

    Attributes:
        system: the system that moves.
        step: time between samples in s.
        held: the inputs at rest, (1, n_inputs).
        inputs: gives the inputs of a motion by its index and its number of samples.
        count: number of samples of a past.
        states: initial states, if the system draws some: they are the pasts then.
        patience: the time that simulations may take.
    """

    system: System
    step: float
    held: FloatArray
    inputs: Callable[[int, int], FloatArray]
    count: int
    states: list[State]
    patience: TimeBudget

    def grows(self, parts: list[float], samples: int) -> bool:
        """Return whether the last of the remaining differences is that of an unstable system.

        Something may limit the growth. Then a mode that grows at rest shows the reason.
        """
        if parts[-1] > BY_ITSELF * parts[-2]:
            return True
        if parts[-1] < GROWN or not isinstance(self.system, Linearizable):
            return False
        try:
            rate = slowest_rate(self.system.linearize(self.system.rest_state(self.held[0])))
        except (SimulationError, ValueError):  # it does not rest there
            return False
        # rounding splits the double zero of a free direction into two small rates
        return rate * samples * self.step > math.log(GROWN)

    def part_left(self, pasts: int, samples: int) -> float:
        """Return the difference at the end, relative to the difference at the start."""
        outputs = self.at_rest(pasts, samples)
        newest = outputs[:, -max(1, samples // 8) :]
        first = _apart(outputs[:, : self.count])
        return _apart(newest) / first if first > 0.0 else 0.0

    def moving(self, pasts: int, samples: int) -> float:
        """Return the movement of outputs at the end, relative to their distance."""
        newest = self.at_rest(pasts, samples)[:, -max(2, samples // 8) :]
        return float(np.sqrt(np.mean(np.var(newest, axis=1)))) / max(_apart(newest), TINY)

    def at_rest(self, pasts: int, samples: int) -> FloatArray:
        """Return scaled outputs under the constant input, (pasts, samples, n_outputs)."""
        return self._after(pasts, np.repeat(self.held, samples, axis=0))

    def under_motion(self, pasts: int) -> FloatArray:
        """Return the same under a motion of the recipe that returns to the constant input."""
        motion = self.inputs(CERTAIN_PASTS + 1, self.count)
        there = self._towards(self.held, motion[0]), motion, self._towards(motion, self.held[0])
        rest = np.repeat(self.held, self.count, axis=0)
        return self._after(pasts, np.concatenate([*there, rest]))

    def _after(self, pasts: int, inputs: FloatArray) -> FloatArray:
        scale = np.array([signal.high - signal.low for signal in self.system.outputs])
        motions, before = list[Motion](), list[int]()
        for index in range(pasts):
            past = inputs[:0] if self.states else self._past(index)
            initial = self.states[index] if self.states else None
            motions.append(Motion(np.concatenate([past, inputs]), initial))
            before.append(len(past))
        outputs_of_pasts = []
        for count, outputs in zip(before, simulate_motions(self.system, motions), strict=True):
            if isinstance(outputs, SimulationError):
                raise outputs
            outputs_of_pasts.append(outputs[count:] / scale)
        return np.stack(outputs_of_pasts)

    def _past(self, index: int) -> FloatArray:
        """Return inputs that end with the constant ones.

        They move to their largest or smallest value, back beyond the constant one by a fraction of
        that distance, and then rest: hysteresis remembers every such reversal.
        """
        past = self.inputs(1 + index, self.count)
        if not any(signal.angle for signal in self.system.inputs):
            end = np.max(past, axis=0) if index % 2 else np.min(past, axis=0)
            back = self.held[0] - TURNS[index // 2] * (end - self.held[0])
            for turn in (end, back):
                past = np.concatenate([past, self._towards(past, turn)])
        return np.concatenate([past, self._towards(past, self.held[0])])

    def _towards(self, inputs: FloatArray, last: FloatArray) -> FloatArray:
        """Return inputs that move from the end of one sequence to other values, (RAMP, n_inputs).

        They move linearly; cosine and sine of an angle stay on their circle.
        """
        parts = np.arange(1, RAMP + 1)[:, None] / RAMP
        signals, evenly = self.system.inputs, inputs[-1] + parts * (last - inputs[-1])
        return on_circles(signals, within_ranges(signals, evenly))


def _apart(outputs: FloatArray) -> float:
    """Return the distance of motions, (pasts, ..., n_outputs): RMS over all pairs."""
    squares = [np.mean((a - b) ** 2) for a, b in combinations(outputs, 2)]
    return math.sqrt(float(np.mean(squares)))


def _different(ends: FloatArray) -> int:
    """Count different rows of outputs at rest, (motions, n_outputs)."""
    slack = SAME * np.max(np.ptp(ends, axis=0))
    different: list[FloatArray] = []
    for end in ends:
        if not any(np.max(np.abs(end - other)) <= slack for other in different):
            different.append(end)
    return len(different)
