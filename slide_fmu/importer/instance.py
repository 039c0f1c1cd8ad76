"""An instance of an FMU, of either standard and interface, has calls of one name."""

from __future__ import annotations

import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager
from ctypes import byref, c_bool, c_double
from pathlib import Path
from typing import Any, final

import fmpy
from fmpy import fmi2, fmi3
from fmpy.simulation import (
    apply_start_values,
    settable_in_initialization_mode,
    settable_in_instantiated,
)

from slide_fmu.importer.calls import FailedCallError, GuardedCalls, Witness
from slide_fmu.importer.description import experiment, is_fmi_3, start_time
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.importer.file import UnpackedFmu
from slide_fmu.importer.logger_callbacks import callbacks_of_fmi2, last_texts, logger
from slide_fmu.importer.variables import InstanceVariables

_CLASSES = {
    ("co_simulation", False): fmi2.FMU2Slave,
    ("co_simulation", True): fmi3.FMU3Slave,
    ("model_exchange", False): fmi2.FMU2Model,
    ("model_exchange", True): fmi3.FMU3Model,
}


@final
class Instance:
    """An Instance is an FMU in memory, before or after its initialization.

    A call that fails raises a ``CoSimulationError`` with the label, the call and what the FMU
    logged. After a fatal error no call is allowed any more (FMI 2.0.5, section 2.1.3): none is
    made. Times are in s.

    Attributes:
        fmu: the FMU.
        label: begins messages.
        calls: fmpy's object, which has all calls of its standard.
        messages: what the FMU logged as warning or worse.
        begin: the time in s at which it begins, in its default experiment.

    Args:
        fmu: the unpacked FMU.
        label: ``"FILE.fmu"`` by default.
        name: of the instance, for the FMU; that of the model by default.

    Raises:
        CoSimulationError: its library cannot be loaded, or it refuses to be instantiated.
    """

    def __init__(
        self, fmu: UnpackedFmu, label: str | None = None, name: str | None = None
    ) -> None:
        self.fmu, self.label = fmu, label or fmu.path.name
        self.fmi_3 = is_fmi_3(fmu.description)
        self.begin = start_time(fmu.description)
        self.messages: list[str] = []
        _withdraw_other(fmu)
        self.calls = self._instantiate(name or fmu.description.modelName or fmu.path.stem)
        self._call = GuardedCalls(self.label, self.calls._functions, self.messages)
        self.calls._call = self._call  # all calls of fmpy pass through this one
        self.free = weakref.finalize(self, _free, self.calls, self._call)
        """Frees the instance, which is not used afterwards; it does so by itself at the end."""
        self.free.atexit = False  # an FMU in Python cannot end after Python
        self._unset: dict[str, Any] = {}
        self._start = self.begin
        self._tolerance: float | None = None
        self._stop: float | None = None
        self._reached = c_double()
        self._flags = c_bool(), c_bool(), c_bool()
        if _is_only_one(fmu):
            _ONLY_ONES[_identity(fmu)] = self

    def _instantiate(self, name: str) -> Any:
        fmu = self.fmu
        arguments = {
            "guid": fmu.description.guid or fmu.description.instantiationToken,
            "unzipDirectory": fmu.folder,
            "modelIdentifier": fmu.offer.modelIdentifier,
            "instanceName": name,
        }
        try:
            with chdir(Path.cwd()):  # fmpy stays in its folder when loading fails
                calls = _CLASSES[fmu.interface, self.fmi_3](**arguments)
                if self.fmi_3:
                    calls.instantiate(logMessage=logger(self.messages))
                else:
                    calls.instantiate(callbacks=callbacks_of_fmi2(self.messages))
        except Exception as error:  # fmpy raises bare Exception
            reason = str(error).rstrip(".")
            if self.messages:
                reason = f"{reason}; {last_texts(self.messages)}"
            remedy = (
                "it needs the tool that made it, which may tell more on the terminal: install "
                "that tool, and its licence"
                if fmu.offer.needsExecutionTool
                else "run this FMU alone, since it may tell more on the terminal"
            )
            raise CoSimulationError(
                f"{self.label} cannot be instantiated: {reason}; expected a library for this "
                f"platform ({fmpy.platform}) that makes an instance: {remedy}"
            ) from error
        return calls

    @property
    def usable(self) -> bool:
        """Tell whether it is in memory, and neither lost nor withdrawn."""
        return self.free.alive and not self._call.lost and not self._call.withdrawn

    @property
    def can_go_back(self) -> bool:
        """Tell whether the FMU says that its state can be saved and restored."""
        return bool(getattr(self.fmu.offer, "canGetAndSetFMUstate", False))

    def tell(self, witness: Witness) -> None:
        """Tell a witness of every further call."""
        self._call.witness = witness

    def set_up(
        self,
        values: Mapping[str, Any],
        start: float | None = None,
        tolerance: float | None = None,
        stop: float | None = None,
    ) -> None:
        """Set start values before the initialization.

        Args:
            values: of parameters and inputs by name.
            start: start time; that of the FMU by default.
            tolerance: relative tolerance of its solver; its own by default.
            stop: time at which the experiment ends, beyond which an FMU must not go; not defined
                by default, so that it may go on for ever.
        """
        self._start = self.begin if start is None else start
        self._tolerance, self._stop = tolerance, stop
        if not self.fmi_3:
            self.calls.setupExperiment(tolerance=tolerance, startTime=self._start, stopTime=stop)
        self._unset = self._apply(dict(values), settable_in_instantiated)

    def enter_initialization(self) -> None:
        """Enter initialization mode, and set the start values that are set there.

        Raises:
            ValueError: there are some that cannot be set at all.
        """
        if self.fmi_3:
            self.calls.enterInitializationMode(
                tolerance=self._tolerance, startTime=self._start, stopTime=self._stop
            )
        else:
            self.calls.enterInitializationMode()
        left = self._apply(self._unset, settable_in_initialization_mode)
        if left:
            raise ValueError(
                f"{self.label}: {sorted(left)} cannot be set before the start; expected "
                "parameters or inputs"
            )

    def _apply(self, values: dict[str, Any], settable: Any) -> dict[str, Any]:
        """Set the values that can be set now; give the others."""
        if not values:
            return values
        left: dict[str, Any] = apply_start_values(
            self.calls, self.fmu.description, values, settable
        )
        return left

    def initialize(
        self,
        values: Mapping[str, Any],
        inputs: InstanceVariables,
        first: Sequence[float],
        start: float | None = None,
        tolerance: float | None = None,
        stop: float | None = None,
    ) -> None:
        """Initialize the instance under the first inputs; ``values`` and so on are of ``set_up``.

        The inputs are set before initialization mode, where FMUs may use them as start values, and
        in it.
        """
        self.set_up(values, start, tolerance, stop)
        inputs.set(first)
        self.enter_initialization()
        inputs.set(first)
        self.exit_initialization()

    def exit_initialization(self) -> None:
        """Leave initialization mode; steps follow."""
        self.calls.exitInitializationMode()

    def variables(self, names: Sequence[str]) -> InstanceVariables:
        """Return variables that are set and got together."""
        chosen = [self.fmu.variables[name] for name in names]
        return InstanceVariables(self.calls, self.fmi_3, chosen)

    def do_step(self, time: float, length: float, final: bool = True) -> None:
        """Take a step of co-simulation.

        Args:
            time: where it begins.
            length: of the step.
            final: whether the FMU will not be asked to go back to a state before.

        Raises:
            CoSimulationError: it fails, ends early, or asks for the end of the simulation.
        """
        try:
            if not self.fmi_3:
                self._call("fmi2DoStep", self.calls.component, time, length, final)
                return
            event, terminate, early = self._flags
            references = byref(event), byref(terminate), byref(early), byref(self._reached)
            self._call("fmi3DoStep", self.calls.component, time, length, final, *references)
        except FailedCallError as error:
            raise self._at_end(error, time + length) from error
        if terminate.value or early.value:
            raise self.ended(time, length, self._reached.value, terminate.value)

    def ended(self, time: float, length: float, reached: float, asked: bool) -> FailedCallError:
        """Return the error of a step of FMI 3.0 that ended early, at a time that it reached.

        ``asked`` says whether the FMU asks for the end of the simulation.
        """
        what = "asks for the end of the simulation" if asked else "returned early"
        return FailedCallError(
            self.label,
            f"fmi3DoStep {what} at t = {reached:.9g} s; expected a step of {length:g} s from "
            f"{time:.9g} s: choose a shorter step",
        )

    def failed(self, name: str, status: int, end: float) -> FailedCallError:
        """Return the error of a call that ended with a status, in a step that ends at a time."""
        error = self._call.failed(name, status)
        return self._at_end(error, end) if name.endswith("DoStep") else error

    def function(self, name: str) -> Any:
        """Return a function of the FMU's library by its name, as ctypes has it."""
        return self.calls._functions[name]

    def _at_end(self, error: FailedCallError, end: float) -> FailedCallError:
        """Return the error of a step, which names the end of the experiment if it goes beyond."""
        stop = experiment(self.fmu.description, "stopTime")
        if stop is None or end <= stop:
            return error
        return type(error)(
            self.label,
            f"{error.reason}; its default experiment ends at {stop:g} s (stopTime), and the step "
            f"at {end:.9g} s: where it goes no further, export it with a later end",
            error.discarded,
        )

    def set_slopes(self, references: Sequence[int], slopes: Sequence[float]) -> None:
        """Set the first derivatives of inputs of FMI 2.0, in their units per s."""
        self.calls.setRealInputDerivatives(references, [1] * len(references), slopes)

    def derivatives(self, unknown: Sequence[int], known: int) -> list[float]:
        """Return the derivatives of variables by another one, all by value reference."""
        slopes: list[float] = self.calls.getDirectionalDerivative(unknown, [known], [1.0])
        return slopes

    def save(self) -> object:
        """Return its state."""
        return self.calls.getFMUState()

    def restore(self, state: object) -> None:
        """Go back to a state."""
        self.calls.setFMUState(state)

    def free_state(self, state: object) -> None:
        """Forget a state."""
        self.calls.freeFMUState(state)

    def terminate(self) -> None:
        """End the simulation."""
        self.calls.terminate()

    def reset(self) -> None:
        """Go back to where the instance was before ``set_up``."""
        self.calls.reset()
        self.messages.clear()

    def withdraw(self) -> None:
        """Free the instance for another one of its FMU; whoever uses it still is refused."""
        self.free()
        self._call.withdrawn = True


@contextmanager
def instantiated(
    fmu: UnpackedFmu, label: str | None = None, name: str | None = None
) -> Iterator[Instance]:
    """Open a fresh instance of an FMU for the time of a ``with`` block; arguments as there."""
    instance = Instance(fmu, label, name)
    try:
        yield instance
    finally:
        instance.free()


def _free(calls: Any, guard: GuardedCalls) -> None:
    if not guard.lost:  # not even to be freed
        calls.freeInstance()


_ONLY_ONES: weakref.WeakValueDictionary[tuple[str, str], Instance] = weakref.WeakValueDictionary()
"""Living instances of FMUs that allow one in a process."""


def _is_only_one(fmu: UnpackedFmu) -> bool:
    return bool(getattr(fmu.offer, "canBeInstantiatedOnlyOncePerProcess", False))


def _identity(fmu: UnpackedFmu) -> tuple[str, str]:
    token = fmu.description.guid or fmu.description.instantiationToken
    return str(token), str(fmu.offer.modelIdentifier)


def _withdraw_other(fmu: UnpackedFmu) -> None:
    """Free the instance of an FMU that allows one in a process, where there is one."""
    other = _ONLY_ONES.pop(_identity(fmu), None) if _is_only_one(fmu) else None
    if other is not None and other.free.alive:
        other.withdraw()
