"""A system whose outputs depend on the time itself cannot be learnt from its inputs.

Where a system can begin later, it must give the same outputs then, under the same inputs.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import on_circles
from slide_fmu.systems.base import BegunLater, System
from slide_fmu.systems.errors import LoadError, SimulationError

LATER = 37, 523, 7919, 104729
"""Numbers of sample steps by which a motion begins later; no period divides two of them."""
SAMPLES, EVERY, SEED = 100, 10, 37
"""The motion has the first number of samples, and inputs that jump after every second one."""
NOTICED = 0.01
"""Differences are noticed from this part of the outputs' motion: solvers have errors."""
ROUNDED = 1e-6
"""Below this part of the outputs they are rounding."""


def time_dependence(system: System) -> str | None:
    """Say by how much outputs depend on the time itself; None if they do not, or it is not known.

    It is not known of a system that cannot begin later, or fails then.
    """
    if not isinstance(system, BegunLater):
        return None
    signals = system.inputs
    low, high = (np.array([getattr(s, end) for s in signals]) for end in ("low", "high"))
    start = np.array([signal.start_value for signal in signals])
    levels = np.random.default_rng(SEED).uniform(low, high, (SAMPLES // EVERY, len(signals)))
    inputs = on_circles(signals, np.repeat(np.vstack([start, levels[1:]]), EVERY, axis=0))
    try:
        now = system.simulate(inputs)
    except (SimulationError, LoadError):
        return None
    moved = np.ptp(now, axis=0)
    least = np.maximum(NOTICED * moved, ROUNDED * np.max(np.abs(now), axis=0))
    for samples in LATER:
        try:
            later = system.begun_later(samples).simulate(inputs)
        except (SimulationError, LoadError):
            continue
        apart = np.max(np.abs(later - now), axis=0)
        if np.any(apart > least):
            told = [
                f"{signal.name} differs by up to {most:.3g} {signal.unit}".rstrip()
                for signal, most, enough in zip(system.outputs, apart, least, strict=True)
                if most > enough
            ]
            return (
                f"its outputs depend on time: under the same inputs, {', '.join(told)} where it "
                f"begins {samples * system.step:.4g} s later; expected outputs that follow from "
                "inputs and states alone: leave the clock out of the model, or make what depends "
                "on time an input"
            )
    return None
