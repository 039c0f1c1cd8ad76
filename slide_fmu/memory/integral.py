"""A system whose outputs integrate its inputs never forgets; that is found without a recipe.

``path_dependence`` finds it along the motions of a recipe, with other reasons.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray, on_circles
from slide_fmu.memory.path_dependence import PathDependence
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

PAST, EVERY = 100, 10
"""Pasts have the first number of samples, and other inputs after every second number of them."""
SOON, LATE = 500, 2000
"""Outputs are compared these numbers of samples after the pasts."""
MET = 0.2
"""Outputs that are apart by less than this part of their first difference meet."""
FLAT = 0.99
"""A difference of which this part is left from ``SOON`` to ``LATE`` stays."""
GROWN = 2.0
"""One that becomes this many times as large grows without end: past motions differ widely."""
ALONE = 0.01
"""A strong input changes a difference that is integrated by less than this part of it."""
SEVERAL = 6
"""This many pasts lead to as many ends where outputs integrate, and to few where there are several
positions of rest."""


def integral(system: System) -> PathDependence | None:
    """Find out whether the outputs integrate; None if they do not, or if it cannot be simulated.

    Motions with several pasts are compared while their inputs are constant. Their differences
    stay, or grow, where the outputs integrate, also after a strong input that they share.
    """
    try:
        if _part(_apart(_rests(system, 2, SOON))) < MET:
            return None
        apart = _apart(_rests(system, 2, LATE))
        part, soon = _part(apart), _part(apart[: SOON + 1])
        found = PathDependence("integral", part, LATE * system.step, SEVERAL)
        if part > GROWN * max(soon, 1.0):
            return found
        if part < FLAT * soon or soon < FLAT * part:
            return None
        ends = _rests(system, SEVERAL, SOON)[:, -1]
        shaken = _rests(system, SEVERAL, SOON, shaken=True)[:, -1]
    except SimulationError:
        return None
    size = np.ptp(ends, axis=0).max()
    change = np.abs((shaken - shaken[0]) - (ends - ends[0])).max()
    gaps = np.diff(np.sort(ends[:, int(np.argmax(np.ptp(ends, axis=0)))]))
    return found if change < ALONE * size and gaps.min() > ALONE * size / SEVERAL else None


def _rests(system: System, pasts: int, count: int, shaken: bool = False) -> FloatArray:
    """Return outputs (pasts, count + 1, n_outputs) under constant inputs after different pasts.

    A strong motion that all have in common lies between, if they are ``shaken``.
    """
    signals, found = system.inputs, []
    low, high = (np.array([getattr(s, end) for s in signals]) for end in ("low", "high"))
    still = np.tile([signal.start_value for signal in signals], (count, 1))
    for seed in range(pasts):
        parts = [_drawn(low, high, seed), *([_drawn(low, high, pasts)] if shaken else []), still]
        inputs = on_circles(signals, np.concatenate(parts))
        found.append(simulate(system, inputs).outputs[-count - 1 :])
    return np.array(found)


def _drawn(low: FloatArray, high: FloatArray, seed: int) -> FloatArray:
    """Draw inputs (PAST, n_inputs) that stay for some samples each."""
    rng = np.random.default_rng([PAST, seed])
    return np.repeat(rng.uniform(low, high, (PAST // EVERY, len(low))), EVERY, axis=0)


def _apart(outputs: FloatArray) -> FloatArray:
    """Return how far two motions are apart, relative to the first part of it: (N, n_outputs)."""
    apart = np.abs(outputs[1] - outputs[0])
    first = np.max(apart[:EVERY], axis=0)
    relative: FloatArray = apart[:, first > 0] / first[first > 0]
    return relative


def _part(apart: FloatArray) -> float:
    """Return the largest difference over the last tenth of the samples."""
    return float(np.max(apart[-len(apart) // 10 :], initial=0.0))
