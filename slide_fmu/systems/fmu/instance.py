"""An instance of an FMU, of either standard and interface, has calls of one name."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import chdir
from ctypes import c_double, c_float
from pathlib import Path
from typing import Any, final

import fmpy
import numpy as np
from fmpy import fmi2, fmi3
from fmpy.simulation import (
    apply_start_values,
    settable_in_initialization_mode,
    settable_in_instantiated,
)

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.declared import Parameter
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.fmu.file import FmuFile, unpacked

_CLASSES = {
    ("co_simulation", False): fmi2.FMU2Slave,
    ("co_simulation", True): fmi3.FMU3Slave,
    ("model_exchange", False): fmi2.FMU2Model,
    ("model_exchange", True): fmi3.FMU3Model,
}


@final
class Instance:
    """An Instance is an FMU in memory, before or after its initialization.

    A call that fails raises fmpy's ``FMICallException``.

    Attributes:
        calls: fmpy's object with the calls of the standard.
        messages: what the FMU logged as warning or worse.

    Raises:
        LoadError: its library cannot be loaded, or it refuses to be instantiated.
    """

    def __init__(
        self,
        file: FmuFile,
        inputs: Sequence[Signal],
        outputs: Sequence[Signal],
        parameters: Mapping[str, Parameter],
    ) -> None:
        self.messages: list[str] = []
        self._file, self._parameters = file, parameters
        self.calls = self._instantiate(file)
        variables = {v.name: v for v in file.description.modelVariables}
        self.free = weakref.finalize(self, self.calls.freeInstance)
        """Frees the instance, which is not used afterwards; it does so by itself at the end."""
        self.free.atexit = False  # an FMU in Python cannot end after Python
        self._references = [variables[signal.name].valueReference for signal in inputs]
        self._inputs = _blocks(self.calls, [variables[signal.name] for signal in inputs])
        self._outputs = _blocks(self.calls, [variables[signal.name] for signal in outputs])
        self._count = len(outputs)

    def _instantiate(self, file: FmuFile) -> Any:
        description, folder = file.description, unpacked(file)
        arguments = {
            "guid": description.guid or description.instantiationToken,
            "unzipDirectory": folder,
            "modelIdentifier": file.type.modelIdentifier,
            "instanceName": description.modelName or file.path.stem,
        }
        try:
            with chdir(Path.cwd()):  # fmpy stays in its folder when loading fails
                calls = _CLASSES[file.interface, file.fmi_3](**arguments)
                if file.fmi_3:
                    calls.instantiate(logMessage=logger(self.messages))
                else:
                    calls.instantiate(callbacks=callbacks_of_fmi2(self.messages))
        except Exception as error:  # fmpy raises bare Exception
            messages = "; ".join([str(error), *self.messages])
            needs = (
                "; it needs the tool that made it: install that, and its licence"
                if file.type.needsExecutionTool
                else ""
            )
            raise LoadError(
                f"FMU {file.path.name!r} cannot be instantiated: {messages}{needs}"
            ) from error
        return calls

    def initialize(self, inputs: FloatArray) -> None:
        """Initialize the instance at time 0 under inputs that have always acted, (n_inputs,)."""
        calls, tolerance = self.calls, self._file.options.tolerance
        if not self._file.fmi_3:
            calls.setupExperiment(tolerance=tolerance, startTime=0.0)
        left = self._start(dict(self._parameters), settable_in_instantiated)
        self.set_inputs(inputs)
        if self._file.fmi_3:
            calls.enterInitializationMode(tolerance=tolerance, startTime=0.0)
        else:
            calls.enterInitializationMode()
        self._start(left, settable_in_initialization_mode)
        self.set_inputs(inputs)
        calls.exitInitializationMode()

    def _start(self, values: dict[str, Parameter], settable: Any) -> dict[str, Parameter]:
        """Set the parameters that can be set now; give the others."""
        left: dict[str, Parameter] = apply_start_values(
            self.calls, self._file.description, values, settable
        )
        return left

    def set_inputs(self, values: Sequence[float] | FloatArray) -> None:
        """Set the inputs, one value for each, in their units."""
        for block in self._inputs:
            block.set(values)

    def set_slopes(self, values: FloatArray) -> None:
        """Set the first derivatives of the inputs of a slave of FMI 2.0, in their units per s."""
        orders = [1] * len(self._references)
        self.calls.setRealInputDerivatives(self._references, orders, values)

    def outputs(self) -> FloatArray:
        """Give the outputs in their units, shape (n_outputs,)."""
        values = np.empty(self._count)
        for block in self._outputs:
            values[block.columns] = block.get()
        return values


class _Block:
    """A block has the real variables of one type, which are set and got together.

    Its arrays are made once: inputs are set several times in every step of a solver.
    """

    def __init__(self, calls: Any, type_: str, columns: list[int], references: list[int]) -> None:
        self.columns = columns
        count, standard = len(columns), "fmi2" if type_ == "Real" else "fmi3"
        numbers = (fmi2.fmi2ValueReference * count)(*(references[i] for i in columns))
        self._values = ((c_float if type_ == "Float32" else c_double) * count)()
        lengths = () if type_ == "Real" else (count,)
        self._arguments = (calls.component, numbers, count, self._values, *lengths)
        self._set = getattr(calls, f"{standard}Set{type_}")
        self._get = getattr(calls, f"{standard}Get{type_}")

    def set(self, values: Sequence[float] | FloatArray) -> None:
        self._values[:] = [values[column] for column in self.columns]
        self._set(*self._arguments)

    def get(self) -> list[float]:
        self._get(*self._arguments)
        return list(self._values)


def _blocks(calls: Any, variables: Sequence[Any]) -> list[_Block]:
    """Return the blocks of variables, one for each type among them."""
    types = [variable.type for variable in variables]
    references = [variable.valueReference for variable in variables]
    return [
        _Block(calls, kind, [i for i, type_ in enumerate(types) if type_ == kind], references)
        for kind in dict.fromkeys(types)
    ]


def logger(messages: list[str]) -> Callable[..., None]:
    """Make a callback, of either standard, that keeps what the FMU logs as warning or worse."""

    def log(*arguments: Any) -> None:
        *caller, status, _category, message = arguments
        if status > fmi2.fmi2OK and message:
            text = message.decode("utf-8", "replace")
            messages.append(text.replace("%%", "%") if len(caller) == 2 else text)

    return log


def callbacks_of_fmi2(messages: list[str]) -> Any:
    """Make callbacks of FMI 2.0 that keep what the FMU logs.

    fmpy's own proxy for printf-like messages is left alone: it serves one logger per process, and
    would outlive this one. Messages without arguments need it only for their doubled signs.
    """
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(logger(messages))
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return callbacks
