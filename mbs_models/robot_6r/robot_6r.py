"""A Puma 560 stands on a flexible socket; the output is the deviation of its tool.

Inputs are the desired joint angles, one set per sample; the output is the deviation of the tool
from the rigid forward kinematics of the actual joint angles: p_e in the paper's section "Spatial
6R manipulator on a flexible socket".
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from mbs_models.plants.checks import expect
from mbs_models.robot_6r.flange import euler_of, moment_of, rotation_of, vector_of
from mbs_models.robot_6r.puma_560 import DAMPING, JOINTS, LIMITS, STIFFNESS, puma_560
from mbs_models.robot_6r.robot_6r_plant import Manipulator, ManipulatorPlant
from mbs_models.robot_6r.socket import FLANGE, Socket
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.systems.base import Chained, Linearizable, Linearization, RandomStates, State
from slide_fmu.systems.exudyn.plant_system import PlantSystem

SOCKET_DAMPING = 8e-3
"""The socket's damping is its stiffness times this, in s."""
ROTATION_LIMIT = 0.05
"""Components of the rotation vector lie within plus and minus this, in rad."""
_RELEASED = np.repeat([200.0, 100.0], 3)
"""Largest extra forces in N and torques in N m that had bent the socket in random states."""
_ROUNDS, _SETTLED = 100, 1e-13
"""Limit of rounds, and of the change in rad, that ends the search for the static equilibrium."""


class Robot6R(PlantSystem[ManipulatorPlant], RandomStates, Linearizable, Chained):
    """The robot has six joints with PD control on a socket of plastics, under gravity.

    The torque on joint i is P (s_i - q_i) + D (s_i' - q_i'), where s(t) goes through the desired
    angles along a quadratic B-spline (see SetPoints): its rate is continuous, and it lags half a
    step behind. Gravity is not compensated.

    World axes are those of the flange without load: z up, the origin in its middle. The flange
    moves by the displacement u and turns by R. Then p_e = u + R p(q) - p(q) with the rigid
    forward kinematics p(q) of the *actual* joint angles. So it does not contain the lag of the
    drives, only the deviation by the socket.

    A state holds u, the flange's angles (about x, the new y, the new z), the six joint angles,
    internal coordinates of the socket if there are any, and then s; its velocities are the rates
    of these.

    Args:
        socket: "finite_element" for the reduced finite elements with internal modes, as a part
            of the implicit equations; "spring" for the stiffness, mass and weight that the
            flange feels, which is twice as fast and within 0.02 % of the response's RMS.
        step: sample step h in s.
        substeps: integration steps per sample; under the fastest motions of the paper, 8 give
            0.07 % of the response's RMS, 3 give 0.45 % in half the time.
        tool_length: of the tool point from the wrist's centre, along the last axis, in m.
        rotation: whether the rotation vector of the flange is an output too: how far the tool is
            turned.
        authors_gains: whether the gains of the third joint are 1e4 and 400, as in the paper's
            code, and not 4e4 and 100, as in the paper.
        deviation_limit: range of the deviations in m; random moves of 1 s reach 0.042.
        reduced: reduced socket; None for the one that comes with the package.

    Attributes:
        chain: the rigid arm with its tool point.

    Raises:
        ValueError: a value is out of its range.
    """

    solved_by = "trapezoidal rule"

    chain: SerialChain

    def __init__(
        self,
        *,
        socket: str = "spring",
        step: float = 1.0 / 60.0,
        substeps: int = 8,
        tool_length: float = 0.0,
        rotation: bool = False,
        authors_gains: bool = False,
        deviation_limit: float = 0.045,
        reduced: Socket | None = None,
    ) -> None:
        if socket not in ("spring", "finite_element"):
            raise ValueError(
                f"system parameter socket = {socket!r}; expected 'spring' or 'finite_element': "
                "correct the constructor argument or the recipe's [system.parameters]"
            )
        expect("tool_length", tool_length, math.isfinite(tool_length), "a finite number")
        whole = (Socket.read() if reduced is None else reduced).symmetric()
        self._socket = whole if socket == "finite_element" else whole.without_modes()
        self.chain = puma_560(np.array([0.0, 0.0, tool_length]))
        proportional, differential = STIFFNESS.copy(), DAMPING.copy()
        if authors_gains:
            proportional[2], differential[2] = 1e4, 400.0
        self._manipulator = Manipulator(
            self.chain,
            proportional,
            differential,
            self._socket,
            SOCKET_DAMPING,
            step,
            substeps,
            exact=socket == "finite_element",
        )
        super().__init__(self._manipulator.coordinates + JOINTS, n_inputs=JOINTS)
        self._rotation = rotation
        self._exact: ManipulatorPlant | None = None
        self.step = step
        self.inputs = tuple(_joint_signal(index) for index in range(JOINTS))
        meaning = "deviation of the tool from"
        self.outputs = _vector_signals("deviation", "m", deviation_limit, meaning)
        if rotation:
            meaning = "rotation vector of the tool against"
            self.outputs += _vector_signals("rotation", "rad", ROTATION_LIMIT, meaning)

    def _build(self) -> ManipulatorPlant:
        return ManipulatorPlant(self._manipulator)

    def __getstate__(self) -> dict[str, object]:
        return {**super().__getstate__(), "_exact": None}

    def linearize(self, state: State) -> Linearization:
        """Linearize flange, joints, internal coordinates and drives to M, D, K in SI units."""
        # the fast spring holds a part of its force over a substep, which no tangent can show
        if self._exact is None:
            self._exact = ManipulatorPlant(replace(self._manipulator, exact=True))
        return self._exact.plant.linearize(state.coordinates, state.velocities)

    def _apply(self, model: ManipulatorPlant, inputs: FloatArray) -> None:
        model.plant.follow(inputs)

    def output(self) -> FloatArray:
        """Return the deviation of the tool in m, shape (3,).

        With ``rotation`` the rotation vector of the flange in rad follows, shape (6,).
        """
        flange, joints = self._coordinates[:FLANGE], self._coordinates[FLANGE : FLANGE + JOINTS]
        turn = rotation_of(flange[3:])
        rigid = self.chain.tool_position(joints)
        deviation = flange[:3] + turn @ rigid - rigid
        return np.concatenate([deviation, vector_of(turn)]) if self._rotation else deviation

    def points(self, state: State) -> FloatArray:
        """Return positions in m in world axes, shape (9, 3).

        They are those of the socket's bottom, the flange, the six link frames and the tool.
        """
        flange = state.coordinates[:FLANGE]
        frames = self.chain.forward_kinematics(state.coordinates[FLANGE : FLANGE + JOINTS])
        tool = frames.positions[-1] + frames.rotations[-1] @ self.chain.tool
        rigid = np.vstack([frames.positions, tool])
        bottom = [0.0, 0.0, -self._socket.mesh.length]
        return np.vstack([bottom, flange[:3] + rigid @ rotation_of(flange[3:]).T])

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw a state at rest, just released: as far off equilibrium as a fast motion gets.

        The drives rest at the first input, or anywhere within the joints' limits. Extra forces
        up to 200 N and torques up to 100 N m on the flange had bent the socket, and the joints
        are up to 0.005 rad away.
        """
        desired = rng.uniform(-LIMITS, LIMITS) if first_input is None else first_input
        state = self.rest_state(desired)
        bend = self._flexibility[:FLANGE, :FLANGE] @ (rng.uniform(-1.0, 1.0, FLANGE) * _RELEASED)
        state.coordinates[:FLANGE] += bend
        state.coordinates[FLANGE : FLANGE + JOINTS] += rng.uniform(-0.005, 0.005, JOINTS)
        return state

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the static equilibrium under gravity at constant desired angles in rad, (6,).

        Raises:
            ValueError: the angles are not finite.
        """
        desired = self._finite_inputs("held input", held_input)
        joints, place = desired, np.zeros(len(self._socket.mass))
        for _ in range(_ROUNDS):
            before = joints
            joints, place = self._sagged(desired, joints, place)
            if np.max(np.abs(joints - before)) < _SETTLED:
                break
        flange = np.concatenate([place[:3], euler_of(place[3:FLANGE])])
        coordinates = np.concatenate([flange, joints, place[FLANGE:], desired])
        return State(coordinates, np.zeros(len(coordinates)), desired.copy())

    def _sagged(
        self, desired: FloatArray, joints: FloatArray, place: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return joint angles and place of the socket under the weight that they have elsewhere.

        It is one round of a fixed-point search for the equilibrium at the desired angles. Angles
        are in rad, shape (6,); the place holds u in m, theta in rad and the internal coordinates.
        """
        theta = place[3:FLANGE]
        turn = rotation_of(euler_of(theta))
        arm = self.chain.turned(turn)
        still = np.zeros(JOINTS)
        wrench = arm.base_wrench(joints, still, still)
        torques = arm.joint_torques(joints, still, still)
        load = self._socket.weight @ self.chain.gravity
        load[:3] += turn @ wrench[:3]
        load[3:FLANGE] += moment_of(theta, turn @ wrench[3:])
        return desired - torques / self._manipulator.proportional, self._flexibility @ load

    @cached_property
    def _flexibility(self) -> FloatArray:
        """The flexibility is the inverse of the socket's stiffness, in SI units."""
        return np.asarray(np.linalg.inv(self._socket.stiffness))


def _joint_signal(index: int) -> Signal:
    limit, meaning = float(LIMITS[index]), f"desired angle of joint {index + 1}"
    return Signal(f"joint_{index + 1}", "rad", -limit, limit, meaning, hold="first_order")


def _vector_signals(name: str, unit: str, limit: float, meaning: str) -> tuple[Signal, ...]:
    meaning += " the rigid forward kinematics, world"
    return tuple(
        Signal(f"{name}_{axis}", unit, -limit, limit, f"{meaning} {axis}") for axis in "xyz"
    )
