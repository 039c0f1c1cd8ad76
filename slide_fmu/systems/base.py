"""What a reference system is: signals, simulation from a state, stepping, linearization."""

from __future__ import annotations

import abc
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, Trajectory
from slide_fmu.features.serial_chain import SerialChain

Parameter = float | int | str | bool
"""Value of a parameter of a reference system, as TOML and JSON know it."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """A Linearization has the matrices of M q'' + D q' + K q + G^T lambda = 0, G q = 0 at a state.

    Attributes:
        mass: M, shape (n, n).
        damping: D = -df/dq', shape (n, n).
        stiffness: K = -df/dq, shape (n, n).
        constraints: Jacobian G of the constraints, shape (n_constraints, n), may have no rows.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    constraints: FloatArray


@dataclass(frozen=True, eq=False)
class State:
    """A State is all that the future depends on at one sample, beside the inputs to come.

    Attributes:
        coordinates: generalized coordinates q, shape (n,).
        velocities: their rates q', shape (n,).
        last_input: the input that acted last, shape (n_inputs,); a first-order hold starts from
            it.
    """

    coordinates: FloatArray
    velocities: FloatArray
    last_input: FloatArray


class System(abc.ABC):
    """A System is a reference system, sampled with the step h. Interface: never instantiated.

    Implementations are final, cheap to construct (heavy work on first use) and are made again
    in every worker process from their dotted name and parameters.

    Attributes:
        step: sample step h in s.
        inputs, outputs: signals in channel order; inputs say how they act between samples and
            which of them are an angle (``check_inputs``).
        chain: rigid bodies of a system whose inputs are the joint angles of a serial chain, for
            features of its motion; None for other systems.
    """

    step: float
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    chain: SerialChain | None = None

    @abc.abstractmethod
    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw an initial state from the range in which the system is used.

        Args:
            first_input: what acts first, shape (n_inputs,), if it is known; a system that is made
                to follow its inputs starts somewhere near.
        """

    @abc.abstractmethod
    def rest_state(self, held_input: FloatArray) -> State:
        """Give the static equilibrium under a constant input, shape (n_inputs,)."""

    @abc.abstractmethod
    def set_state(self, state: State) -> None:
        """Continue from this state with the next ``advance``.

        Raises:
            ValueError: a value is missing or not finite.
        """

    @abc.abstractmethod
    def get_state(self) -> State:
        """Give a copy of the current state."""

    @abc.abstractmethod
    def output(self) -> FloatArray:
        """Give the outputs at the current state in their units, shape (n_outputs,)."""

    @abc.abstractmethod
    def advance(self, inputs: FloatArray) -> FloatArray:
        """Go on by one sample step under ``inputs``, shape (n_inputs,); give the new outputs.

        Raises:
            SimulationError: the motion diverged, or the solver did not converge.
            ValueError: the input has a wrong shape or is not finite.
        """

    @abc.abstractmethod
    def linearize(self, state: State) -> Linearization:
        """Linearize the equations of motion at a state; the current state stays as it is.

        The paper's section on decay times needs this.
        """


class SimulationError(RuntimeError):
    """A reference system could not be simulated."""


class LoadError(ValueError):
    """A reference system could not be made from its name and parameters."""


def simulate(system: System, inputs: FloatArray, initial: State) -> Trajectory:
    """Simulate a system over a whole input record from a given initial state.

    Args:
        inputs: shape (N, n_inputs), in the units of ``system.inputs``.
        initial: the state at sample 0.

    Returns:
        The trajectory: N inputs and N + 1 outputs.

    Raises:
        SimulationError: the solver did not converge.
        ValueError: the inputs have the wrong number of channels.
    """
    if inputs.ndim != 2 or inputs.shape[1] != len(system.inputs):
        names = [signal.name for signal in system.inputs]
        raise ValueError(
            f"inputs of shape {inputs.shape}; expected (samples, {len(names)}) for {names}"
        )
    system.set_state(initial)
    outputs = np.empty((len(inputs) + 1, len(system.outputs)))
    outputs[0] = system.output()
    for k, row in enumerate(inputs):
        outputs[k + 1] = system.advance(row)
    return Trajectory(system.step, inputs, outputs)
