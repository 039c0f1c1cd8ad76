"""The mass chain is a row of six masses between two walls, joined by cubic springs.

It has twelve states, two forces as inputs and three positions as outputs. The defaults put the
modes between 18 and 78 rad/s (the highest has 6.4 samples per period), and every mode decays at
3 1/s or faster: to one thousandth within 2.3 s. Under random forces in range the springs' cubic
share matters: the best linear model misses a fifth to a third of the response.
"""

from __future__ import annotations

import numpy as np

from mbs_models.plants.spring_masses import SpringMasses, SpringMassSystem
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import State

MASSES = 6
"""The chain has this many masses."""
LOADED = (0, 3)
"""The masses with these indices carry an input force."""
OBSERVED = (1, 3, 5)
"""The positions of the masses with these indices are the outputs."""
REACH = 1.5
"""The positions' range is this many times the largest static deflection under both forces at their
limit; random forces reach 1.3 times that deflection."""


class MassChain(SpringMassSystem):
    """The masses follow m x_i'' + c x_i' + f_i - f_(i+1) = F_i, i = 1 .. 6.

    The springs have f_i = k s + alpha k s^3 + d s' with s = x_i - x_(i-1). The forces F_1 and F_4
    are the inputs, each with a zero-order hold; the outputs are x_2, x_4 and x_6.

    Args:
        mass: m of each of the six masses in kg.
        stiffness: k of each of the seven springs in N/m.
        damping: d of each spring in N s/m.
        drag: c of each mass against the ground in N s/m.
        alpha: cubic share of the springs in 1/m^2.
        step: sample step h in s.
        substeps: integration steps per sample; 12 give 2e-9 of the response's RMS (at most
            1e-8 at any time), 4 give 2e-6 in less than half the time.
        force_limit: intended range of both forces is [-force_limit, force_limit] N.

    Raises:
        ValueError: a value is out of its range.
    """

    def __init__(
        self,
        *,
        mass: float = 1.0,
        stiffness: float = 1600.0,
        damping: float = 1.0,
        drag: float = 6.0,
        alpha: float = 50.0,
        step: float = 0.0125,
        substeps: int = 12,
        force_limit: float = 250.0,
    ) -> None:
        chain = SpringMasses(
            mass, stiffness, damping, alpha, step, substeps, drag, MASSES, LOADED, second_wall=True
        )
        limit = REACH * float(np.max(chain.equilibrium(np.full(len(LOADED), force_limit))))
        forces = tuple(_force_signal(index, force_limit) for index in LOADED)
        positions = tuple(_position_signal(index, limit) for index in OBSERVED)
        super().__init__(chain, forces, positions, OBSERVED)

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw positions from U(-0.05, 0.05) m and velocities from U(-2, 2) m/s."""
        coordinates = rng.uniform(-0.05, 0.05, MASSES)
        return State(coordinates, rng.uniform(-2.0, 2.0, MASSES), np.zeros(len(LOADED)))


def _force_signal(index: int, limit: float) -> Signal:
    meaning = f"force on mass {index + 1}, with a zero-order hold"
    return Signal(f"force_{index + 1}", "N", -limit, limit, meaning)


def _position_signal(index: int, limit: float) -> Signal:
    return Signal(f"position_{index + 1}", "m", -limit, limit, f"position of mass {index + 1}")
