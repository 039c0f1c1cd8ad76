"""A component is an instance of an FMU in a coupled system, with the meaning of its inputs."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from fmpy.simulation import apply_start_values, settable_in_instantiated

from slide_fmu.apps.couple.options import WHOLE
from slide_fmu.apps.couple.structure import CoupledSystem, Course, declared
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.importer import ImportedSlave, ValueReader
from slide_fmu.cosim.run import CoSimulationError
from slide_fmu.fmu.description.variables import (
    AT_STEP_END,
    BY_KEY,
    HELD,
    INITIAL,
    PREHISTORY_KNOWN,
    REFERENCES_PER_KIND,
)

Inputs = Literal["held", "reached", "sloped", "forecast"]
"""How a component takes inputs: constant over a step; moving to the value that is set, which they
reach by its end; moving with a slope that is set; or continued by its own forecast."""

BOUNDLESS = 1e12
"""A declared range or nominal value from this size on says nothing."""

OURS = "slide-fmu"
"""Generation tool of the FMUs whose inputs and derivatives belong to the end of a step."""


Nodes = Sequence[tuple[float, float]]
"""Parts of a step, the last one 1, at which outputs are read, with their weights in the mean."""

WHOLE_STEP: Nodes = ((1.0, 1.0),)


class LostError(CoSimulationError):
    """A LostError tells that a call ended with a fatal error, after which no call is allowed."""


class StepOutputs(NamedTuple):
    """Means of outputs over a step and outputs at its end, (n_outputs,), and their derivatives by
    the linked inputs, (n_outputs, n_linked)."""

    mean: FloatArray
    end: FloatArray
    slopes: tuple[FloatArray, FloatArray] | None = None


@dataclass(eq=False)
class Component:
    """A Component takes steps, forward and back.

    Attributes:
        name: its name in the system.
        slave: the instance.
        description: fmpy's model description.
        linked: linked inputs, whose values are set before each step.
        outputs: sources of links, whose values are read behind each step that is tried.
        watched: other variables, real or Boolean, that are read once a step is taken.
        courses: values over time of other inputs.
        inputs: how it takes inputs.
        nodes: where it stops in each step, to find the mean of its outputs.
        own_step: the only step in s that it takes; None if it takes any.
        feeds_through: whether an output depends on linked inputs of the same time.
        follows: the same of linked inputs and courses.
        given: names of the variables to which users give start values.
        knows_past: whether an FMU of ours learns that its first inputs have always acted.
    """

    name: str
    slave: ImportedSlave
    description: Any
    linked: Sequence[str]
    outputs: Sequence[str]
    watched: Sequence[str]
    courses: Sequence[tuple[int, Course]]
    inputs: Inputs
    nodes: Nodes = WHOLE_STEP
    own_step: float | None = None
    feeds_through: bool = True
    follows: bool = True
    given: Collection[str] = ()
    knows_past: bool = False

    def __post_init__(self) -> None:
        references = {v.name: v.valueReference for v in self.description.modelVariables}
        self._linked = [references[name] for name in self.linked]
        self._set = [*self._linked, *(reference for reference, _ in self.courses)]
        self._read = [references[name] for name in self.outputs]
        types = {v.name: v.type for v in self.description.modelVariables}
        watched = [references[name] for name in self.watched]
        self._watch = ValueReader(watched, [types[name] for name in self.watched])
        kind = self.description.coSimulation
        self.rolls_back = bool(getattr(kind, "canGetAndSetFMUstate", False))
        self.any_step = bool(kind.canHandleVariableCommunicationStepSize)
        self.ours = is_ours(self.description)
        self._slopes_up_to = 0.0  # s
        # FMPy does not read this attribute in FMI 3.0, whose FMUs of slide-fmu all have it
        given = kind.providesDirectionalDerivative or self.description.fmiVersion.startswith("3")
        if self.ours and given and all(map(is_trained, self._read)):
            self._slopes_up_to = (1 + WHOLE) * float(self.description.defaultExperiment.stepSize)
        self.steps = 0
        self._last_linked: list[float] = []

    def has_slopes(self, length: float) -> bool:
        """Return whether the FMU knows its derivatives over a step of a length in s.

        Those of slide-fmu know them by the inputs of the last sample.
        """
        return length <= self._slopes_up_to

    def advance(
        self, time: float, length: float, before: FloatArray, now: FloatArray, slopes: bool = False
    ) -> StepOutputs:
        """Take a step from a time in s, and return the outputs.

        Args:
            time, length: in s.
            before: linked inputs at the beginning of the step, (n_linked,).
            now: linked inputs at its end; their mean over the step for inputs that are held.
            slopes: whether to read derivatives, which FMUs of slide-fmu know.
        """
        mean, mean_slopes, done = np.zeros(len(self._read)), np.zeros(()), 0.0
        end, end_slopes = mean, mean_slopes
        nodes = self.nodes if self.own_step is None else own_nodes(length, self.own_step)
        for part, weight in nodes:
            begin, piece = time + done * length, (part - done) * length
            # held inputs are their means over the step, or over each step of its own
            middle = time + 0.5 * length if self.own_step is None else begin + 0.5 * piece
            self._set_inputs(begin, piece, before, now, (done, part), length, middle)
            self._do_step(begin, piece)
            mean = mean + weight * (end := self.read())
            if slopes:  # at a node, an input that moves has moved by this part of its change
                end_slopes = (1.0 if self.inputs == "held" else part) * self._slopes()
                mean_slopes = mean_slopes + weight * end_slopes
            done = part
        if self.inputs == "held" and self.follows and self.courses:
            self.set_linked(now, time + length)
            end = self.read()
        return StepOutputs(mean, end, (mean_slopes, end_slopes) if slopes else None)

    def _set_inputs(
        self,
        begin: float,
        piece: float,
        before: FloatArray,
        now: FloatArray,
        parts: tuple[float, float],
        length: float,
        middle: float,
    ) -> None:
        """Set all inputs before a piece of a step; held ones are those of the time ``middle``."""
        if not self._set:
            return
        place, at = begin, 1.0  # time of the courses, and part of the change of linked inputs
        if self.inputs == "held":
            place = middle
        elif self.inputs == "reached":
            place, at = begin + piece, parts[1]
        elif self.inputs == "sloped":
            at = parts[0]
        known = [course(place) for _, course in self.courses]
        linked = now if at == 1.0 else before + at * (now - before)
        self._last_linked = linked.tolist()
        self.slave.set_real(self._set, [*self._last_linked, *known])
        if self.inputs == "sloped":
            rates = [*((now - before) / length).tolist()]
            ends = [course(begin + piece) for _, course in self.courses]
            rates += [(end - value) / piece for end, value in zip(ends, known, strict=True)]
            self.slave.calls.setRealInputDerivatives(self._set, [1] * len(rates), rates)

    def _do_step(self, begin: float, piece: float) -> None:
        self.steps += 1
        try:
            ended = self.slave.calls.doStep(begin, piece, not self.rolls_back)
        except CoSimulationError as error:
            values = ", ".join(
                f"{name} = {value:.6g}"
                for name, value in zip(self.linked, self._last_linked, strict=True)
            )
            raise type(error)(
                f"{error}, in the step of {piece:g} s from {begin:.9g} s under "
                f"{values or 'no linked inputs'}; expected it to be taken: see whether inputs are "
                "in range; where they grow, choose a shorter step or the method newton"
            ) from error
        if ended is not None and (ended[1] or ended[2]):  # FMI 3.0: it terminates, or stops early
            raise CoSimulationError(
                f"component {self.name!r} ended a step early, at {ended[3]:.9g} s; expected a "
                f"step of {piece:g} s from {begin:.9g} s: choose a shorter step"
            )

    def read(self) -> FloatArray:
        """Return the outputs, (n_outputs,).

        Raises:
            CoSimulationError: one is not a finite number.
        """
        values = self.slave.get_real(self._read) if self._read else []
        if not all(map(math.isfinite, values)):
            name = self.outputs[int(np.argmin(np.isfinite(values)))]
            raise CoSimulationError(
                f"component {self.name!r}: {name} is not finite; expected a number: either the "
                "coupling is unstable at this step, and a shorter one or the method newton may "
                "help, or the FMU itself fails, which it does alone too"
            )
        return np.array(values, dtype=np.float64)

    def watch(self) -> list[float]:
        """Return the values of the watched variables; a Boolean is 0 or 1."""
        return self._watch(self.slave) if self.watched else []

    def _slopes(self) -> FloatArray:
        """Return the derivatives of the outputs by the linked inputs, (n_outputs, n_linked)."""
        ask = self.slave.calls.getDirectionalDerivative
        columns = [ask(self._read, [reference], [1.0]) for reference in self._linked]
        return np.array(columns, dtype=np.float64).T.reshape(len(self._read), len(self._linked))

    def starts(self) -> FloatArray:
        """Return the start values of the linked inputs, (n_linked,)."""
        values = self.slave.get_real(self._linked) if self._linked else []
        return np.array(values, dtype=np.float64)

    def set_linked(self, values: FloatArray, start: float) -> None:
        """Set linked inputs, and the others at the start time in s."""
        if self._set:
            known = [course(start) for _, course in self.courses]
            self.slave.set_real(self._set, [*values.tolist(), *known])

    def set_all(
        self, values: FloatArray, start: float, index: int | None, changes: Sequence[float]
    ) -> None:
        """Set all inputs at a time in s, the one of an index moved by its change."""
        all_ = [*values.tolist(), *(course(start) for _, course in self.courses)]
        if index is not None:
            all_[index] += changes[index] * (-1 if all_[index] > 0 else 1)
        if self._set:
            self.slave.set_real(self._set, all_)

    def begin(self) -> None:
        """Leave initialization, before which an FMU of ours may learn its past.

        Users may give other values of it.
        """
        variables = self.description.modelVariables
        names = {v.name: v.valueReference for v in variables}
        if self.knows_past:
            inputs = [v.name for v in variables if v.causality == "input"]
            first = self.slave.get_real([names[name] for name in inputs])
            pairs = {INITIAL.replace("{signal}", k): u for k, u in zip(inputs, first, strict=True)}
            pairs[PREHISTORY_KNOWN] = 1.0
            pairs = {name: value for name, value in pairs.items() if name not in self.given}
            self.slave.set_real([names[name] for name in pairs], list(pairs.values()))
        self.slave.exit_initialization()


def is_trained(reference: int) -> bool:
    """Return whether a value reference of an FMU of slide-fmu is that of a trained output."""
    return reference // REFERENCES_PER_KIND == BY_KEY["OUTPUT"].number


def is_ours(description: Any) -> bool:
    """Return whether an FMU is of slide-fmu."""
    return str(description.generationTool or "").startswith(OURS)


def opened(
    system: CoupledSystem,
    name: str,
    slave: ImportedSlave,
    inputs: Inputs,
    read: tuple[Sequence[str], Sequence[str]],
) -> Component:
    """Return a component in initialization mode, with the start values that users have given.

    ``read`` are its outputs and what is watched, as in ``Component``. Where inputs of an FMU of
    slide-fmu are held, it gets values that hold over a step, no samples of a smooth signal.
    """
    description = system.descriptions[name]
    linked = [link.target.variable for link in system.links if link.target.component == name]
    courses = [
        (int(system.variable(pin).valueReference), course)
        for pin, course in system.courses.items()
        if pin.component == name
    ]
    values = dict(system.parameters.get(name, {}))
    for way, value in ((AT_STEP_END, 1.0 if inputs == "reached" else 0.0), (HELD, 1.0)):
        if values.get(way, value) != value:
            raise ValueError(
                f"component {name!r}: {way} = {values[way]}; expected no value, since the "
                "coupling sets it as the method needs it: leave it out"
            )
        if way in system.names(name, "parameter"):
            values[way] = value
    asked, knows_past = values.get(PREHISTORY_KNOWN) == 1.0, False
    if is_ours(description) and inputs != "forecast":
        knows_past = asked or inputs == "reached"
        if asked:
            del values[PREHISTORY_KNOWN]  # ``begin`` sets it, once the first inputs are known
    left = apply_start_values(slave.calls, description, values, settable_in_instantiated)
    slave.enter_initialization(0.0)
    if left:
        raise ValueError(
            f"component {name!r}: {sorted(left)} cannot be set before the start; expected "
            "parameters or inputs"
        )
    found = Component(name, slave, description, linked, *read, courses, inputs)
    found.knows_past = knows_past
    found.own_step, found.given = fixed_step(description), list(values)
    return found


def inputs_of(system: CoupledSystem, name: str, plain: bool) -> Inputs:
    """Return how a component takes inputs, as far as its model description says.

    ``plain`` asks for the forecast of an FMU of slide-fmu whose inputs move.
    """
    description = system.descriptions[name]
    if AT_STEP_END in system.names(name, "parameter"):
        return "forecast" if plain else "reached"
    if AT_STEP_END in system.names(name, "local"):  # of a reference FMU, whose inputs always move
        return "reached"
    ours = is_ours(description)
    slopes = getattr(description.coSimulation, "canInterpolateInputs", False)
    if slopes and not ours and str(description.fmiVersion).startswith("2."):
        return "sloped"
    return "held"


def fixed_step(description: Any) -> float | None:
    """Return the only step in s that an FMU takes; None if it takes any."""
    kind = description.coSimulation
    own = getattr(kind, "fixedInternalStepSize", None) or getattr(
        description.defaultExperiment, "stepSize", None
    )
    return None if kind.canHandleVariableCommunicationStepSize or not own else float(own)


def own_nodes(length: float, own: float) -> Nodes:
    """Return the steps of an FMU that takes steps of one length only, within a longer step."""
    count = round(length / own)
    nodes = np.arange(1, count + 1) / count
    powers = np.arange(min(count, 3))  # weights give the means of polynomials of these degrees
    weights = np.linalg.lstsq(nodes ** powers[:, None], 1 / (powers + 1), rcond=None)[0]
    return [(float(node), float(weight)) for node, weight in zip(nodes, weights, strict=True)]


def range_of(variable: Any) -> float | None:
    """Return the declared range of a variable, else its nominal value; None without both.

    Ranges that say nothing, as of Modelica's largest number, count as none.
    """
    low, high, nominal = (declared(variable, key) for key in ("min", "max", "nominal"))
    known = None if nominal is None else abs(float(nominal))
    if low is not None and high is not None and float(high) > float(low):
        known = float(high) - float(low)
    return known if known is not None and 0 < known < BOUNDLESS else None
