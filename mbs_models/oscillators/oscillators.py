"""A mass on a spring and damper comes in three forms: linear, Duffing, Duffing on a moving base.

All three follow m x'' + d x' + k s + alpha k s^3 = F. Under a force, s = x; on a base at b(t),
s = x - b(t) and F = 0, and the damper acts on the absolute velocity. The defaults are those of the
paper's sections "Introductionary example: the mass spring damper" and "Duffing oscillator":
omega_0 = 40 rad/s, damping ratio 0.1, alpha = 0.5.
"""

from __future__ import annotations

import numpy as np

from mbs_models.plants.spring_masses import SpringMasses, SpringMassSystem
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import State
from slide_fmu.systems.exudyn.wires import InputTable, OutputTable


class _OscillatorSystem(SpringMassSystem):
    """An oscillator system has one input and one position. Interface: never instantiated."""

    _drawn = 1.0, 10.0
    """Random states lie within plus and minus this position in m and this velocity in m/s."""

    def __init__(self, oscillator: SpringMasses, signal: Signal, limit: float) -> None:
        position = Signal("position", "m", -limit, limit, "position of the mass")
        super().__init__(oscillator, (signal,), (position,))

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw position, velocity and place of the base uniformly from symmetric ranges."""
        position, speed = self._drawn
        last = self.inputs[0].high if self._moving else 0.0
        drawn = [rng.uniform(-limit, limit, 1) for limit in (position, speed, last)]
        return State(*drawn)


class LinearOscillator(_OscillatorSystem):
    """The linear oscillator follows m x'' + d x' + k x = F, with a zero-order hold of the force.

    Arguments are as for ``DuffingOscillator``, without alpha. 12 substeps give 3e-10 of the
    response's RMS, and no force in range moves the mass further than the default position limit of
    8 m.

    Raises:
        ValueError: a value is out of its range.
    """

    _drawn = 0.5, 0.5

    def __init__(
        self,
        *,
        mass: float = 1.0,
        stiffness: float = 1600.0,
        damping: float = 8.0,
        step: float = 1.0 / 64.0,
        substeps: int = 12,
        force_limit: float = 2000.0,
        position_limit: float = 8.0,
    ) -> None:
        oscillator = SpringMasses(mass, stiffness, damping, 0.0, step, substeps)
        super().__init__(oscillator, _force_signal(force_limit), position_limit)


class DuffingOscillator(_OscillatorSystem):
    """The Duffing oscillator follows m x'' + d x' + k x + alpha k x^3 = F.

    The force has a zero-order hold.

    Args:
        mass: m in kg.
        stiffness: k in N/m.
        damping: d in N s/m.
        alpha: cubic share of the spring in 1/m^2.
        step: sample step h in s.
        substeps: integration steps per sample; 24 give 5e-9 of the response's RMS.
        force_limit: intended range of the force is [-force_limit, force_limit] N.
        position_limit: range of the position in m; sweeps at full force go to 1.9 m.

    Raises:
        ValueError: a value is out of its range.
    """

    def __init__(
        self,
        *,
        mass: float = 1.0,
        stiffness: float = 1600.0,
        damping: float = 8.0,
        alpha: float = 0.5,
        step: float = 0.03,
        substeps: int = 24,
        force_limit: float = 1000.0,
        position_limit: float = 2.5,
    ) -> None:
        oscillator = SpringMasses(mass, stiffness, damping, alpha, step, substeps)
        super().__init__(oscillator, _force_signal(force_limit), position_limit)


class DuffingBaseMotion(_OscillatorSystem):
    """The mass on a moving base follows m x'' + d x' + k (x - b) + alpha k (x - b)^3 = 0.

    This is the excitation of the paper's code. The input is the position b of the base in m,
    within plus and minus ``base_limit``, with a first-order hold: it goes linearly from the last
    input to the new one and arrives at the end of the step. Other arguments are as for
    ``DuffingOscillator``; the damping acts on the absolute velocity.

    Raises:
        ValueError: a value is out of its range.
    """

    def __init__(
        self,
        *,
        mass: float = 1.0,
        stiffness: float = 1600.0,
        damping: float = 8.0,
        alpha: float = 0.5,
        step: float = 0.03,
        substeps: int = 24,
        base_limit: float = 0.2,
        position_limit: float = 2.0,
    ) -> None:
        oscillator = SpringMasses(mass, stiffness, damping, alpha, step, substeps)
        meaning = "position of the base"
        base = Signal("base", "m", -base_limit, base_limit, meaning, hold="first_order")
        super().__init__(oscillator, base, position_limit)

    def _wires(self) -> tuple[dict[str, InputTable], dict[str, OutputTable]]:
        """Let the spring's force begin a step at the base and move with it."""
        base = InputTable(parameter="spring_1.offset", rate_parameter="spring_1.velocityOffset")
        return {"base": base}, {"position": OutputTable()}


def _force_signal(limit: float) -> Signal:
    return Signal("force", "N", -limit, limit, "force on the mass, with a zero-order hold")
