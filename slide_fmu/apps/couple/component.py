"""A component is an instance of an FMU in a coupled system, with the meaning of its inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from slide_fmu.apps.couple.structure import CoupledSystem, Course, declared
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.variables import (
    AT_STEP_END,
    BY_KEY,
    HELD,
    INITIAL,
    PREHISTORY_KNOWN,
    REFERENCES_PER_KIND,
)
from slide_fmu.importer.calls import Witness
from slide_fmu.importer.description import (
    WHOLE,
    experiment,
    is_fmi_3,
    only_step,
    takes_any_step,
)
from slide_fmu.importer.errors import CoSimulationError, LostError
from slide_fmu.importer.file import unpacked
from slide_fmu.importer.instance import Instance, instantiated

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


MOST_PARTS = 10
"""A step that an FMU discards is halved at most this number of times."""


class DiscardedError(CoSimulationError):
    """A DiscardedError tells that an FMU discarded a step.

    Attributes:
        halves: whether the FMU could go back and take half the step.
    """

    def __init__(self, reason: str, halves: bool = False) -> None:
        super().__init__(reason, halves)
        self.halves = halves

    def __str__(self) -> str:
        return str(self.args[0])


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
        instance: the instance of its FMU. It begins at 0 s of the run, at its own start time.
        linked: linked inputs, whose values are set before each step.
        outputs: sources of links, whose values are read behind each step that is tried.
        watched: other variables, real or Boolean, that are read once a step is taken.
        courses: values over time of other inputs, by name.
        inputs: how it takes inputs.
        nodes: where it stops in each step, to find the mean of its outputs.
        own_step: the only step in s that it takes; None if it takes any.
        feeds_through: whether an output depends on linked inputs of the same time.
        follows: the same of linked inputs and courses.
        given: names of the variables to which users give start values.
        knows_past: whether an FMU of ours learns that its first inputs have always acted.
        careful: whether the state is saved before each step, so that a half can take the place of
            one that the FMU discards.
    """

    name: str
    instance: Instance
    linked: Sequence[str]
    outputs: Sequence[str]
    watched: Sequence[str]
    courses: Sequence[tuple[str, Course]]
    inputs: Inputs
    nodes: Nodes = WHOLE_STEP
    own_step: float | None = None
    feeds_through: bool = True
    follows: bool = True
    given: Collection[str] = ()
    knows_past: bool = False
    careful: bool = False

    def __post_init__(self) -> None:
        instance = self.instance
        self.description = instance.fmu.description
        self._linked = instance.variables(self.linked)
        self._inputs = instance.variables([*self.linked, *(name for name, _ in self.courses)])
        self._outputs = instance.variables(self.outputs)
        self._watched = instance.variables(self.watched)
        kind = self.description.coSimulation
        self.rolls_back = instance.can_go_back
        self.any_step = takes_any_step(self.description)
        self.ours = is_ours(self.description)
        self._slopes_up_to = 0.0  # s
        # FMPy does not read this attribute in FMI 3.0, whose FMUs of slide-fmu all have it
        given = kind.providesDirectionalDerivative or is_fmi_3(self.description)
        if self.ours and given and all(map(is_trained, self._outputs.references)):
            step = experiment(self.description, "stepSize") or 0.0
            self._slopes_up_to = (1 + WHOLE) * step
        self.steps = 0
        self._last_linked: list[float] = []

    def has_slopes(self, length: float) -> bool:
        """Return whether the FMU knows its derivatives over a step of a length in s.

        Those of slide-fmu know them by the inputs of the last sample.
        """
        return length <= self._slopes_up_to

    @property
    def halves(self) -> bool:
        """Whether the FMU can go back from a step that it discards, and take half of it."""
        return self.rolls_back and self.own_step is None

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
        mean, mean_slopes, done = np.zeros(len(self._outputs)), np.zeros(()), 0.0
        end, end_slopes = mean, mean_slopes
        nodes = self.nodes if self.own_step is None else own_nodes(length, self.own_step)
        for part, weight in nodes:
            begin, piece = time + done * length, (part - done) * length
            # held inputs are their means over the step, or over each step of its own
            middle = time + 0.5 * length if self.own_step is None else begin + 0.5 * piece
            if self.careful:
                values = partial(self._set_inputs, before=before, now=now, length=length)
                self._piece(values, time, length, (done, part), middle)
            else:
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

    def _piece(
        self,
        set_inputs: Callable[..., None],
        time: float,
        length: float,
        parts: tuple[float, float],
        middle: float,
        halved: int = 0,
    ) -> None:
        """Take a piece of a step, from one part of it to another; or two halves of it in turn."""
        begin, piece = time + parts[0] * length, (parts[1] - parts[0]) * length
        state = self.instance.save()
        try:
            set_inputs(begin, piece, parts=parts, middle=middle)
            self._do_step(begin, piece)
            return
        except DiscardedError:
            if halved == MOST_PARTS:
                raise
            self.instance.restore(state)
        finally:
            self.instance.free_state(state)
        half = 0.5 * (parts[0] + parts[1])
        for ends in ((parts[0], half), (half, parts[1])):
            self._piece(set_inputs, time, length, ends, middle, halved + 1)

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
        if not self._inputs:
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
        self._inputs.set([*self._last_linked, *known])
        if self.inputs == "sloped":
            rates = [*((now - before) / length).tolist()]
            ends = [course(begin + piece) for _, course in self.courses]
            rates += [(end - value) / piece for end, value in zip(ends, known, strict=True)]
            self.instance.set_slopes(self._inputs.references, rates)

    def step(self, begin: float, length: float) -> None:
        """Take a step from a time of the run, both in s, under the inputs that are set."""
        self.instance.do_step(self.instance.begin + begin, length, not self.rolls_back)

    def _do_step(self, begin: float, piece: float) -> None:
        self.steps += 1
        try:
            self.step(begin, piece)
        except CoSimulationError as error:
            values = ", ".join(
                f"{name} = {value:.6g}"
                for name, value in zip(self.linked, self._last_linked, strict=True)
            )
            where = (
                f"in the step of {piece:g} s from {begin:.9g} s under "
                f"{values or 'no linked inputs'}; expected it to be taken: see whether inputs are "
                "in range; where they grow, choose a shorter step or the method newton"
            )
            if getattr(error, "discarded", False):
                able = "" if self.rolls_back else ", and it cannot go back (canGetAndSetFMUstate)"
                raise DiscardedError(f"{error}, {where}{able}", self.halves) from error
            kind = LostError if isinstance(error, LostError) else CoSimulationError
            raise kind(f"{error}, {where}") from error

    def read(self) -> FloatArray:
        """Return the outputs, (n_outputs,).

        Raises:
            CoSimulationError: one is not a finite number.
        """
        values = self._outputs.get()
        self._require_finite(self.outputs, values)
        return np.array(values, dtype=np.float64)

    def watch(self) -> list[float]:
        """Return the values of the watched variables; a Boolean is 0 or 1.

        Raises:
            CoSimulationError: an output is not a finite number; other variables may be none.
        """
        values = self._watched.get()
        if not all(map(math.isfinite, values)):
            causes = {one.name: one.causality for one in self.description.modelVariables}
            both = zip(self.watched, values, strict=True)
            outputs = {name: value for name, value in both if causes[name] == "output"}
            self._require_finite([*outputs], [*outputs.values()])
        return values

    def _require_finite(self, names: Sequence[str], values: Sequence[float]) -> None:
        if all(map(math.isfinite, values)):
            return
        number = int(np.argmin(np.isfinite(values)))
        raise CoSimulationError(
            f"component {self.name!r}: {names[number]} is not finite ({values[number]:g}); "
            "expected a number: either the coupling is unstable at this step, and a shorter one "
            "or the method newton may help, or the FMU itself fails, which it does alone too"
        )

    def _slopes(self) -> FloatArray:
        """Return the derivatives of the outputs by the linked inputs, (n_outputs, n_linked)."""
        ask, unknown, known = self.instance.derivatives, self._outputs, self._linked
        columns = [ask(unknown.references, reference) for reference in known.references]
        return np.array(columns, dtype=np.float64).T.reshape(len(unknown), len(known))

    def starts(self) -> FloatArray:
        """Return the start values of the linked inputs, (n_linked,)."""
        return np.array(self._linked.get(), dtype=np.float64)

    def set_linked(self, values: FloatArray, start: float) -> None:
        """Set linked inputs, and the others at the start time in s."""
        self._inputs.set([*values.tolist(), *(course(start) for _, course in self.courses)])

    def set_all(
        self, values: FloatArray, start: float, index: int | None, changes: Sequence[float]
    ) -> None:
        """Set all inputs at a time in s, the one of an index moved by its change."""
        all_ = [*values.tolist(), *(course(start) for _, course in self.courses)]
        if index is not None:
            all_[index] += changes[index] * (-1 if all_[index] > 0 else 1)
        self._inputs.set(all_)

    def begin(self) -> None:
        """Leave initialization, before which an FMU of ours may learn its past.

        Users may give other values of it.
        """
        if self.knows_past:
            variables = self.description.modelVariables
            inputs = [v.name for v in variables if v.causality == "input"]
            first = self.instance.variables(inputs).get()
            pairs = {INITIAL.replace("{signal}", k): u for k, u in zip(inputs, first, strict=True)}
            pairs[PREHISTORY_KNOWN] = 1.0
            pairs = {name: value for name, value in pairs.items() if name not in self.given}
            self.instance.variables(list(pairs)).set(list(pairs.values()))
        self.instance.exit_initialization()


def is_trained(reference: int) -> bool:
    """Return whether a value reference of an FMU of slide-fmu is that of a trained output."""
    return reference // REFERENCES_PER_KIND == BY_KEY["OUTPUT"].number


def is_ours(description: Any) -> bool:
    """Return whether an FMU is of slide-fmu."""
    return str(description.generationTool or "").startswith(OURS)


@contextmanager
def instance_of(
    system: CoupledSystem,
    name: str,
    witness: Witness | None = None,
) -> Iterator[Instance]:
    """Instantiate the FMU of a component for the time of a ``with`` block.

    The witness is told of its calls.

    Raises:
        CoSimulationError: its library cannot be loaded, or it refuses a call.
    """
    with unpacked(system.paths[name]) as fmu:
        if witness is not None:
            witness.begin("its instantiation")
        with instantiated(fmu, f"component {name!r}", name) as instance:
            if witness is not None:
                witness.end()
                instance.tell(witness)
            yield instance


def open_component(
    system: CoupledSystem,
    name: str,
    instance: Instance,
    inputs: Inputs,
    read: tuple[Sequence[str], Sequence[str]],
) -> Component:
    """Return a component in initialization mode, with the start values that users have given.

    ``read`` are its outputs and what is watched, as in ``Component``. Where inputs of an FMU of
    slide-fmu are held, it gets values that hold over a step, no samples of a smooth signal.
    """
    description = system.descriptions[name]
    linked = [link.target.variable for link in system.links if link.target.component == name]
    courses = [(pin.variable, one) for pin, one in system.courses.items() if pin.component == name]
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
    instance.set_up(values)
    instance.enter_initialization()
    component = Component(name, instance, linked, *read, courses, inputs)
    component.knows_past = knows_past
    component.own_step, component.given = only_step(description), list(values)
    return component


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
    if slopes and not ours and not is_fmi_3(description):
        return "sloped"
    return "held"


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
