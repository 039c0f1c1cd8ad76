"""A co-simulation FMU goes from sample to sample here; both interfaces share its plan."""

from __future__ import annotations

import abc
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from slide_fmu.core.signals import FloatArray, Signal, hold_of
from slide_fmu.importer.description import experiment
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.importer.file import UnpackedFmu, folder_of_process
from slide_fmu.importer.instance import Instance
from slide_fmu.systems.declared import Parameter
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.fmu.file import FmuFile


@dataclass(frozen=True, eq=False)
class Plan:
    """A Plan is how an FMU is simulated.

    Attributes:
        file: the FMU.
        step: sample step h in s.
        inputs, outputs: its signals.
        parameters: values of its parameters by name, and of inputs that are no signals.
        later: number of sample steps after the FMU's own start time at which motions begin.
    """

    file: FmuFile
    step: float
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    parameters: Mapping[str, Parameter]
    later: int = 0

    @property
    def ramped(self) -> bool:
        """Tell whether inputs move linearly within a sample step."""
        return hold_of(self.inputs) == "first_order"

    @property
    def stairs(self) -> int:
        """The number of stairs that a moving input climbs in a sample step."""
        step = self.file.importer_step
        return self.file.options.substeps if step is None else round(self.step / step)

    def instance(self) -> Instance:
        """Make an instance.

        Raises:
            LoadError: its library cannot be loaded, or it refuses to be instantiated.
        """
        file = self.file
        try:
            folder = folder_of_process(file.path)
            fmu = UnpackedFmu(file.path, folder, file.description, file.interface)
            return Instance(fmu, f"FMU {file.path.name!r}")
        except CoSimulationError as error:
            raise LoadError(str(error)) from error


class FmuSteps(abc.ABC):
    """FmuSteps take an instance from sample to sample. Interface: never instantiated.

    Calls that fail raise a ``CoSimulationError``, a solver that fails another ``RuntimeError``.

    Attributes:
        plan: how the FMU is simulated.
        instance: the instance that is.
        inputs, outputs: its signals.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan, self.instance = plan, plan.instance()
        self.inputs = self.instance.variables([signal.name for signal in plan.inputs])
        self.outputs = self.instance.variables([signal.name for signal in plan.outputs])

    def initialize(self, held: FloatArray, stop: float | None = None) -> None:
        """Initialize the instance under inputs that have always acted, (n_inputs,).

        The FMU is told a stop time in s, if there is one.
        """
        self.instance.messages.clear()
        self.instance.initialize(
            self.plan.parameters,
            self.inputs,
            held.tolist(),
            start=self.time(0),
            tolerance=self.plan.file.options.tolerance,
            stop=stop,
        )
        self.begin(held)

    def time(self, number: int) -> float:
        """Return the time of a sample in s, for the FMU."""
        return self.instance.begin + (self.plan.later + number) * self.plan.step

    @property
    def default_stop(self) -> float:
        """The time in s at which the FMU's default experiment ends; infinite if it names none."""
        stop = experiment(self.instance.fmu.description, "stopTime")
        return math.inf if stop is None else stop

    @abc.abstractmethod
    def begin(self, held: FloatArray) -> None:
        """Go on from the initialization under these inputs, (n_inputs,)."""

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
        step, instance, begin = self.plan.step, self.instance, self.time(number)
        by_importer = self.plan.file.options.step is not None
        if not self.plan.ramped:
            self.inputs.set(now.tolist())
            count = self.plan.stairs if by_importer else 1
            for k in range(count):
                instance.do_step(begin + k * step / count, step / count)
        elif not by_importer and self.plan.file.interpolates:
            self.inputs.set(before.tolist())
            instance.set_slopes(self.inputs.references, ((now - before) / step).tolist())
            instance.do_step(begin, step)
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
            self.inputs.set((before + (k + within) / count * (now - before)).tolist())
            self.instance.do_step(begin + k * part, part)
        self.inputs.set(now.tolist())  # for outputs that follow the inputs without delay
