"""The slider-crank behind a compliant coupling: shaft angle in, torque of the coupling out.

This is one half of a machine that is cut at its motor's shaft. The other half, a motor with its
inertia, takes the torque and integrates the angle (``motor.py``). The crank, the rod and the
slider are those of ``slider_crank_plant.py``.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import CoordinateSpringDamperExt

from mbs_models.plants.checks import expect_positive
from mbs_models.plants.moved_plant import MOTION, MovedPlant
from mbs_models.slider_crank.slider_crank import angle_of, director
from mbs_models.slider_crank.slider_crank_plant import Mechanism, add_mechanism
from slide_fmu.core.signals import Angle, FloatArray, Signal
from slide_fmu.systems.base import Linearizable, RandomStates, State
from slide_fmu.systems.exudyn.plant import Plant
from slide_fmu.systems.exudyn.plant_system import PlantSystem

STIFFNESS, DAMPING = 1000.0, 20.0
"""Of the coupling, in N m/rad and N m s/rad: the stiffness of the paper's drive, and a fifth of
its damping, so that the crank swings on the coupling with a damping ratio of 0.3 to 0.7."""


class CoupledCrank(PlantSystem[MovedPlant], RandomStates, Linearizable):
    """The shaft of a coupling turns the crank; the output is the torque of the coupling.

    The torque P (s - phi) + D (s' - phi') acts on the crank, with its angle phi, and against the
    shaft, with the angle s. The inputs are cosine and sine of s, which turns along a smooth curve
    through its samples (``MovedPlant``): by less than half a turn in a step.

    Args:
        stiffness: P in N m/rad.
        damping: D in N m s/rad.
        slider_mass: mass in kg of the slider with what it carries.
        elements: even number of finite elements of the rod.
        step: sample step h in s.
        substeps: integration steps per sample.
        speed_limit: largest speed of the crank in random states, in rad/s.
        torque_limit: range of the torque in N m.

    Raises:
        ValueError: a value is out of its range.
    """

    solved_by = "generalized-alpha"

    def __init__(  # noqa: PLR0913 (each is a number that recipes may give)
        self,
        *,
        stiffness: float = STIFFNESS,
        damping: float = DAMPING,
        bending_stiffness: float = 13.8,
        slider_mass: float = 1.0,
        elements: int = 6,
        step: float = 0.01,
        substeps: int = 4,
        speed_limit: float = 6.0,
        torque_limit: float = 80.0,
    ) -> None:
        self._mechanism = Mechanism(
            stiffness, damping, bending_stiffness, slider_mass, elements, step, substeps
        )
        super().__init__(self._mechanism.coordinates + MOTION, n_inputs=2)
        expect_positive(speed_limit=speed_limit, torque_limit=torque_limit)
        self._speed_limit = speed_limit
        self._last_input = director(0.0)
        self.step = step
        self.inputs = (_shaft("x", "cosine"), _shaft("y", "sine"))
        meaning = "torque of the coupling on the crank"
        self.outputs = (Signal("torque", "N.m", -torque_limit, torque_limit, meaning),)

    def _build(self) -> MovedPlant:
        container, known = exu.SystemContainer(), self._mechanism
        mbs: Any = container.AddSystem()
        coupling = mbs.AddObject(
            CoordinateSpringDamperExt(
                markerNumbers=[*add_mechanism(mbs, known)],
                stiffness=known.proportional,
                damping=known.differential,
            )
        )
        mbs.Assemble()

        def turn(angle: float, rate: float) -> None:
            mbs.SetObjectParameter(coupling, "offset", angle)
            mbs.SetObjectParameter(coupling, "velocityOffset", rate)

        plant = Plant(container, mbs, known.step, known.substeps, "generalized_alpha")
        return MovedPlant(plant, known.step, turn)

    def _apply(self, model: MovedPlant, inputs: FloatArray) -> None:
        model.go(math.remainder(_shaft_angle(inputs) - model.position, 2.0 * math.pi))

    def output(self) -> FloatArray:
        """Return the torque of the coupling in N m, shape (1,)."""
        twist = self._coordinates[-MOTION] - self._coordinates[2]
        rate = self._velocities[-MOTION] - self._velocities[2]
        return np.array(
            [self._mechanism.proportional * twist + self._mechanism.differential * rate]
        )

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw a state with a straight rod; half of them rest, half have a constant speed.

        The shaft is at the first input, if there is one.

        Raises:
            ValueError: the first input is not finite or has no direction.
        """
        speed = float(rng.integers(2)) * rng.uniform(-self._speed_limit, self._speed_limit)
        if first_input is None:
            return self.straight_state(rng.uniform(-math.pi, math.pi), speed)
        return self.straight_state(
            _shaft_angle(self._finite_inputs("first input", first_input)), speed
        )

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the state at rest at a constant shaft, shape (2,), with a straight rod.

        Raises:
            ValueError: the shaft is not finite or has no direction.
        """
        return self.straight_state(
            _shaft_angle(self._finite_inputs("held input", held_input)), 0.0
        )

    def straight_state(self, angle: float, speed: float) -> State:
        """Return a state at an angle in rad and a speed in rad/s, as if the rod was rigid.

        The coupling is not twisted in it.
        """
        coordinates, velocities = self._mechanism.straight(angle, speed)
        return State(
            np.append(coordinates, [angle, speed]),
            np.append(velocities, [speed, 0.0]),
            director(angle),
        )


def _shaft_angle(values: FloatArray) -> float:
    return angle_of(values, "shaft", "shaft's angle")


def _shaft(axis: str, angle: Angle) -> Signal:
    meaning = f"{angle} of the shaft's angle"
    start = 1.0 if angle == "cosine" else 0.0
    return Signal(f"shaft_{axis}", "1", -1.0, 1.0, meaning, start, "first_order", angle)
