"""What reference systems on an exudyn plant share: their state, and stepping from it."""

from __future__ import annotations

import abc
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization, State, System


class Plant(Protocol):
    """What goes on from a state by one sample step, and is linearized at a state."""

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from a state, shape (n,) each."""

    def coordinates(self) -> FloatArray:
        """Current coordinates, shape (n,)."""

    def velocities(self) -> FloatArray:
        """Current velocities, shape (n,)."""

    def advance(self) -> None:
        """Go on by one sample step; raise SimulationError where that fails."""

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state; the current state stays."""


class Model(Protocol):
    """An exudyn system.

    Attributes:
        plant: steps the system and linearizes it.
    """

    @property
    def plant(self) -> Plant: ...


M = TypeVar("M", bound=Model)


class PlantSystem(System, Generic[M]):
    """A system that exudyn integrates; interface, never instantiated.

    The exudyn system is built on first use and left out when pickled; a copy goes on from the
    same state. Subclasses set ``step``, ``inputs`` and ``outputs``.
    """

    def __init__(self, n_coordinates: int, n_inputs: int) -> None:
        """Start at rest, with no input before.

        Args:
            n_coordinates: number of coordinates q.
            n_inputs: number of inputs.
        """
        self._built: M | None = None
        self._coordinates, self._velocities = np.zeros(n_coordinates), np.zeros(n_coordinates)
        self._last_input = np.zeros(n_inputs)

    @abc.abstractmethod
    def _build(self) -> M:
        """A new exudyn system; its state does not matter."""

    @abc.abstractmethod
    def _apply(self, model: M, inputs: FloatArray) -> None:
        """Let inputs, shape (n_inputs,), act in the next step."""

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_built": None}

    def _model(self) -> M:
        """The exudyn system at the current state."""
        if self._built is None:
            self._built = self._build()
            self._built.plant.set_state(self._coordinates, self._velocities)
        return self._built

    def set_state(self, state: State) -> None:
        """Continue from this state with the next ``advance``.

        Raises:
            ValueError: a value is missing or not finite.
        """
        size = len(self._coordinates)
        self._coordinates = finite_vector("state coordinates", state.coordinates, size)
        self._velocities = finite_vector("state velocities", state.velocities, size)
        last = finite_vector("state last_input", state.last_input, len(self._last_input))
        self._last_input = last
        if self._built is not None:
            self._built.plant.set_state(self._coordinates, self._velocities)

    def get_state(self) -> State:
        """The current state: coordinates, velocities and last input, in SI units."""
        return State(self._coordinates.copy(), self._velocities.copy(), self._last_input.copy())

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Go on by one sample step; gives the new outputs, shape (n_outputs,).

        Raises:
            SimulationError: the motion diverged.
            ValueError: the input has a wrong shape or is not finite.
        """
        values = self._finite_inputs("input", inputs)
        model = self._model()
        self._apply(model, values)
        model.plant.advance()
        self._coordinates = model.plant.coordinates()
        self._velocities = model.plant.velocities()
        self._last_input = values
        return self.output()

    def linearize(self, state: State) -> Linearization:
        """M, D, K and G at a state; the current state stays."""
        return self._model().plant.linearize(state.coordinates, state.velocities)

    def _finite_inputs(self, what: str, inputs: FloatArray) -> FloatArray:
        """A copy of inputs that must be finite, shape (n_inputs,)."""
        names = ", ".join(signal.name for signal in self.inputs)
        return finite_vector(f"{what} {names}", inputs, len(self._last_input))


def finite_vector(name: str, values: FloatArray, size: int) -> FloatArray:
    """A copy of a vector that must hold ``size`` finite numbers.

    Raises:
        ValueError: it does not.
    """
    vector = np.array(values, dtype=np.float64)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise ValueError(
            f"{name} = {vector} of shape {vector.shape}; expected finite numbers, shape ({size},)"
        )
    return vector
