"""A co-simulation FMU goes from sample to sample here; both interfaces share its plan."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

from slide_fmu.core.signals import FloatArray, Signal, hold_of
from slide_fmu.systems.declared import Parameter
from slide_fmu.systems.fmu.file import FmuFile
from slide_fmu.systems.fmu.instance import Instance


class StoppedError(RuntimeError):
    """An FMU does not go on, although its calls report no error."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A Plan is how an FMU is simulated.

    Attributes:
        file: the FMU.
        step: sample step h in s.
        inputs, outputs: its signals.
        parameters: values of its parameters by name, and of inputs that are no signals.
    """

    file: FmuFile
    step: float
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    parameters: Mapping[str, Parameter]

    @property
    def ramped(self) -> bool:
        """Tell whether inputs move linearly within a sample step."""
        return hold_of(self.inputs) == "first_order"

    @property
    def stairs(self) -> int:
        """The number of stairs that a moving input climbs in a sample step."""
        options = self.file.options
        return options.substeps if options.step is None else round(self.step / options.step)

    def instance(self) -> Instance:
        """Make an instance; raises a LoadError where that fails."""
        return Instance(self.file, self.inputs, self.outputs, self.parameters)


class FmuSteps(abc.ABC):
    """FmuSteps take an initialized instance from sample to sample. Interface: never instantiated.

    Calls that fail raise fmpy's ``FMICallException``, and a ``RuntimeError`` if the solver fails.

    Attributes:
        plan: how the FMU is simulated.
        instance: the instance that is.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan, self.instance = plan, plan.instance()

    @abc.abstractmethod
    def begin(self, held: FloatArray) -> None:
        """Go to time 0 with the instance just initialized under these inputs, (n_inputs,)."""

    @abc.abstractmethod
    def advance(self, number: int, before: FloatArray, now: FloatArray) -> None:
        """Go from sample ``number`` to the next one.

        Inputs of first-order hold move from ``before`` to ``now``, of shape (n_inputs,); others
        are ``now`` all the time.
        """


@final
class CoSimulationSteps(FmuSteps):
    """The FMU steps by itself."""

    def begin(self, held: FloatArray) -> None:
        """Nothing is left to do after the initialization."""

    def advance(self, number: int, before: FloatArray, now: FloatArray) -> None:
        step, instance = self.plan.step, self.instance
        begin = number * step
        own = self.plan.file.options.step
        if not self.plan.ramped:
            instance.set_inputs(now)
            count = 1 if own is None else self.plan.stairs
            for k in range(count):
                self._do_step(begin + k * step / count, step / count)
        elif own is None and self.plan.file.interpolates:
            instance.set_inputs(before)
            instance.set_slopes((now - before) / step)
            self._do_step(begin, step)
        else:
            self._climb(begin, before, now)

    def _climb(self, begin: float, before: FloatArray, now: FloatArray) -> None:
        """Take a moving input as stairs: each as high as the input in its middle.

        Steps of an importer have the value with which they begin.
        """
        count = self.plan.stairs
        part = self.plan.step / count
        within = 0.5 if self.plan.file.options.step is None else 0.0
        for k in range(count):
            self.instance.set_inputs(before + (k + within) / count * (now - before))
            self._do_step(begin + k * part, part)
        self.instance.set_inputs(now)  # for outputs that follow the inputs without delay

    def _do_step(self, begin: float, length: float) -> None:
        done: Any = self.instance.calls.doStep(begin, length)
        if done is None:  # FMI 2.0
            return
        _, terminate, early, reached = done
        if terminate or early:
            what = "asks for the end of the simulation" if terminate else "returned early"
            raise StoppedError(f"fmi3DoStep {what} at t = {reached:g} s")
