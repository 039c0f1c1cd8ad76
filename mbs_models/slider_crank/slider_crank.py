"""The rod of a slider-crank bends while a drive turns the crank; the output is its deflection.

This is the machine of the paper's section "Planar flexible slider-crank". The drive follows the
desired angle of the crank, given once per sample by its director (cosine, sine).
"""

from __future__ import annotations

import math

import numpy as np

from mbs_models.plants.checks import expect_positive
from mbs_models.slider_crank.slider_crank_plant import CRANK_LENGTH, Mechanism, SliderCrankPlant
from slide_fmu.core.signals import Angle, FloatArray, Signal
from slide_fmu.systems.base import Linearizable, RandomStates, State
from slide_fmu.systems.exudyn.plant_system import PlantSystem

_SHORTEST_DIRECTOR = 1e-6
"""Shorter directors have no direction."""


class SliderCrank(PlantSystem[SliderCrankPlant], RandomStates, Linearizable):
    """The mechanism has a rigid crank (0.5 m, 2 kg), a flexible rod (1 m, 4 kg), a slider.

    It moves in the plane, without gravity and friction. The torque on the crank is
    P (s - phi) + D (s' - phi') for its angle phi (paper, eq. SCControl), where s(t) goes through
    the desired angles along a quadratic B-spline (see SetPoints): its speed is continuous, and it
    lags half a step behind. The desired angle must turn by less than half a turn in a step. The
    damping of the rod in bending is 0.015 s times its bending stiffness.

    A state holds the coordinates of exudyn and then s; its velocities are the rates of these. The
    coordinates of exudyn are displacements from the mechanism stretched along x: of the crank's
    middle, the crank's angle, of the rod's nodes and slopes, of the slider.

    Args:
        proportional: P in N m/rad. The drive settles like exp(-P / D t): with 10 N m/rad its
            memory is 46 s.
        differential: D in N m s/rad.
        bending_stiffness: E I of the rod in N m^2.
        slider_mass: mass in kg of the slider with what it carries.
        elements: even number of finite elements of the rod.
        step: sample step h in s.
        substeps: integration steps per sample. With the default step, 10 elements and 20
            substeps are wrong by 0.02 % of the deflection's standard deviation; 6 and 10 by
            0.09 %, in less than half the time; 6 and 4 by 0.44 %, in a quarter of it.
        speed_limit: largest speed of the crank in random states, in rad/s.
        deflection_limit: range of the deflection in m.

    Raises:
        ValueError: a value is out of its range.
    """

    solved_by = "generalized-alpha"

    def __init__(  # noqa: PLR0913 (each is a number that recipes may give)
        self,
        *,
        proportional: float = 1000.0,
        differential: float = 100.0,
        bending_stiffness: float = 13.8,
        slider_mass: float = 1.0,
        elements: int = 10,
        step: float = 1.0 / 32.0,
        substeps: int = 20,
        speed_limit: float = 8.0,
        deflection_limit: float = 0.11,
    ) -> None:
        self._mechanism = Mechanism(
            proportional, differential, bending_stiffness, slider_mass, elements, step, substeps
        )
        drives = 1
        super().__init__(self._mechanism.coordinates + drives, n_inputs=2)
        expect_positive(speed_limit=speed_limit)
        self._speed_limit = speed_limit
        self._last_input = director(0.0)
        self.step = step
        self.inputs = (_director_signal("x", "cosine"), _director_signal("y", "sine"))
        meaning = "distance of the rod's middle from the line between its ends, positive left"
        self.outputs = (Signal("deflection", "m", -deflection_limit, deflection_limit, meaning),)

    def _build(self) -> SliderCrankPlant:
        return SliderCrankPlant(self._mechanism)

    def _apply(self, model: SliderCrankPlant, inputs: FloatArray) -> None:
        newest = model.plant.newest()
        turn = math.remainder(angle_of(inputs) - float(newest[0]), 2.0 * math.pi)
        model.plant.follow(newest + turn)

    def output(self) -> FloatArray:
        """Return the deflection of the rod's middle in m, shape (1,).

        It is positive to the left of the line from the crank to the slider.
        """
        return np.array([self._mechanism.deflection(self._coordinates)])

    def points(self, state: State) -> FloatArray:
        """Return the positions (x, y) in m of the crank's pivot, its tip and the rod's nodes.

        The shape is (elements + 3, 2): the rod's first node is the tip again, its last one the
        slider.
        """
        angle = state.coordinates[2]
        tip = CRANK_LENGTH * director(angle)
        return np.vstack([np.zeros(2), tip, self._mechanism.rod_nodes(state.coordinates)])

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw a state with a straight rod: half of them rest, half have a constant speed.

        Without a first input the crank has any angle and follows the drive. With a first input the
        drive rests there, the crank is up to 0.1 rad away, and it turns at up to a tenth of the
        speed limit.

        Raises:
            ValueError: the first input is not finite or has no direction.
        """
        share = float(rng.integers(2))
        if first_input is None:
            angle = rng.uniform(-math.pi, math.pi)
            speed = rng.uniform(-self._speed_limit, self._speed_limit)
            return self.straight_state(angle, share * speed)
        desired = angle_of(self._finite_inputs("first input", first_input))
        angle = desired + rng.uniform(-0.1, 0.1)
        speed = 0.1 * share * rng.uniform(-self._speed_limit, self._speed_limit)
        coordinates, velocities = self._mechanism.straight(angle, speed)
        return State(
            np.append(coordinates, desired), np.append(velocities, 0.0), director(desired)
        )

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the state at rest at a constant director, shape (2,), with a straight rod.

        Raises:
            ValueError: the director is not finite or has no direction.
        """
        return self.straight_state(angle_of(self._finite_inputs("held input", held_input)), 0.0)

    def straight_state(self, angle: float, speed: float) -> State:
        """Return a state at a crank angle in rad and speed in rad/s, as if the rod was rigid.

        The drive has no error in it.
        """
        coordinates, velocities = self._mechanism.straight(angle, speed)
        return State(
            np.append(coordinates, angle),
            np.append(velocities, speed),
            director(angle + 0.5 * self.step * speed),
        )


def director(angle: float) -> FloatArray:
    """Return the cosine and the sine of an angle in rad, shape (2,)."""
    return np.array([math.cos(angle), math.sin(angle)])


def angle_of(
    values: FloatArray, name: str = "director", meaning: str = "desired crank angle"
) -> float:
    """Return the angle in rad of a director, shape (2,), of any length; messages name it.

    Raises:
        ValueError: the director is too short to have a direction.
    """
    if not math.hypot(*values) > _SHORTEST_DIRECTOR:
        raise ValueError(
            f"input {name}_x, {name}_y = {values}; expected the cosine and sine of the "
            f"{meaning}, at least {_SHORTEST_DIRECTOR} long: correct the input"
        )
    return math.atan2(values[1], values[0])


def _director_signal(axis: str, angle: Angle) -> Signal:
    meaning = f"{angle} of the desired crank angle"
    start = 1.0 if angle == "cosine" else 0.0
    return Signal(f"director_{axis}", "1", -1.0, 1.0, meaning, start, "first_order", angle)
