"""The inside of a reference FMU: any ``System`` behind the FMI 2.0 interface of PythonFMU.

A reference FMU holds a script with one subclass that names the system; see ``reference_fmu``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

import numpy as np
from pythonfmu import Boolean, DefaultExperiment, Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Initial, Fmi2Status, Fmi2Variability

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.python_fmu.writer import child, complete, keep_module_of
from slide_fmu.systems.base import SimulationError, State
from slide_fmu.systems.loading import Parameter, load_system

FROM_STATE = "start_from_state"
"""FMI parameter: start from the ``initial_...`` parameters instead of at rest."""
STEP_TOLERANCE = 1e-6
"""Relative deviation of a communication step that counts as rounding: there are masters whose time
counts nanoseconds. The native runtime allows as much."""


class SystemSlave(Fmi2Slave):  # type: ignore[misc]
    """A reference system as FMI 2.0 co-simulation slave.

    Attributes:
        MODEL: dotted name of the system.
        PARAMETERS: its keyword arguments.
    """

    MODEL: ClassVar[str]
    PARAMETERS: ClassVar[Mapping[str, Parameter]]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        keep_module_of(cls)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        keep_module_of(type(self))
        self.system = load_system(self.MODEL, self.PARAMETERS)
        identity = json.dumps([self.MODEL, dict(self.PARAMETERS)], sort_keys=True)
        self.guid = hashlib.sha256(identity.encode()).hexdigest()[:32]
        self.description = f"Reference system {self.MODEL}, simulated by its own solver"
        self.default_experiment = DefaultExperiment(0.0, 1.0, self.system.step)
        self.input_values = np.array([signal.start_value for signal in self.system.inputs])
        rest = self.system.rest_state(self.input_values)
        self.initial = {
            "coordinates": rest.coordinates.copy(),
            "velocities": rest.velocities.copy(),
        }
        if hold_of(self.system.inputs) == "first_order":
            self.initial["last_input"] = rest.last_input.copy()
        self.from_state = False
        self.started = False
        self._register()

    def _register(self) -> None:
        """Declare the variables: inputs, outputs, then the parameters of the initial state."""
        for index, signal in enumerate(self.system.inputs):
            self._add(
                signal.name, Fmi2Causality.input, signal.description, self.input_values, index
            )
        for index, signal in enumerate(self.system.outputs):
            self.register_variable(
                Real(
                    signal.name,
                    causality=Fmi2Causality.output,
                    variability=Fmi2Variability.continuous,
                    initial=Fmi2Initial.calculated,
                    description=signal.description,
                    getter=lambda index=index: self._outputs()[index],
                ),
                nested=False,
            )
        self.register_variable(
            Boolean(
                FROM_STATE,
                causality=Fmi2Causality.parameter,
                variability=Fmi2Variability.fixed,
                initial=Fmi2Initial.exact,
                description="start from the initial_ parameters instead of at rest",
                getter=lambda: self.from_state,
                setter=lambda value: setattr(self, "from_state", value),
            ),
            nested=False,
        )
        for part, values in self.initial.items():
            for index in range(len(values)):
                name = f"initial_{part}[{index}]"
                self._add(name, Fmi2Causality.parameter, "SI units", values, index)

    def _add(
        self, name: str, causality: Fmi2Causality, text: str, values: FloatArray, index: int
    ) -> None:
        """Declare a real variable that is stored in ``values[index]``."""
        is_input = causality == Fmi2Causality.input
        variable = Real(
            name,
            causality=causality,
            variability=Fmi2Variability.continuous if is_input else Fmi2Variability.fixed,
            initial=None if is_input else Fmi2Initial.exact,
            description=text,
            getter=lambda: values[index],
            setter=lambda value: values.__setitem__(index, value),
        )
        self.register_variable(variable, nested=False)

    def exit_initialization_mode(self) -> None:
        """Put the system into its initial state."""
        self._start()
        self.started = True

    def _start(self) -> None:
        """Initial state: as given, or the static equilibrium under the present inputs."""
        if self.from_state:
            last_input = self.initial.get("last_input", self.input_values)
            coordinates, velocities = self.initial["coordinates"], self.initial["velocities"]
            self.system.set_state(State(coordinates, velocities, last_input))
        else:
            self.system.set_state(self.system.rest_state(self.input_values))

    def _outputs(self) -> FloatArray:
        """Outputs at the current state, before the first step at the initial state."""
        if not self.started:
            self._start()
        return self.system.output()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance by the sample step h; anything else is refused with a logged message."""
        step = self.system.step
        if abs(step_size - step) > STEP_TOLERANCE * step:
            return self._refuse(
                f"communication step {step_size} s; expected the sample step {step} s: set the "
                "master's step size to it"
            )
        try:
            self.system.advance(self.input_values)
        except (SimulationError, ValueError) as error:
            return self._refuse(f"step from {current_time} s: {error}")
        return True

    def _refuse(self, message: str) -> bool:
        self.log(f"{self.MODEL}: {message}", Fmi2Status.error)
        return False

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Model description with what PythonFMU leaves out: units, ranges, initial unknowns."""
        root: Element = super().to_xml(dict(model_options or {}))
        slave = child(root, "CoSimulation")
        slave.set("canHandleVariableCommunicationStepSize", "false")
        complete(root, (*self.system.inputs, *self.system.outputs))
        return root
