"""A reference system takes inputs and gives outputs; everything else is an offer.

``System`` is the least interface; records of a system, which cannot be simulated, are another
``Source`` of trajectories. The classes behind ``System`` are offers: a system inherits the
offers that it fulfils, and callers test for one with ``isinstance``. A missing offer is replaced
by a measurement, or its result is left out, and the report says so.
"""

from __future__ import annotations

import abc
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.user_code import error_text


@dataclass(frozen=True, eq=False)
class Linearization:
    """A Linearization has the matrices of M q'' + D q' + K q + G^T lambda = 0, G q = 0 at a state.

    Attributes:
        mass: M, shape (n, n).
        damping: D = -df/dq', shape (n, n).
        stiffness: K = -df/dq, shape (n, n).
        constraints: Jacobian G of the constraints, shape (n_constraints, n), may have no rows.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    constraints: FloatArray


@dataclass(frozen=True, eq=False)
class StateMatrix:
    """A StateMatrix is the linearization x' = A x of a system of first order at a state.

    Attributes:
        matrix: A = df/dx in 1/s, shape (n, n).
    """

    matrix: FloatArray


Linearized = Linearization | StateMatrix
"""The equations of a system, linearized at a state: of second order or of first."""


@dataclass(frozen=True, eq=False)
class State:
    """A State is all that the future depends on at one sample, except later inputs.

    Attributes:
        coordinates: generalized coordinates q, or the states x of a system of first order, shape
            (n,).
        velocities: their rates q', shape (n,); shape (0,) of a system of first order.
        last_input: the input that acted last, shape (n_inputs,); a first-order hold starts from
            it.
        input_rate: its rate in the step that ended there, per s, shape (n_inputs,), where the
            outputs follow it; shape (0,) elsewhere, or where none is known.
    """

    coordinates: FloatArray
    velocities: FloatArray
    last_input: FloatArray
    input_rate: FloatArray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False)
class Motion:
    """A Motion is what a system is asked to simulate.

    Attributes:
        inputs: inputs at the ends of the sample steps, (N, n_inputs), in their units.
        initial: the state at sample 0; the system's own start under the first input if None.
        between: the same inputs at the ends of equal parts of all sample steps, shape
            (parts * N, n_inputs), where they bend between samples; None where they do not.
        jumps: part of each sample step after which each input jumps to its value at the step's
            end, from 0 to 1; NaN where it moves linearly. Shape (N, n_inputs); None where none
            jumps.
    """

    inputs: FloatArray
    initial: State | None = None
    between: FloatArray | None = None
    jumps: FloatArray | None = None

    @property
    def first_input(self) -> FloatArray:
        """The input that has always acted before the start, (n_inputs,)."""
        bends = self.between is not None and self.jumps is None
        first: FloatArray = (self.between if bends else self.inputs)[0]  # type: ignore[index]
        return first


@dataclass(frozen=True, eq=False)
class Beginning:
    """A Beginning is a motion as far as it was simulated together with others.

    Attributes:
        outputs: outputs at its first k + 1 samples, in their units, shape (k + 1, n_outputs).
        state: the state at sample k; None where not even the start was found.
        states: those of its states that were asked for.
    """

    outputs: FloatArray
    state: State | None
    states: Sequence[State] = ()


class Source(abc.ABC):
    """A Source gives trajectories: a system that is simulated, or records of one.

    Interface: never instantiated.

    Attributes:
        step: sample step h in s.
        inputs, outputs: signals in channel order; inputs say how they act between samples and
            which of them are an angle (``check_inputs``).
        remarks: one sentence for each assumption so far, for people.
        may_crash: whether it runs a foreign library, which may end the process.
        sampled_only: whether the signals between the samples are unknown.
        lacks_outputs: whether an output is missing somewhere.
        noise_at_rest: samples of the outputs' noise alone, (N, n_outputs) each, in their units;
            None where it is not known.
        answered_in: module with the answers of such a source in place of a simulated system
            (``slide_fmu.data.answers``); None for systems.
    """

    step: float
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    remarks: tuple[str, ...] = ()
    may_crash: bool = False
    sampled_only: bool = False
    lacks_outputs: bool = False
    noise_at_rest: tuple[FloatArray, ...] | None = None
    answered_in: str | None = None


@dataclass(frozen=True, eq=False)
class Finer:
    """A system is made with a finer sample step when it is first asked for.

    Attributes:
        parts: number of its steps in a sample step of the other one.
        make: makes it; raises a ``LoadError`` where the model has a step of its own.
    """

    parts: int
    make: Callable[[], System]

    @cached_property
    def system(self) -> System:
        """The system with the finer step."""
        return self.make()


class System(Source):
    """A System is a reference system, sampled with the step h. Interface: never instantiated.

    Implementations are final, cheap to construct (heavy work on first use) and are made again
    in every worker process from their specifications.

    Attributes:
        own_step: its internal step in s, where it names one, as an FMU may.
        follows_rates: whether it declares that the rates of its inputs act too, for example in a
            damper whose end is an input.
        input_remark: remark on how its inputs act, for people; or None.
        holds_inputs_over_own_step: whether inputs are held over its own step, so that moving ones
            become stairs.
        finer: the same system between its samples; None where inputs go straight from one to the
            next.
        solved_by: name of what integrates it, for people; None where it is not known.
        fineness: parameters of its specification that say how finely it is solved, with the values
            that act: numbers of steps in a sample step, whose names end with ``substeps``, or
            tolerances. Empty where it does not tell.
    """

    own_step: float | None = None
    follows_rates: bool = False
    input_remark: str | None = None
    holds_inputs_over_own_step: bool = False
    finer: Finer | None = None
    solved_by: str | None = None
    fineness: Mapping[str, float] = MappingProxyType({})

    @abc.abstractmethod
    def simulate(self, inputs: FloatArray) -> FloatArray:
        """Simulate from the system's own start, which is the same for the same first input.

        Before the first sample ``inputs[0]`` has always acted; a system that knows its equilibrium
        under it starts there.

        Args:
            inputs: shape (N, n_inputs), in the units of the inputs; N is at least 1.

        Returns:
            Outputs in their units, the one at the start first, shape (N + 1, n_outputs).

        Raises:
            SimulationError: the motion diverged, or the solver did not converge.
        """


class BegunLater(System):
    """A system offers to begin later, so that it shows whether it depends on the time itself."""

    @abc.abstractmethod
    def begun_later(self, samples: int) -> System:
        """Return the same system, whose clock shows a number of sample steps more at the start."""


class Stepping(System):
    """A Stepping system offers to go on step by step, so that it can run in a co-simulation."""

    @abc.abstractmethod
    def begin(self, held_input: FloatArray) -> None:
        """Go to the system's own start under an input that has always acted, (n_inputs,)."""

    @abc.abstractmethod
    def output(self) -> FloatArray:
        """Give the outputs at the current state in their units, shape (n_outputs,)."""

    @abc.abstractmethod
    def advance(self, inputs: FloatArray) -> FloatArray:
        """Go on by one sample step under ``inputs``, shape (n_inputs,); give the new outputs.

        Raises:
            SimulationError: the motion diverged, or the solver did not converge.
            ValueError: the input has a wrong shape or is not finite.
        """

    def simulate(self, inputs: FloatArray) -> FloatArray:
        self.begin(inputs[0])
        return go_on(self, inputs)


class Jumping(Stepping):
    """A Jumping system offers inputs that jump at a sample, where they move otherwise."""

    @abc.abstractmethod
    def jump(self, inputs: FloatArray) -> None:
        """Let the inputs jump to values, (n_inputs,), from which the next ``advance`` begins."""


class Restorable(Jumping):
    """A Restorable system offers to save its states, and to go on from any of them."""

    @abc.abstractmethod
    def rest_state(self, held_input: FloatArray) -> State:
        """Give the state to start from under a constant input, shape (n_inputs,).

        It is the static equilibrium where the system knows one.
        """

    @abc.abstractmethod
    def set_state(self, state: State) -> None:
        """Continue from this state with the next ``advance``.

        Raises:
            ValueError: a value is missing or not finite.
        """

    @abc.abstractmethod
    def get_state(self) -> State:
        """Give a copy of the current state."""

    def begin(self, held_input: FloatArray) -> None:
        self.set_state(self.rest_state(held_input))

    def jump(self, inputs: FloatArray) -> None:
        self.set_state(replace(self.get_state(), last_input=inputs.copy()))


class Bending(Restorable):
    """A Bending system offers to follow inputs that bend or jump between samples, at no cost."""

    @abc.abstractmethod
    def advance_bending(self, points: FloatArray) -> FloatArray:
        """Go on by one sample step under inputs that go through points; give the new outputs.

        Args:
            points: inputs at the ends of equal parts of the step, shape (parts, n_inputs).

        Raises:
            SimulationError, ValueError: as in ``advance``.
        """

    @abc.abstractmethod
    def advance_jumping(self, inputs: FloatArray, at: FloatArray) -> FloatArray:
        """Go on by one sample step within which inputs jump; give the new outputs.

        Args:
            inputs: the inputs at the end of the step, shape (n_inputs,).
            at: part of the step after which each input jumps there, from 0 to 1; NaN for one that
                moves linearly. Shape (n_inputs,).

        Raises:
            SimulationError, ValueError: as in ``advance``.
        """


class Batching(Bending):
    """A Batching system offers to simulate many motions at once, faster than one by one."""

    @abc.abstractmethod
    def most_at_once(self, varied: Collection[str] = ()) -> int:
        """Give the largest number of motions that are worth simulating at once; 1 if none are.

        ``varied`` are names of parameters whose values differ from motion to motion.
        """

    @abc.abstractmethod
    def costs_as_few(self, varied: Collection[str] = ()) -> bool:
        """Tell whether many motions at once take about as long as few; else each takes its part.

        ``varied`` are as of ``most_at_once``.
        """

    @abc.abstractmethod
    def begin_together(
        self,
        systems: Sequence[System],
        motions: Sequence[Motion],
        varied: Collection[str] = (),
        every: int | None = None,
    ) -> list[Beginning]:
        """Simulate motions at once, each as far as that goes.

        A motion on which the system fails is left where the sample begins, and the caller goes on
        with it alone. Nothing of a motion depends on which others there are, to the last bit.

        Args:
            systems: the system of each motion: this one, with values of its own of the parameters
                that are varied.
            motions: at most ``most_at_once`` of them.
            varied: names of the parameters whose values differ.
            every: the states at the samples with a multiple of this number are wanted, without
                that at the start; none if None.
        """


class ShowingStates(System):
    """A system offers its states as further outputs, so that a fit can begin at any sample."""

    @abc.abstractmethod
    def showing_states(self) -> System:
        """Return the same system with its states behind its outputs.

        States on which no output depends, as the angle of a wheel that only rolls on, are left
        out: nothing need be forgotten of them.
        """


class RandomStates(Restorable):
    """A system with RandomStates draws initial states, so that no motion to lead in is needed."""

    @abc.abstractmethod
    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        """Draw an initial state from the range in which the system is used.

        Args:
            first_input: the first input, shape (n_inputs,), if it is known; a system that is made
                to follow its inputs starts somewhere near.
        """


class Linearizable(Restorable):
    """A Linearizable system offers its equations of motion, linearized at a state."""

    @abc.abstractmethod
    def linearize(self, state: State) -> Linearized:
        """Linearize the equations of motion at a state; the current state stays as it is.

        The paper's section on decay times needs this.
        """


class Chained(System):
    """The inputs are the joint set points of a serial chain, for features of its motion. An offer.

    Attributes:
        chain: the rigid bodies of the chain; None where the chosen model has none.
    """

    chain: SerialChain | None = None


def chain_of(system: Source) -> SerialChain | None:
    """Give the serial chain of a system that has one, else None."""
    return system.chain if isinstance(system, Chained) else None


def go_on(
    system: Stepping,
    inputs: FloatArray,
    reached: Callable[[], object] | None = None,
    advance: Callable[[FloatArray], FloatArray] | None = None,
    first: int = 0,
) -> FloatArray:
    """Go on from the current state under inputs (N, n_inputs); give outputs (N + 1, n_outputs).

    The outputs at the current state come first. ``reached`` is called at this and at every further
    state. ``advance`` takes the place of the system's own, for inputs of another shape (N, ...).
    The current state is at the sample ``first`` of the motion, by which errors name samples.
    The system raises what ``advance`` raises.
    """
    advance = advance or system.advance
    outputs = np.empty((len(inputs) + 1, len(system.outputs)))
    outputs[0] = _row(system, "output", system.output)
    for k, row in enumerate(inputs):
        if reached is not None:
            reached()
        outputs[k + 1] = _row(system, "advance", advance, first + k, row)
    if reached is not None:
        reached()
    return outputs


def _row(
    system: System, method: str, call: Callable[..., FloatArray], k: int = -1, *inputs: FloatArray
) -> FloatArray:
    """Call a method that gives one row of outputs; errors name the sample."""
    time = max(k, 0) * system.step
    try:
        row = call(*inputs)
    except LoadError:
        raise
    except SimulationError as error:
        if error.time is not None:
            raise
        place = _place(system, k, *inputs).lstrip() or "at the start"
        raise SimulationError(f"{place}: {error}", time) from error
    except (Exception, SystemExit) as error:  # a user's method may raise anything, and end
        raise SimulationError(raised(system, method, error, k, *inputs), time) from error
    try:
        numbers = real_numbers(row)
        what = f"outputs of shape {numbers.shape}"
        if numbers.shape == (len(system.outputs),):
            return numbers
    except (TypeError, ValueError):
        what = shown(row)
    raise SimulationError(
        f"{type(system).__qualname__}.{method} gave {what}{_place(system, k, *inputs)}; expected "
        f"an array of shape ({len(system.outputs)},), one number for each output: correct the "
        "model",
        time,
    )


def read_only(values: FloatArray) -> FloatArray:
    """Return a read-only view, so that a model that changes its arguments fails."""
    view = values.view()
    view.setflags(write=False)
    return view


def finite_vector(label: str, values: FloatArray, size: int) -> FloatArray:
    """Return a copy of a vector that must hold ``size`` finite numbers; messages name the label.

    Raises:
        ValueError: the vector has another shape, or is not finite.
    """
    vector = np.array(values, dtype=np.float64)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise ValueError(
            f"{label} = {vector} of shape {vector.shape}; expected finite numbers, shape ({size},)"
        )
    return vector


def real_numbers(values: object) -> FloatArray:
    """Return a result of user code as a new array.

    Raises:
        TypeError, ValueError: these are no real numbers.
    """
    numbers = np.array(values)
    if numbers.dtype == np.float64:
        return numbers
    if numbers.dtype.kind not in "fiub":
        raise ValueError(f"of type {numbers.dtype}, no real numbers")
    return numbers.astype(np.float64)


def raised(
    system: System, method: str, error: BaseException, k: int = -1, *inputs: FloatArray
) -> str:
    """Describe an exception of a user's method, with its step, file and line."""
    name, place = type(system).__qualname__, _place(system, k, *inputs)
    return f"{name}.{method} raised {error_text(error)}{place}: correct the model"


def _place(system: System, k: int, *inputs: FloatArray) -> str:
    """Name the sample and the input of an error."""
    if k < 0:
        return ""
    return f" in sample {k} (t = {k * system.step:.6g} s) under {inputs[0].tolist()}"
