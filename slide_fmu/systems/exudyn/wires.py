"""Inputs and outputs of a system are those of its exudyn model by their names.

An input acts on the load of its name, or on a parameter of an item, or user functions read it from
``mbs.variables``; an output is what the sensor of its name measures.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError

RATE = "_rate"
"""The rate of an input stands in ``mbs.variables`` under its name with this behind."""
Motion = dict[str, tuple[float, float]]
"""Of every input and every rate by its name: the value at the step's start and its rate per s."""


class Variables(dict[str, Any]):
    """These ``mbs.variables`` know the inputs: whenever a user function asks, the value of then.

    Attributes:
        motion: how the inputs move in this step.
        asked: names of inputs that were read.
    """

    def __init__(self, mbs: Any) -> None:
        super().__init__()
        self.motion: Motion = {}
        self.asked: set[str] = set()
        self._data = mbs.systemData

    def __getitem__(self, name: str) -> Any:
        if name not in self.motion:
            return super().__getitem__(name)
        self.asked.add(name.removesuffix(RATE))
        start, rate = self.motion[name]
        return start + rate * self._data.GetTime() if rate else start


class InputTable(SignalTable):
    """This table says what an input acts on too: else on the load of its name, or a variable.

    Attributes:
        parameter: ``"ITEM.PARAMETER"`` of an exudyn object that has the input's value.
        rate_parameter: the same for the input's rate per s.
    """

    parameter: str | None = None
    rate_parameter: str | None = None


class OutputTable(SignalTable):
    """This table says what measures an output too.

    Attributes:
        sensor: name of the sensor in exudyn, ``"NAME"`` or ``"NAME[COMPONENT]"`` with a component
            of its vector, from 0; the name of the output if None.
    """

    sensor: str | None = None


class Wires:
    """Wires lead the inputs into an assembled exudyn model, and the outputs out of it.

    Attributes:
        acts: of every input by its name, what it acts on: "load", "parameter" or "variables".
    """

    def __init__(
        self,
        mbs: Any,
        inputs: Mapping[str, InputTable],
        outputs: Mapping[str, OutputTable],
        moving: bool,
    ) -> None:
        """Find loads, parameters and sensors; inputs are 0 until ``apply``.

        Args:
            mbs: the model, with ``Variables`` as its variables.
            inputs, outputs: by name, in the order of the system's signals.
            moving: whether inputs move linearly within a step (first-order hold).

        Raises:
            LoadError: the model has no such item or sensor; the message lists what there is.
        """
        self._mbs, self._inputs, self._moving = mbs, list(inputs), moving
        self._variables: Variables = mbs.variables
        self._setters: list[tuple[str, Callable[[float], None]]] = []
        self.acts = {name: self._connect(name, table) for name, table in inputs.items()}
        self._still: Motion = {name + RATE: (0.0, 0.0) for name in inputs}
        self.hold(np.zeros(len(inputs)))
        self._sensors = [self._sensor(name, table) for name, table in outputs.items()]

    @property
    def moves_parameters(self) -> bool:
        """Tell whether items' parameters change within a step, which explicit integrators miss."""
        return self._moving and "parameter" in self.acts.values()

    @property
    def motion(self) -> Motion:
        """Tell how the inputs move in this step; set it to go back to another step's."""
        return self._variables.motion

    @motion.setter
    def motion(self, motion: Motion) -> None:
        self._variables.motion = motion
        self.move(float(self._mbs.systemData.GetTime()))

    def hold(self, values: FloatArray) -> None:
        """Let inputs, shape (n_inputs,), act without change."""
        motion = dict(self._still)
        for name, value in zip(self._inputs, values.tolist(), strict=True):
            motion[name] = value, 0.0
        self._variables.motion = motion
        self.move(0.0)

    def ramp(self, values: FloatArray, rates: FloatArray) -> None:
        """Let inputs, (n_inputs,), begin the next step, moving with rates per s, (n_inputs,)."""
        motion: Motion = {}
        for name, value, rate in zip(self._inputs, values.tolist(), rates.tolist(), strict=True):
            motion[name], motion[name + RATE] = (value, rate), (rate, 0.0)
        self._variables.motion = motion
        self.move(0.0)

    def move(self, time: float) -> None:
        """Set what inputs act on to their values at a time in s within the step."""
        for name, set_to in self._setters:
            start, rate = self._variables.motion[name]
            set_to(start + rate * time)

    def read(self) -> FloatArray:
        """Return what the sensors measure, shape (n_outputs,), perhaps not finite."""
        return np.array([sensor() for sensor in self._sensors], dtype=np.float64)

    def require_readers(self) -> None:
        """Refuse inputs that act on nothing, after forces and outputs were evaluated once.

        Raises:
            LoadError: there is such an input; the message says what an input can act on.
        """
        for name in self.unread():
            raise LoadError(
                f"input {name!r} acts on nothing: there is no load of that name (loads: "
                f"{sorted(self._loads())}), its declaration names no parameter, and no user "
                f"function reads mbs.variables[{name!r}]; expected one of these: name a load "
                f"{name!r} in build, or let a user function read it"
            )

    def unread(self) -> list[str]:
        """Return the names of variables that no user function has asked for yet."""
        asked = self._variables.asked
        return [n for n, acts in self.acts.items() if acts == "variables" and n not in asked]

    def _connect(self, name: str, table: InputTable) -> str:
        """Lead an input to what it acts on, and say what that is."""
        for moved, parameter in ((name, table.parameter), (name + RATE, table.rate_parameter)):
            if parameter is not None:
                self._setters.append((moved, self._parameter(name, parameter)))
        number = self._loads().get(name)
        if number is not None:
            self._connect_load(name, number)
            return "load"
        return "variables" if table.parameter is table.rate_parameter is None else "parameter"

    def _connect_load(self, name: str, number: Any) -> None:
        """Let an input be a load's value, or the magnitude of its vector."""
        mbs, load = self._mbs, self._mbs.GetLoad(number)
        vector = "loadVector" in load
        function = "loadVectorUserFunction" if vector else "loadUserFunction"
        if load[function]:
            raise LoadError(
                f"input {name!r}: the load of that name has a user function; expected none, since "
                f"the load is the input: name the load otherwise and read mbs.variables[{name!r}]"
            )
        direction = _direction(name, load["loadVector"]) if vector else None

        def value(size: float) -> Any:
            return size if direction is None else [size * part for part in direction]

        if not self._moving:
            key = "loadVector" if vector else "load"
            setter = lambda size: mbs.SetLoadParameter(number, key, value(size))  # noqa: E731
            self._setters.append((name, setter))
            return

        def force(mbs: Any, time: float, load: Any) -> Any:
            start, rate = self._variables.motion[name]
            return value(start + rate * time)

        mbs.SetLoadParameter(number, function, force)

    def _loads(self) -> dict[str, int]:
        mbs = self._mbs
        return {mbs.GetLoad(i)["name"]: i for i in range(mbs.systemData.NumberOfLoads())}

    def _parameter(self, name: str, path: str) -> Callable[[float], None]:
        """Find ``"ITEM.PARAMETER"`` of an object, and return what sets it."""
        mbs, (item, _, parameter) = self._mbs, path.rpartition(".")
        count = mbs.systemData.NumberOfObjects()
        objects = {mbs.GetObject(i)["name"]: i for i in range(count)}
        values = mbs.GetObject(objects[item]) if item in objects else {}
        if parameter not in values:
            what = f"parameters {sorted(values)}" if values else f"objects {sorted(objects)}"
            raise LoadError(
                f"input {name!r}: parameter {path!r} is not there; expected 'OBJECT.PARAMETER' "
                f"with one of the {what}"
            )
        return lambda value: mbs.SetObjectParameter(objects[item], parameter, value)

    def _sensor(self, output: str, table: OutputTable) -> Callable[[], Any]:
        """Find the sensor of an output, and return what reads it."""
        mbs, sensor = self._mbs, table.sensor or output
        indexed = re.fullmatch(r"(.*)\[(\d+)\]", sensor)
        name, component = (indexed[1], int(indexed[2])) if indexed else (sensor, None)
        count = mbs.systemData.NumberOfSensors()
        sensors = {mbs.GetSensor(i)["name"]: i for i in range(count)}
        if name not in sensors:
            raise LoadError(
                f"output {output!r}: the model has no sensor {name!r}; expected one of "
                f"{sorted(sensors)}: name a sensor so in build, or give the output's sensor"
            )
        number = sensors[name]
        value = mbs.GetSensorValues(number)
        size = np.size(value)
        if size > 1 if component is None else component >= size:
            raise LoadError(
                f"output {output!r}: sensor {name!r} measures {size} values; expected "
                f'the number of one, from 0: write sensor = "{name}[0]"'
            )
        if np.ndim(value) == 0:
            return lambda: mbs.GetSensorValues(number)
        return lambda: mbs.GetSensorValues(number)[component or 0]


def _direction(name: str, vector: Any) -> list[float]:
    """Return the direction of a load's vector."""
    length = float(np.linalg.norm(vector))
    if not length > 0:
        raise LoadError(
            f"input {name!r}: the vector of the load of that name is {shown(list(vector))}; "
            "expected the direction in which the input acts: give loadVector"
        )
    return [float(part) / length for part in vector]
