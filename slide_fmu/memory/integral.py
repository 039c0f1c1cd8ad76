"""A system whose outputs integrate its inputs never forgets; this is found without a recipe.

``path_dependence`` finds it along the motions of a recipe, and distinguishes it from other causes.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from slide_fmu.core.signals import FloatArray, on_circles
from slide_fmu.memory.modes import slowest_rate
from slide_fmu.memory.path_dependence import BY_ITSELF, PathDependence
from slide_fmu.systems.base import Linearizable, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

PAST, EVERY = 100, 10
"""Samples of a past, and number of samples after which its inputs change."""
SOON, LATE = 500, 2000
"""Numbers of samples after the pasts at which outputs are compared."""
MET = 0.2
"""Outputs have met if their difference is below this fraction of the first difference."""
FLAT = 0.99
"""A difference stays if this fraction of it remains from ``SOON`` to ``LATE``."""
GROWN = 2.0
"""A difference that grows by this factor grows without end: past motions differ widely."""
ALONE = 0.01
"""A strong input changes an integrated difference by less than this fraction of it."""
SEVERAL = 6
"""Number of pasts: outputs that integrate end at different values after each; with several
equilibria there are few different ends."""


def integral(system: System) -> PathDependence | None:
    """Find out whether the outputs integrate; None if they do not, or if simulation fails.

    Motions with several pasts are compared under constant inputs. If the outputs integrate, their
    differences stay or grow, also after a strong input that they share. A difference that grows
    by itself is named as such.
    """
    try:
        if _part(_apart(_rests(system, 2, SOON))) < MET:
            return None
        apart = _apart(_rests(system, 2, LATE))
        part, soon = _part(apart), _part(apart[: SOON + 1])
        found = PathDependence("integral", part, LATE * system.step, SEVERAL)
        if part > BY_ITSELF * max(soon, 1.0):
            return PathDependence("growing", part, LATE * system.step, 0)
        if part > GROWN * max(soon, 1.0):
            return _named(found, system)
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


def _named(found: PathDependence, system: System) -> PathDependence:
    """Return a growing difference as that of an unstable system, if a mode at rest grows.

    Something else may limit the growth, so that the difference alone does not show the cause.
    """
    if not isinstance(system, Linearizable):
        return found
    start = np.array([signal.start_value for signal in system.inputs])
    try:
        rate = slowest_rate(system.linearize(system.rest_state(start)))
    except (SimulationError, ValueError):  # it does not rest there
        return found
    # rounding splits the double zero of a free direction into two small rates
    grows = rate * LATE * system.step > math.log(GROWN)
    return replace(found, reason="growing") if grows else found


def _rests(system: System, pasts: int, count: int, shaken: bool = False) -> FloatArray:
    """Return outputs (pasts, count + 1, n_outputs) under constant inputs after different pasts.

    If ``shaken``, a strong motion, the same for all, comes in between.
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
    """Draw inputs (PAST, n_inputs), each constant for some samples."""
    rng = np.random.default_rng([PAST, seed])
    return np.repeat(rng.uniform(low, high, (PAST // EVERY, len(low))), EVERY, axis=0)


def _apart(outputs: FloatArray) -> FloatArray:
    """Return the distance of two motions relative to its first part, (N, n_outputs)."""
    apart = np.abs(outputs[1] - outputs[0])
    first = np.max(apart[:EVERY], axis=0)
    relative: FloatArray = apart[:, first > 0] / first[first > 0]
    return relative


def _part(apart: FloatArray) -> float:
    """Return the largest difference over the last tenth of the samples."""
    return float(np.max(apart[-len(apart) // 10 :], initial=0.0))
