"""A wired system has inputs and outputs that belong to a model of exudyn by their names."""

from __future__ import annotations

import abc
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import exudyn as exu
import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, hold_of
from slide_fmu.systems.base import Linearization, State
from slide_fmu.systems.exudyn.dependent_constraints import require_independent_constraints
from slide_fmu.systems.exudyn.equilibrium import equilibrium
from slide_fmu.systems.exudyn.plant import Integrator, Plant
from slide_fmu.systems.exudyn.plant_system import PlantSystem
from slide_fmu.systems.exudyn.wires import InputTable, OutputTable, Variables, Wires

RESOLVED = 0.5
"""An explicit substep is at most this part of 1 / |v| for the largest eigenvalue |v| in 1/s."""
SUBSTEPS = 2, 20
"""An explicit integrator takes as many substeps per sample step as ``RESOLVED`` asks for, but no
fewer than the first number; it is chosen up to the second one, which implicit ones take."""
MOST_SUBSTEPS = 10_000
"""An explicit integrator that the recipe asks for takes no more, however stiff the model is."""


@dataclass(frozen=True)
class PlantSolver:
    """A solver says how a model is integrated.

    Attributes:
        step: sample step h in s.
        substeps: integration steps per sample step; 0: as of ``SUBSTEPS``.
        integrator: how; ``"auto"``: explicit, unless the model has constraints, coordinates that
            are not of second order, parameters that move within a step, or is stiff
            (``SUBSTEPS``); then generalized-alpha.
        accelerations: whether sensors measure accelerations, or forces that depend on them.
    """

    step: float
    substeps: int
    integrator: Integrator | Literal["auto"]
    accelerations: bool = True


@dataclass(frozen=True, eq=False)
class WiredPlant:
    """A wired plant is a plant with what leads inputs into it and outputs out of it.

    Attributes:
        kept: what the model's build function returned; exudyn keeps no reference to symbolic user
            functions.
    """

    plant: Plant
    wires: Wires
    kept: object


class WiredSystem(PlantSystem[WiredPlant]):
    """A wired system's loads are named as its inputs, its sensors as its outputs.

    It starts at its static equilibrium under the first input. Interface: never instantiated.
    """

    def __init__(
        self,
        n_coordinates: int,
        inputs: tuple[Signal, ...],
        outputs: tuple[Signal, ...],
        solver: PlantSolver,
    ) -> None:
        """Start at rest; wires of the same names belong to the signals."""
        super().__init__(n_coordinates, len(inputs))
        self.step, self.inputs, self.outputs = solver.step, inputs, outputs
        self.solver, self._moving = solver, hold_of(inputs) == "first_order"

    @abc.abstractmethod
    def _fill(self, mbs: Any) -> object:
        """Fill an exudyn system, and return what must live as long as it."""

    def _wires(self) -> tuple[Mapping[str, InputTable], Mapping[str, OutputTable]]:
        """Return what the inputs act on, and what measures the outputs."""
        return (
            {signal.name: InputTable() for signal in self.inputs},
            {signal.name: OutputTable() for signal in self.outputs},
        )

    def _build(self) -> WiredPlant:
        inputs, outputs = self._wires()
        container, mbs, kept = assembled(self._fill)
        wires = Wires(mbs, inputs, outputs, self._moving)
        require_independent_constraints(mbs)
        plant = _plant(container, mbs, self.solver, wires.moves_parameters)
        plant.continuous = False  # forces jump with held inputs, and with rates of moving ones
        if wires.moves_parameters:
            plant.before_substep = wires.move
        return WiredPlant(plant, wires, kept)

    def _apply(self, model: WiredPlant, inputs: FloatArray) -> None:
        if self._moving:
            model.wires.ramp(self._last_input, (inputs - self._last_input) / self.step)
        else:
            model.wires.hold(inputs)

    def output(self) -> FloatArray:
        """Return what the sensors measure, shape (n_outputs,)."""
        model = self._model()
        if not model.plant.visible:
            model.wires.hold(self._last_input)
            model.plant.show()
        return model.wires.read()

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the static equilibrium under a constant input, shape (n_inputs,).

        Raises:
            SimulationError: there is none, or it is not found.
            ValueError: the input is not finite.
        """
        held, model = self._finite_inputs("held input", held_input), self._model()
        model.wires.hold(held)
        coordinates = equilibrium(model.plant)
        return State(coordinates, np.zeros(len(coordinates)), held)

    def linearize(self, state: State) -> Linearization:
        wires = self._model().wires
        kept = wires.motion
        wires.hold(state.last_input)
        try:
            return super().linearize(state)
        finally:
            wires.motion = kept


def assembled(fill: Callable[[Any], object]) -> tuple[Any, Any, object]:
    """Fill a new exudyn system and assemble it.

    Returns:
        Its container, with which it ends; the system, with ``Variables``; and what ``fill`` gave.
    """
    container = exu.SystemContainer()
    mbs: Any = container.AddSystem()
    mbs.variables = Variables(mbs)
    kept = fill(mbs)
    mbs.Assemble()
    return container, mbs, kept


def _plant(container: Any, mbs: Any, solver: PlantSolver, moves_parameters: bool) -> Plant:
    """Make the plant, with an integrator and substeps that are chosen here where they are open."""

    def make(integrator: Integrator, substeps: int) -> Plant:
        return Plant(container, mbs, solver.step, substeps, integrator, solver.accelerations)

    least, most = SUBSTEPS
    data = mbs.systemData
    others = data.AEsize() + data.ODE1Size() + data.DataSize()
    open_to_explicit = solver.integrator == "auto" and others == 0 and not moves_parameters
    if solver.integrator == "explicit" or open_to_explicit:
        resolving = _fastest(make("explicit", least)) * solver.step / RESOLVED
        substeps = solver.substeps or max(least, math.ceil(min(resolving, MOST_SUBSTEPS)))
        if solver.integrator == "explicit" or resolving <= max(most, solver.substeps):
            return make("explicit", substeps)
    implicit = "generalized_alpha" if solver.integrator == "auto" else solver.integrator
    return make(implicit, solver.substeps or most)


def _fastest(plant: Plant) -> float:
    """Return the largest |v| in 1/s of the eigenvalues at the initial configuration."""
    linearization = plant.linearize(plant.coordinates(), plant.velocities())
    size = len(linearization.mass)
    try:
        rates = np.linalg.solve(
            linearization.mass, np.hstack([linearization.stiffness, linearization.damping])
        )
        first_order = np.block([[np.zeros((size, size)), np.eye(size)], [-rates]])
        return float(np.max(np.abs(np.linalg.eigvals(first_order)), initial=0.0))
    except np.linalg.LinAlgError:  # coordinates without mass follow the others at once
        return np.inf
