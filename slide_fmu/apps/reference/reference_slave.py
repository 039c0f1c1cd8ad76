"""Reference systems become FMUs: any ``System`` behind the FMI 2.0 interface of PythonFMU.

They run side by side with their surrogates in any importer.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pythonfmu import Boolean, Real
from pythonfmu.enums import Fmi2Status

from slide_fmu.apps.reference.slave import Slave, stored, whole_steps
from slide_fmu.apps.reference.writer import write_python_fmu
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.search_path import AmbiguousFileError, find_file
from slide_fmu.core.signals import FloatArray, Signal, hold_of
from slide_fmu.fmu.description.variables import AT_STEP_END
from slide_fmu.systems.base import Restorable, State, Stepping
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification

_SCRIPT = '''"""Reference FMU: names its system, which the Python environment must offer."""

from slide_fmu.apps.reference import reference_slave


class {class_name}(reference_slave.SystemSlave):
    SPECIFICATION = {specification!r}
    PARAMETERS = {parameters!r}
    MODEL_FILE = {model_file!r}
'''

FROM_STATE = "start_from_state"
"""FMI parameter: start from the ``initial_...`` parameters instead of at rest."""


def write_reference_fmu(
    specification: Specification, path: Path, parameters: Sequence[Parameter] = ()
) -> Path:
    """Write a system as FMI 2.0 co-simulation FMU that runs in a Python environment.

    The FMU contains only a small script; slide_fmu and the system's package are imported from the
    environment of the importer. A model in a file is found where it is now, else by its name near
    the importer, and must be unchanged. The FMU starts at the system's own start under its first
    inputs. If the system's states can be set, the parameter ``start_from_state`` makes it start
    from ``initial_coordinates[i]`` and ``initial_velocities[i]`` (and ``initial_last_input[i]``
    for inputs with a first-order hold).

    Args:
        specification: the specification of the system.
        path: file to write, ending in ``.fmu``.
        parameters: parameters of the model that importers may set until the initialization ends.

    Returns:
        The path written.

    Raises:
        LoadError: the system cannot be made, or does not advance step by step.
        ValueError: the path does not end in ``.fmu``.
    """
    _stepping(specification)
    name = re.sub(r"\W", "_", re.split(r"[:/\\]", specification.model)[-1]) + "Reference"
    tables = tuple(asdict(parameter) for parameter in parameters)
    script = _SCRIPT.format(
        class_name=name,
        specification=specification.to_json(),
        parameters=tables,
        model_file=_model_file(specification),
    )
    return write_python_fmu(name, script, Path(path))


def _model_file(specification: Specification) -> tuple[str, str] | None:
    """Return path and hash of the file of a model; None of a model in a module."""
    name = specification.model.partition(":")[0]
    if not name.endswith(".py"):
        return None
    path = find_file(name)
    return str(path), _hash_of(path)


def _hash_of(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _located(specification: Specification, model_file: tuple[str, str] | None) -> Specification:
    """Return a specification that names the file of the model by its path.

    Raises:
        LoadError: there is no such file, or it has changed.
    """
    if model_file is None:
        return specification
    name, colon, wanted = specification.model.partition(":")
    path, hashed = Path(model_file[0]), model_file[1]
    try:
        file = path if path.is_file() else find_file(name)
    except (AmbiguousFileError, FileNotFoundError) as error:
        raise LoadError(
            f"there is no file {str(path)!r}, and none near here ({error}); expected the model "
            "from which this FMU was made: put it back, or write the FMU again by slide-fmu "
            "reference"
        ) from error
    if _hash_of(file) != hashed:
        raise LoadError(
            f"model {str(file)!r} has changed since this FMU was made from it; expected the same "
            "file: write the FMU again by slide-fmu reference"
        )
    return replace(specification, model=f"{file}{colon}{wanted}")


def _stepping(specification: Specification) -> Stepping:
    """Make a system that can be co-simulated."""
    system = load_system(specification)
    if not isinstance(system, Stepping):
        raise LoadError(
            f"system {specification.model!r} is simulated as a whole; expected one that goes on "
            "step by step (slide_fmu.systems.base.Stepping): it cannot be an FMU itself"
        )
    return system


class SystemSlave(Slave):
    """A SystemSlave is a reference system as an FMI 2.0 slave. Final but for its name."""

    CAPABILITIES = {"canHandleVariableCommunicationStepSize": "false"}  # noqa: RUF012 (constant)
    SPECIFICATION: ClassVar[str]
    PARAMETERS: ClassVar[tuple[dict[str, Any], ...]] = ()
    MODEL_FILE: ClassVar[tuple[str, str] | None] = None

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        given = Specification.from_json(self.SPECIFICATION)
        try:
            self.specification = _located(given, self.MODEL_FILE)
            self.system = _stepping(self.specification)
        except LoadError as error:  # importers show no reason of an instance that fails
            print(f"reference FMU of {given.model!r}: {error}", file=sys.stderr, flush=True)
            raise
        self.parameters = [Parameter(**table) for table in self.PARAMETERS]
        self.values = {parameter.name: parameter.start_value for parameter in self.parameters}
        self.model = given.model
        text = f"Reference system {self.model}, simulated by its own solver"
        identity = self.SPECIFICATION + (repr(self.PARAMETERS) if self.PARAMETERS else "")
        self.introduce(identity.encode(), text, self.system.step, stop=1.0)
        self.input_values = np.array([signal.start_value for signal in self.system.inputs])
        self.initial = self._initial_state()
        if isinstance(self.system, Restorable):
            self.capabilities = {"canGetAndSetFMUstate": "true"}
        self.from_state = False
        self.started = False
        self._register()

    def _initial_state(self) -> dict[str, FloatArray]:
        """Return the parts of the state that an importer may set; empty without states."""
        if not isinstance(self.system, Restorable):
            return {}
        rest = self.system.rest_state(self.input_values)
        parts = {"coordinates": rest.coordinates.copy(), "velocities": rest.velocities.copy()}
        if hold_of(self.system.inputs) == "first_order":
            parts["last_input"] = rest.last_input.copy()
        return parts

    def _register(self) -> None:
        """Declare inputs, outputs, and parameters of the initial state and of the model."""
        for index, signal in enumerate(self.system.inputs):
            access = stored(self.input_values, index)
            self.add(
                Real, signal.name, "input", "continuous", description=signal.description, **access
            )
        for index, signal in enumerate(self.system.outputs):
            text, getter = signal.description, lambda index=index: self._outputs()[index]
            self.add(Real, signal.name, "output", "continuous", description=text, getter=getter)
        if self.initial:
            text = "start from the initial_ parameters instead of at rest"
            access = stored(vars(self), "from_state")
            self.add(Boolean, FROM_STATE, "parameter", "fixed", description=text, **access)
        for part, values in self.initial.items():
            for index in range(len(values)):
                name, access = f"initial_{part}[{index}]", stored(values, index)
                self.add(Real, name, "parameter", "fixed", description="SI units", **access)
        for parameter in self.parameters:
            text, access = parameter.description, stored(self.values, parameter.name)
            self.add(Real, parameter.name, "parameter", "fixed", description=text, **access)
        if hold_of(self.system.inputs) == "first_order":
            text = "inputs move to the values that are set before a step, by its end"
            self.add(Real, AT_STEP_END, "local", "constant", description=text, getter=lambda: 1.0)

    def exit_initialization_mode(self) -> None:
        """Put the system into its initial state."""
        self._start()
        self.started = True

    def _start(self) -> None:
        """Set the initial state: the given one, or the static equilibrium under the inputs.

        The system is made again if importers have set other parameters.
        """
        parameters = {**self.specification.parameters, **self.values}
        if parameters != self.specification.parameters:
            self.specification = replace(self.specification, parameters=parameters)
            self.system = _stepping(self.specification)
        if self.from_state and isinstance(self.system, Restorable):
            last_input = self.initial.get("last_input", self.input_values)
            coordinates, velocities = self.initial["coordinates"], self.initial["velocities"]
            self.system.set_state(State(coordinates, velocities, last_input))
        else:
            self.system.begin(self.input_values)

    def _outputs(self) -> FloatArray:
        """Return the outputs at the current state; before the first step, at the initial state."""
        if not self.started:
            self._start()
        return self.system.output()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance by the sample step h; any other step is rejected with a logged message."""
        step = self.system.step
        if whole_steps(step_size, step) != 1:
            return self._refuse(
                f"communication step {step_size} s; expected the sample step {step} s: set the "
                "importer's step size to it"
            )
        try:
            self.system.advance(self.input_values)
        except (SimulationError, ValueError) as error:
            return self._refuse(f"step from {current_time} s: {error}")
        return True

    def _get_fmu_state(self) -> dict[str, Any]:
        """Return what an importer needs to go back to the present state."""
        assert isinstance(self.system, Restorable)  # others do not offer it
        state = self.system.get_state() if self.started else None
        return {"state": state, "inputs": self.input_values.copy()}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        """Go back to a state of this instance, which is not changed by that."""
        assert isinstance(self.system, Restorable)
        self.input_values[:] = state["inputs"]
        if state["state"] is not None:
            self.system.set_state(state["state"])
        self.started = state["state"] is not None

    def _refuse(self, message: str) -> bool:
        self.log(f"{self.model}: {message}", Fmi2Status.error)
        return False

    def described(self) -> Sequence[Signal | Parameter]:
        """Return inputs and outputs of the system, and its parameters."""
        return (*self.system.inputs, *self.system.outputs, *self.parameters)
