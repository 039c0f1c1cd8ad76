"""A function system has equations x' = f(x, u, p), y = g(x, u, p), integrated by scipy."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, final

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, hold_of, moves
from slide_fmu.systems.base import (
    Batching,
    Beginning,
    Linearizable,
    Motion,
    ShowingStates,
    State,
    StateMatrix,
    System,
    finite_vector,
    read_only,
)
from slide_fmu.systems.declared import Parameter, Parameters
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.function.courses import Course
from slide_fmu.systems.function.equations import Bend, ModelEquations
from slide_fmu.systems.function.equilibrium import state_matrix
from slide_fmu.systems.function.integration import EXPLICIT, Solver
from slide_fmu.systems.function.lane_trial import Points, Trial, points_around, tried
from slide_fmu.systems.function.lanes import Lane, LaneError, LaneModel, Lanes
from slide_fmu.systems.function.shown_states import FollowedByStates, acting_states
from slide_fmu.systems.function.user_function import (
    FunctionError,
    UserFunction,
    called_with,
    numbers_of,
    require_arguments,
    require_signals,
)
from slide_fmu.systems.function.whole_motion import WholeMotion

PROBED_SAMPLES = 50
"""The motion that shows how large the states become has twice as many samples."""

STIFF_CALLS, STIFF_SAMPLES = 80, 100
"""An explicit method is remarked if it calls f STIFF_CALLS times in a sample, in the mean over the
first STIFF_SAMPLES: most systems that are sampled by their bandwidth need 12 to 40."""

ONE_BY_ONE = (
    "so it is called for each motion alone, which takes many times as long. Write it "
    "for arrays of states: np.where(rate > 0, a, b) in place of if, np.sin in place of math.sin, "
    "and a list of numbers as the result"
)
"""What it means that a function accepts one state alone, and the remedy."""

Start = Sequence[float] | FloatArray | Callable[..., Any]
"""The state to look for an equilibrium from, or a function of (u, p) that gives the start."""


@final
class FunctionSystem(Linearizable, Batching, ShowingStates):
    """A FunctionSystem is a reference system made of functions: x' = f(x, u, p), y = g(x, u, p).

    States x are given and wanted as arrays (n,), inputs u as arrays (n_inputs,) in the units of
    their signals, parameters as ``p.name``. A function of (x, u, p, du) gets the rates of the
    inputs too, (n_inputs,), per second: they are constant between samples of inputs that move
    linearly (first-order hold). For g they are those of the step that ends there, 0 at the start.

    It starts at rest under its first input: at the stable equilibrium that is found from
    ``start``, or from where the system goes from there under that input; at ``start`` itself where
    none is found, which ``remarks`` then says. A function ``start(u, p)`` gives the state to start
    from under the input u, which is taken as it is.
    """

    def __init__(
        self,
        f: Callable[..., Any],
        g: Callable[..., Any],
        *,
        inputs: Sequence[Signal],
        outputs: Sequence[Signal],
        start: Start,
        step: float,
        parameters: Mapping[str, Parameter] | None = None,
        solver: Solver | None = None,
    ) -> None:
        """Take the functions; both are called once, at the start.

        Args:
            f, g: functions of (x, u, p) or (x, u, p, du) that give (n,) and (n_outputs,) numbers.
            inputs, outputs: signals in channel order.
            start: state to look for an equilibrium from, shape (n,), or a function of (u, p).
            step: sample step h in s.
            parameters: values that the functions find in p.
            solver: how f is integrated; by DOP853 if None.

        Raises:
            LoadError: a function cannot be called as it should, or gives something else.
        """
        self.inputs, self.outputs, self.step = tuple(inputs), tuple(outputs), float(step)
        require_signals(self)
        self._p, self._given_start = Parameters(**(parameters or {})), start
        if callable(start):
            require_arguments("start", start, ("u", "p"), 2)
        held = np.array([signal.start_value for signal in self.inputs])
        try:
            state = self._start(held)
            self._g = UserFunction("g", g, len(self.outputs))
            function = UserFunction("f", f, len(state))
            self._equations = ModelEquations(function, self._p, self.step, solver or Solver())
            for one in (function, self._g):
                self._require_rates(one)
                one.finite(state, read_only(held), self._p, read_only(np.zeros_like(held)))
        except SimulationError as error:
            raise LoadError(f"{error}, at the start: correct the model") from error
        self.solved_by = self.solver.method
        self.follows_rates = function.takes_rates or self._g.takes_rates
        self._advanced, self._calls = 0, 0
        self._stiff: tuple[str, ...] = ()
        self._trials: dict[tuple[str, ...], Trial] = {}
        self._showing: FunctionSystem | None = None
        self.set_state(State(state, np.zeros(0), held))

    @property
    def solver(self) -> Solver:
        """Say how f is integrated."""
        return self._equations.solver

    def with_solver(self, solver: Solver) -> FunctionSystem:
        """Return the same system at the same state, integrated in another way."""
        other = copy.copy(self)
        other._equations, other._showing = replace(self._equations, solver=solver), None
        other.solved_by = solver.method
        return other

    def over_motions(self, solver: Solver) -> WholeMotion:
        """Return the system whose motions are each integrated by one call of scipy."""
        return WholeMotion(self, self._equations, self._g, self.rest_state, solver)

    def showing_states(self) -> FunctionSystem:
        if self._showing is None:
            f, other = self._equations.function, copy.copy(self)
            acting = acting_states(f, self._g, self._points(()))
            shown = FollowedByStates(self._g, acting)
            other._g = UserFunction("g", shown, self._g.count + len(acting))
            largest = {k: float(self._sizes[k]) for k in acting}
            signals = [Signal(f"state_{k}", "", -size, size) for k, size in largest.items()]
            other.outputs = (*self.outputs, *signals)
            other._trials, other._showing = {}, other
            self._showing = other
        return self._showing

    def _require_rates(self, function: UserFunction) -> None:
        if function.takes_rates and hold_of(self.inputs) == "zero_order":
            raise LoadError(
                f"{function.name} takes du, the rates of the inputs, but these inputs are held, "
                'and jump; expected a function of (x, u, p), or hold = "first_order"'
            )

    def _start(self, held: FloatArray) -> FloatArray:
        """Give the start that the model names, shape (n,)."""
        given = self._given_start
        if callable(given):
            given = called_with("start", given, (read_only(held), self._p))
        state = numbers_of("start", given, "a list of numbers, one for each state")
        if state.ndim != 1 or not len(state) or not np.isfinite(state).all():
            raise FunctionError(
                f"start is {state.tolist()}; expected a list of finite numbers, one for each state"
            )
        return state

    @cached_property
    def _states_along(self) -> FloatArray:
        """Give states, (K, n), on a slow motion through the inputs' ranges."""
        corners = np.array([(s.start_value, s.high, s.low) for s in self.inputs])
        at = np.linspace(0, 2, 2 * PROBED_SAMPLES + 1)
        path = np.stack([np.interp(at, range(3), row) for row in corners], axis=1)
        return self._equations.states_along(self._start(path[0]), path)

    @cached_property
    def _sizes(self) -> FloatArray:
        """Tell how large the states, (n,), become on that motion.

        All sizes are positive: a state that stays 0 gets the size of the largest one.
        """
        largest = np.max(np.abs(self._states_along), axis=0)
        return np.where(largest > 0, largest, largest.max() or 1.0)

    def rest_state(self, held_input: FloatArray) -> State:
        start = self._start(held_input)
        if callable(self._given_start):
            return State(start, np.zeros(0), held_input.copy())
        at_rest = self._equations.rest(start, held_input, self._sizes)
        if at_rest is None:
            self.remarks = (
                f"no stable equilibrium was found from start = {start.tolist()} under the input "
                f"{held_input.tolist()}: motions begin at the start itself",
                *self._stiff,
            )
        return State(start if at_rest is None else at_rest, np.zeros(0), held_input.copy())

    def set_state(self, state: State) -> None:
        size = self._equations.function.count
        self._x = finite_vector("state coordinates", state.coordinates, size)
        self._u = finite_vector("state last_input", state.last_input, len(self.inputs))
        known = np.shape(state.input_rate) == np.shape(self._u)
        self._du = state.input_rate.copy() if known else np.zeros_like(self._u)

    def get_state(self) -> State:
        return State(self._x.copy(), np.zeros(0), self._u.copy(), self._du.copy())

    def output(self) -> FloatArray:
        try:
            return self._g.finite(self._x, read_only(self._u), self._p, read_only(self._du))
        except FunctionError as error:
            raise FunctionError(f"{error}; {self._place(self._u)}") from error

    def advance(self, inputs: FloatArray) -> FloatArray:
        inputs = self._finite(inputs)
        last = self._u if hold_of(self.inputs) == "first_order" else inputs

        def after() -> FloatArray:
            return self._equations.after_step(self._x, last, inputs)

        return self._advance(after, inputs, (inputs - last) / self.step)

    def advance_bending(self, points: FloatArray) -> FloatArray:
        points = np.array([self._finite(row) for row in points])
        ends = np.array([(signal.low, signal.high) for signal in self.inputs]).T
        bend = Bend.through(np.vstack([self._u, points]), self.step, ends)

        def after() -> FloatArray:
            return self._equations.after_course(self._x, bend)

        return self._advance(after, points[-1], bend(self.step)[1])

    def advance_jumping(self, inputs: FloatArray, at: FloatArray) -> FloatArray:
        if np.isnan(at).all():
            return self.advance(inputs)
        inputs, last = self._finite(inputs), self._u
        rate = np.where(np.isnan(at), (inputs - last) / self.step, 0.0)

        def after() -> FloatArray:
            return self._equations.after_jumps(self._x, last, inputs, at)

        return self._advance(after, inputs, rate)

    def most_at_once(self, varied: Collection[str] = ()) -> int:
        if self.solver.method not in EXPLICIT:
            return 1
        return self._trial(tuple(sorted(varied))).most

    def costs_as_few(self, varied: Collection[str] = ()) -> bool:
        return self.most_at_once(varied) > 1 and self._trial(tuple(sorted(varied))).refusal is None

    def _trial(self, varied: tuple[str, ...]) -> Trial:
        """Say whether f and g accept many states at once; a remark says what they refuse."""
        if varied not in self._trials:
            functions = self._equations.function, self._g
            self._refuse_lanes(varied, tried(functions, self._points(varied)))
        return self._trials[varied]

    def _points(self, varied: tuple[str, ...]) -> Points:
        """Give points at which f and g are tried."""
        states, sizes = self._states_along, self._sizes
        return points_around(states, sizes, self.inputs, self.step, self._p, varied)

    def _refuse_lanes(self, varied: tuple[str, ...], trial: Trial) -> None:
        """Keep what a trial showed, and remark it where f or g accepts one state alone."""
        self._trials[varied] = trial
        if trial.refusal is not None:
            self.remarks = (*self.remarks, f"{trial.refusal}: {ONE_BY_ONE}")

    def begin_together(
        self,
        systems: Sequence[System],
        motions: Sequence[Motion],
        varied: Collection[str] = (),
        every: int | None = None,
    ) -> list[Beginning]:
        trial, begun = self._trial(tuple(sorted(varied))), []
        for system, motion in zip(systems, motions, strict=True):
            assert isinstance(system, FunctionSystem)
            begun.append(system._begun(motion, every))
        lanes = [lane for lane in begun if lane is not None]
        if lanes:
            functions = self._equations.function, self._g
            together = trial.refusal is None
            sizes = trial.sizes[0] if trial.sizes else None
            model = LaneModel(
                *functions, self.step, self.solver, varied, trial.width, together, sizes
            )
            integrated = Lanes(model, lanes)
            try:
                integrated.run()
            except LaneError as error:
                self._refuse_lanes(tuple(sorted(varied)), Trial(str(error)))
                begun = [None] * len(begun)
            samples = sum(lane.known - 1 for lane in lanes)
            self._count_work(integrated.calls, samples)
        none = Beginning(np.empty((0, len(self.outputs))), None)
        return [none if lane is None else lane.beginning() for lane in begun]

    def _begun(self, motion: Motion, every: int | None) -> Lane | None:
        """Return a lane at the start of a motion; None where the system fails there."""
        ends = np.array([(signal.low, signal.high) for signal in self.inputs]).T
        try:
            self.set_state(motion.initial or self.rest_state(motion.first_input))
            course = Course(motion, self._u, self.step, moves(self.inputs), ends)
            return Lane(course, self._p, self.get_state(), self.output(), every)
        except SimulationError:
            return None

    def _finite(self, inputs: FloatArray) -> FloatArray:
        """Return a copy of inputs, shape (n_inputs,), which must be finite."""
        names = ", ".join(signal.name for signal in self.inputs)
        return finite_vector(f"input {names}", inputs, len(self.inputs))

    def _advance(
        self, after: Callable[[], FloatArray], inputs: FloatArray, rate: FloatArray
    ) -> FloatArray:
        """Go on by one sample step to inputs that are reached at a rate, (n_inputs,) each."""
        before = self._equations.function.calls
        try:
            self._x = after()
        except SimulationError as error:
            raise SimulationError(f"{error}; {self._place(inputs)}") from error
        self._u, self._du = np.array(inputs, dtype=np.float64), rate
        self._count_work(self._equations.function.calls - before)
        return self.output()

    def _count_work(self, calls: int, samples: int = 1) -> None:
        """Take in how often samples called f; an explicit method that works much is remarked."""
        before, self._advanced = self._advanced, self._advanced + samples
        self._calls += calls
        mean, method = self._calls / max(self._advanced, 1), self._equations.solver.method
        seen = before < STIFF_SAMPLES <= self._advanced
        if not seen or mean < STIFF_CALLS or method not in EXPLICIT:
            return
        self._stiff = (
            f"{method} calls f {mean:.3g} times in a sample, so the system is stiff or has sharp "
            'bends: an implicit solver may be many times faster, by method = "LSODA" in the file',
        )
        self.remarks = (*self.remarks, *self._stiff)

    def _place(self, inputs: FloatArray) -> str:
        """Say in which state, and under which inputs, a function failed."""
        return f"with x = {self._x.tolist()}, u = {np.asarray(inputs).tolist()}"

    def linearize(self, state: State) -> StateMatrix:
        field = self._equations.held(state.last_input)
        return StateMatrix(state_matrix(field, state.coordinates, self._sizes))
