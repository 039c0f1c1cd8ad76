"""Linearized equations are refused if they contradict the measured decay.

Along motions of a nonlinear system the two differ. So they are also compared near rest, where the
equations describe the system itself. Only a contradiction at both places, in the same direction,
is a fault of the equations.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import within_ranges
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.modes import time_to_decay
from slide_fmu.memory.motions import MEASURED_DECAYS, Linearized, Motions
from slide_fmu.systems.base import Linearizable
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


def contradiction(motions: Motions, linearized: Linearized, measured: Decay) -> str | None:
    """Describe a contradiction of linearized equations and measured decay; None if they agree.

    Raises:
        SimulationError: a motion could not be simulated.
    """
    along = measured.mean / linearized.decay.mean
    if 1.0 / FACTOR <= along <= FACTOR:
        return None
    rate = _rate_near_rest(motions, max(linearized.decay.mean, _finite(measured.mean)))
    modes, amplitude = linearized.modes, linearized.decay.remaining_amplitude
    if rate is None or not modes.modes:
        near, found, expected = along, measured.mean, linearized.decay.mean
    else:
        found, expected = time_to_decay(rate, amplitude), modes.decay_time
        near = found / expected
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
        f"but measured are {measured.mean:.4g} s and {found:.4g} s; expected agreement within a "
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
