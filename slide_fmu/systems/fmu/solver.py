"""A model exchange FMU is integrated from sample to sample by fmpy's solvers."""

from __future__ import annotations

import math
from ctypes import c_double
from typing import Any, final

import numpy as np
from fmpy.simulation import ForwardEuler
from fmpy.sundials import CVodeSolver

from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.systems.fmu.steps import FmuSteps, Plan
from slide_fmu.systems.function.equilibrium import state_matrix

TOLERANCE = 1e-8
"""Relative tolerance of CVode where none is given: it starts anew at every sample, so 1e-6 is
hardly faster."""

MOST_PARTS = 10_000
"""An FMU with more events within one sample step is stopped: it does not come to an end."""

ENDED = "the FMU asks for the end of the simulation"


class StoppedError(RuntimeError):
    """An FMU does not go on, although its calls report no error."""


class _CVode(CVodeSolver):  # type: ignore[misc]  # fmpy has no types
    """This CVode of fmpy learns when the FMU cannot evaluate its equations."""

    failure: CoSimulationError | None = None

    def f(self, t: float, y: Any, ydot: Any, user_data: Any) -> int:
        try:
            return int(super().f(t, y, ydot, user_data))
        except CoSimulationError as error:  # it would be lost on its way through CVode
            self.failure = error
            return 1  # "recoverable": CVode tries a shorter step

    def g(self, t: float, y: Any, gout: Any, user_data: Any) -> int:
        try:
            return int(super().g(t, y, gout, user_data))
        except CoSimulationError as error:
            self.failure = error
            return -1


@final
class SolverSteps(FmuSteps):
    """The equations of the FMU are integrated here; events are handled.

    The solver begins anew at every sample, so that states alone tell how a motion goes on.
    """

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan)
        self._solver: Any = None
        self._time, self._next_event = self.time(0), math.inf
        self._reached = np.zeros(len(plan.inputs))
        self._move(self._time, np.zeros(len(plan.inputs)))

    def begin(self, held: FloatArray) -> None:
        self._time = self.time(0)
        self._move(self._time, held)
        self._update_discrete_states()
        self._solver = self._make_solver()

    def advance(self, number: int, before: FloatArray, now: FloatArray) -> None:
        begin, end = self.time(number), self.time(number + 1)
        if self.plan.ramped:
            jumped = number > 0 and not np.array_equal(before, self._reached)
            self._move(begin, before, (now - before) / self.plan.step)
            if jumped:
                self._handle_event(begin)
            self._reached = now
        else:
            self._move(begin, now)
            self._handle_event(begin)
        self._solver.reset(begin)
        self._time = begin
        for _ in range(MOST_PARTS):
            if self._time >= end or math.isclose(self._time, end, rel_tol=1e-12):
                break
            self._go_on(end)
        else:
            raise StoppedError(f"more than {MOST_PARTS} events within one sample step")
        self._set_time(end)

    def _move(self, begin: float, value: FloatArray, slope: FloatArray | None = None) -> None:
        """Let the inputs move from a time and value on; they stay there without a slope."""
        moved = np.zeros_like(value) if slope is None else slope
        self._way = begin, list(zip(value.tolist(), moved.tolist(), strict=True))

    def _go_on(self, end: float) -> None:
        """Integrate up to the next event or the end of the sample step, and handle the event."""
        options, offer = self.plan.file.options, self.plan.file.offer
        target = min(end, max(self._next_event, self._time))
        if options.solver == "Euler":
            target = min(target, self._time + self.plan.step / options.substeps)
        happened = terminate = False
        if target > self._time:
            happened = self._integrate(target)
        self._set_time(self._time)
        if getattr(offer, "needsCompletedIntegratorStep", False):
            wanted, terminate = self.instance.calls.completedIntegratorStep()
            happened = happened or wanted
        if terminate:
            raise StoppedError(ENDED)
        if happened or self._time >= self._next_event:
            self._handle_event(self._time)
            self._solver.reset(self._time)

    def _integrate(self, target: float) -> bool:
        """Integrate to a time, or to an event before; give whether there was one."""
        solver = self._solver
        solver.failure = None
        try:
            happened, _, self._time = solver.step(self._time, target)
        except RuntimeError as error:
            raise solver.failure or error from error
        return bool(happened)

    def _handle_event(self, time: float) -> None:
        self.instance.calls.enterEventMode()
        self._set_inputs(time)
        self._update_discrete_states()

    def _update_discrete_states(self) -> None:
        """Go from event mode to continuous-time mode."""
        calls = self.instance.calls
        update = calls.updateDiscreteStates if self.plan.file.fmi_3 else calls.newDiscreteStates
        for _ in range(MOST_PARTS):
            more, terminate, _, _, timed, event_time = update()
            if terminate:
                raise StoppedError(ENDED)
            if not more:
                break
        self._next_event = event_time if timed else math.inf
        calls.enterContinuousTimeMode()

    def _set_time(self, time: float) -> None:
        self.instance.calls.setTime(time)
        self._set_inputs(time)

    def _set_inputs(self, time: float) -> None:
        begin, ways = self._way  # plain numbers: this is done at every evaluation
        self.inputs.set([value + (time - begin) * slope for value, slope in ways])

    def apply(self, time: float) -> None:
        """Set the inputs that belong to a time; fmpy's solvers call it."""
        self._set_inputs(time)

    def _make_solver(self) -> Any:
        calls, options = self.instance.calls, self.plan.file.options
        given = {
            "nx": self.plan.file.description.numberOfContinuousStates,
            "nz": self.plan.file.description.numberOfEventIndicators,
            "get_x": calls.getContinuousStates,
            "set_x": calls.setContinuousStates,
            "get_dx": self._derivatives,
            "get_z": calls.getEventIndicators,
            "input": self,
        }
        if options.solver == "Euler":
            return ForwardEuler(**given)
        return _CVode(
            **given,
            get_nominals=calls.getNominalsOfContinuousStates,
            set_time=self._set_time,
            startTime=self.time(0),
            maxStep=self.plan.step,
            relativeTolerance=options.tolerance or TOLERANCE,
            maxNumSteps=MOST_PARTS,
        )

    @property
    def _derivatives(self) -> Any:
        """fmpy's function that gives the derivatives of the continuous states."""
        calls = self.instance.calls
        return (
            calls.getContinuousStateDerivatives if self.plan.file.fmi_3 else calls.getDerivatives
        )

    def start_at(self, states: FloatArray) -> None:
        """Go on from other continuous states, shape (n_states,)."""
        self.instance.calls.setContinuousStates((c_double * len(states))(*states), len(states))

    def states(self) -> FloatArray:
        """Give the continuous states, shape (n_states,)."""
        return self._got(self.instance.calls.getContinuousStates)

    def state_matrix(self, states: FloatArray, inputs: FloatArray) -> FloatArray:
        """Give df/dx in 1/s at states, (n_states,), and inputs, (n_inputs,).

        The FMU tells it where it can; else it is found by differences of f. The motion goes on
        where it was. The shape is (n_states, n_states).
        """
        before = self.states()
        self.inputs.set(inputs.tolist())
        self.start_at(states)
        file = self.plan.file
        if not file.fmi_3 and file.offer.providesDirectionalDerivative:  # fmpy hides it in FMI 3.0
            matrix = self._given_matrix(len(states))
        else:
            nominals = self._got(self.instance.calls.getNominalsOfContinuousStates)
            matrix = state_matrix(self._rates, states, nominals)
        self.start_at(before)
        self._set_inputs(self._time)
        return matrix

    def _given_matrix(self, count: int) -> FloatArray:
        """Give df/dx as the FMU gives it: a directional derivative along each state."""
        rates = [unknown.variable for unknown in self.plan.file.description.derivatives]
        unknowns = [rate.valueReference for rate in rates]
        knowns = [rate.derivative.valueReference for rate in rates]
        tell = self.instance.calls.getDirectionalDerivative
        return np.array([tell(unknowns, knowns, row) for row in np.eye(count)]).T

    def _rates(self, states: FloatArray) -> FloatArray:
        """Give f at states, shape (n_states,), which the FMU then has."""
        self.start_at(states)
        return self._got(self._derivatives)

    def _got(self, function: Any) -> FloatArray:
        """Give one value for each continuous state, from a function of fmpy."""
        count = self.plan.file.description.numberOfContinuousStates
        values = (c_double * count)()
        function(values, count)
        return np.array(values, dtype=np.float64)
