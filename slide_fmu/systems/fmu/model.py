"""Reference systems of the kind "fmu": FMUs of FMI 2.0 and 3.0, whoever made them.

Both interfaces work: co-simulation, and model exchange with fmpy's solvers. Inputs, outputs,
units, ranges and parameters are those of the model description.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.systems.base import Linearizable, State, StateMatrix, Stepping, System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.fmu.file import FmuOptions, read_fmu_file, split_options
from slide_fmu.systems.fmu.remarks import (
    default_hold,
    is_continuous,
    proposed_hold,
    remark_on_inputs,
    remarks_on,
)
from slide_fmu.systems.fmu.runs import FAILURES, Runs
from slide_fmu.systems.fmu.solver import SolverSteps
from slide_fmu.systems.fmu.steps import CoSimulationSteps, Plan, Steps, interpolates
from slide_fmu.systems.fmu.variables import (
    choices_of,
    parameters_of,
    require_parameters,
    signals_of,
)
from slide_fmu.systems.found import Found
from slide_fmu.systems.specification import Specification


def make(specification: Specification) -> System:
    """Make a system from the path of an FMU; its library is loaded when it is first simulated.

    Inputs and outputs are those that the specification names, in its order, or all real ones. Its
    parameters are those of the FMU, values of inputs that are no signals, and ``FmuOptions`` under
    names that start with ``fmu-``. A model exchange FMU without events can be restored and
    linearized; of others a motion to lead in is all that is known of their states.

    Raises:
        LoadError: there is no such FMU, it does not run here, or signals or parameters do not fit.
    """
    what = f"FMU {specification.model!r}"
    options, parameters = split_options(what, specification.parameters)
    # between samples each part of a step has its part of the stairs
    substeps = -(-options.substeps // specification.part_of)
    options = replace(options, substeps=substeps)
    file = read_fmu_file(specification.model, options)
    require_parameters(file, parameters)
    hold = default_hold(file)
    inputs = signals_of(file, "input", specification.inputs, hold)
    outputs = signals_of(file, "output", specification.outputs, None)
    plan = Plan(file, specification.sample_step(), inputs, outputs, parameters)
    _require_whole_steps(what, plan)
    return RestorableFmu(plan) if is_continuous(file) else SteppedFmu(plan)


def _require_whole_steps(what: str, plan: Plan) -> None:
    """Refuse steps of an importer that do not fill a sample step, or that nobody takes."""
    own = plan.file.options.step
    if own is None:
        return
    if plan.file.interface != "co_simulation":
        raise LoadError(
            f"{what}: fmu-step = {own:g} with model exchange; expected co-simulation, whose "
            "inputs are held over steps: remove fmu-step"
        )
    if not math.isclose(plan.stairs * own, plan.step, rel_tol=1e-6):
        raise LoadError(
            f"{what}: fmu-step = {own:g} s, of which {plan.step / own:.6g} fill {plan.step:g} s; "
            "expected a whole number in window.step, and in the part of it that data.substeps "
            "makes: change one of the three"
        )


def recognises(model: str) -> bool:
    """Tell whether a model is an FMU, by its name."""
    return model.endswith(".fmu")


def describe(model: str) -> Found:
    """Find out what an FMU says about itself.

    Raises:
        LoadError: there is no such FMU, or it does not run here.
    """
    file = read_fmu_file(model, FmuOptions())
    choices = choices_of(file, "input")
    hold = proposed_hold(file, {choice.name for choice in choices})
    return Found(
        "fmu",
        model,
        parameters_of(file),
        tuple(replace(choice, hold=hold) for choice in choices),
        choices_of(file, "output"),
        file.own_step,
        file.held_step if hold == "first_order" else None,
        remarks_on(file),
        inputs_may_be_left_out=True,
    )


class FmuSystem(Stepping):
    """An FmuSystem is an FMU that begins at its own start, and goes step by step.

    Interface: never instantiated.

    Attributes:
        climbs: whether its steps hold their inputs, so that moving ones are stairs.
    """

    may_crash = True

    def __init__(self, plan: Plan) -> None:
        self.step, self.inputs, self.outputs = plan.step, plan.inputs, plan.outputs
        self.input_remark = remark_on_inputs(plan.file, hold_of(plan.inputs))
        self.remarks = (*remarks_on(plan.file), self.input_remark)
        self.own_step = plan.file.held_step
        self.climbs = plan.file.interface == "co_simulation" and not interpolates(plan.file)
        self._plan = plan
        self._runs = Runs(self._make_steps)

    def _make_steps(self) -> Steps:
        exchanged = self._plan.file.interface == "model_exchange"
        return SolverSteps(self._plan) if exchanged else CoSimulationSteps(self._plan)

    def slave(self, settable: Collection[str] = ()) -> Path:
        """Give the file of the FMU, which runs by itself in a co-simulation as it is here.

        Args:
            settable: parameters that the importer sets; all others have their start values.

        Raises:
            LoadError: it does not run so, since SSP 1.0 knows co-simulation FMUs of FMI 2.0 alone,
                or it has other parameters here than its start values.
        """
        file, parameters = self._plan.file, sorted(set(self._plan.parameters) - set(settable))
        if file.interface == "co_simulation" and not file.fmi_3 and not parameters:
            return file.path
        raise LoadError(
            f"FMU {file.path.name!r} of FMI {file.description.fmiVersion}, used for "
            f"{file.interface}, with parameters {parameters}; expected a co-simulation FMU of FMI "
            "2.0 without parameters, to run as reference beside a surrogate: export the model so, "
            "with its parameters as start values"
        )

    def begin(self, held_input: FloatArray) -> None:
        """Go to the FMU's own start, initialized under an input that has always acted."""
        self._runs.begin(np.asarray(held_input, dtype=np.float64))

    def output(self) -> FloatArray:
        return self._runs.output()

    def advance(self, inputs: FloatArray) -> FloatArray:
        values = np.asarray(inputs, dtype=np.float64)
        if values.shape != (len(self.inputs),) or not np.isfinite(values).all():
            raise ValueError(f"inputs {values}; expected {len(self.inputs)} finite values")
        return self._runs.advance(values)


class SteppedFmu(FmuSystem):
    """A SteppedFmu goes on from its own start only: a co-simulation FMU, or one with events."""


class RestorableFmu(FmuSystem, Linearizable):
    """A RestorableFmu is a model exchange FMU whose continuous states are all its states."""

    @property
    def _steps(self) -> SolverSteps:
        steps = self._runs.steps
        assert isinstance(steps, SolverSteps)
        return steps

    def begin(self, held_input: FloatArray) -> None:
        FmuSystem.begin(self, held_input)

    def rest_state(self, held_input: FloatArray) -> State:
        """Give the FMU's own start under an input that has always acted."""
        self.begin(held_input)
        return self.get_state()

    def set_state(self, state: State) -> None:
        """Go on from continuous states, at time 0, with the next ``advance``."""
        self.begin(state.last_input)
        if state.coordinates.shape != self._steps.states().shape:
            raise ValueError(
                f"state of {state.coordinates.size} values; expected "
                f"{self._steps.states().size}, the FMU's continuous states"
            )
        self._steps.start_at(state.coordinates)
        self._runs.forget()

    def get_state(self) -> State:
        return State(self._steps.states(), np.empty(0), self._runs.last_input.copy())

    def linearize(self, state: State) -> StateMatrix:
        """Linearize as the FMU tells, else by differences; the current state stays as it is.

        Raises:
            SimulationError: the FMU cannot tell its derivatives.
        """
        if not self._runs.running:
            self.set_state(state)
        try:
            matrix = self._steps.state_matrix(state.coordinates, state.last_input)
        except FAILURES as error:
            raise SimulationError(
                f"FMU {self._plan.file.path.name!r} cannot be linearized: {error}; expected "
                "derivatives as its description says: ask who made it, or take its co-simulation "
                "interface if it has one (fmu-interface)"
            ) from error
        return StateMatrix(matrix)
