"""Reference systems on an exudyn plant share their state, and how they step from it."""

from __future__ import annotations

import abc
from typing import Generic, Protocol, TypeVar

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization, Restorable, State, finite_vector


class SteppedPlant(Protocol):
    """A stepped plant goes from sample to sample, as ``slide_fmu.systems.exudyn.plant.Plant``."""

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None: ...

    def coordinates(self) -> FloatArray: ...

    def velocities(self) -> FloatArray: ...

    def advance(self) -> None: ...

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization: ...


class Model(Protocol):
    """A model is an exudyn system with a plant that steps and linearizes it."""

    @property
    def plant(self) -> SteppedPlant: ...


M = TypeVar("M", bound=Model)


class PlantSystem(Restorable, Generic[M]):
    """A plant system is a system that exudyn integrates. Interface: never instantiated.

    States are in SI units. The exudyn system is built on first use and left out when pickled; a
    copy goes on from the same state. Subclasses set ``step``, ``inputs`` and ``outputs``; those
    that inherit ``Linearizable`` too offer ``linearize``.
    """

    def __init__(self, n_coordinates: int, n_inputs: int) -> None:
        """Start at rest, with no input before, for numbers of coordinates q and of inputs."""
        self._built: M | None = None
        self._coordinates, self._velocities = np.zeros(n_coordinates), np.zeros(n_coordinates)
        self._last_input = np.zeros(n_inputs)

    @abc.abstractmethod
    def _build(self) -> M:
        """Build a new exudyn system; its state does not matter."""

    @abc.abstractmethod
    def _apply(self, model: M, inputs: FloatArray) -> None:
        """Let inputs in their units, shape (n_inputs,), act in the next step."""

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_built": None}

    def _model(self) -> M:
        """Return the exudyn system at the current state; it is built on first use."""
        if self._built is None:
            self._built = self._build()
            self._built.plant.set_state(self._coordinates, self._velocities)
        return self._built

    def set_state(self, state: State) -> None:
        size = len(self._coordinates)
        self._coordinates = finite_vector("state coordinates", state.coordinates, size)
        self._velocities = finite_vector("state velocities", state.velocities, size)
        last = finite_vector("state last_input", state.last_input, len(self._last_input))
        self._last_input = last
        if self._built is not None:
            self._built.plant.set_state(self._coordinates, self._velocities)

    def get_state(self) -> State:
        return State(self._coordinates.copy(), self._velocities.copy(), self._last_input.copy())

    def advance(self, inputs: FloatArray) -> FloatArray:
        values = self._finite_inputs("input", inputs)
        model = self._model()
        self._apply(model, values)
        model.plant.advance()
        self._coordinates = model.plant.coordinates()
        self._velocities = model.plant.velocities()
        self._last_input = values
        return self.output()

    def linearize(self, state: State) -> Linearization:
        return self._model().plant.linearize(state.coordinates, state.velocities)

    def _finite_inputs(self, label: str, inputs: FloatArray) -> FloatArray:
        """Return a copy of inputs, shape (n_inputs,), which must be finite."""
        names = ", ".join(signal.name for signal in self.inputs)
        return finite_vector(f"{label} {names}", inputs, len(self._last_input))
