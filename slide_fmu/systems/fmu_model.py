"""Reference systems of the kind "fmu": FMUs of FMI 2.0 and 3.0, whoever made them.

Both interfaces work: co-simulation, and model exchange with fmpy's solvers. Inputs, outputs,
units, ranges and parameters are those of the model description.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.systems.base import Linearizable, State, StateMatrix, Stepping, System
from slide_fmu.systems.fmu_file import (
    PREFIX,
    FmuFile,
    FmuOptions,
    other_interface,
    read_fmu_file,
    split_options,
)
from slide_fmu.systems.fmu_record import Records
from slide_fmu.systems.fmu_solver import SolverSteps
from slide_fmu.systems.fmu_steps import CoSimulationSteps, Plan, Steps, interpolates
from slide_fmu.systems.fmu_variables import (
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
    names that begin with ``fmu-``. A model exchange FMU without events can be restored and
    linearized; of others a motion to lead in is all that is known of their states.

    Raises:
        LoadError: there is no such FMU, it does not run here, or signals or parameters do not fit.
    """
    what = f"FMU {specification.model!r}"
    options, parameters = split_options(what, specification.parameters)
    file = read_fmu_file(specification.model, options)
    require_parameters(file, parameters)
    hold = default_hold(file)
    inputs = signals_of(file, "input", specification.inputs, hold)
    outputs = signals_of(file, "output", specification.outputs, None)
    plan = Plan(file, specification.sample_step(), inputs, outputs, parameters)
    return RestorableFmu(plan) if _is_continuous(file) else SteppedFmu(plan)


def describe(model: str) -> Found:
    """Find out what an FMU says about itself.

    Raises:
        LoadError: there is no such FMU, or it does not run here.
    """
    file = read_fmu_file(model, FmuOptions())
    hold = default_hold(file)
    inputs = tuple(replace(choice, hold=hold) for choice in choices_of(file, "input"))
    outputs = choices_of(file, "output")
    return Found(
        "fmu", model, parameters_of(file), inputs, outputs, file.own_step, tuple(_remarks(file))
    )


def default_hold(file: FmuFile) -> Hold:
    """Give the hold of an FMU's inputs where a recipe names none: what costs no substeps."""
    if file.interface == "model_exchange" or interpolates(file):
        return "first_order"
    return "zero_order"


class _Recorded(Stepping):
    """What the systems of FMUs share: they begin at the FMU's own start, and go step by step."""

    def __init__(self, plan: Plan) -> None:
        self.step, self.inputs, self.outputs = plan.step, plan.inputs, plan.outputs
        self._plan = plan
        self._records = Records(self._make_steps)

    def _make_steps(self) -> Steps:
        exchanged = self._plan.file.interface == "model_exchange"
        return SolverSteps(self._plan) if exchanged else CoSimulationSteps(self._plan)

    def begin(self, held_input: FloatArray) -> None:
        """Go to the FMU's own start, initialized under an input that has always acted."""
        self._records.begin(np.asarray(held_input, dtype=np.float64))

    def output(self) -> FloatArray:
        return self._records.output()

    def advance(self, inputs: FloatArray) -> FloatArray:
        values = np.asarray(inputs, dtype=np.float64)
        if values.shape != (len(self.inputs),) or not np.isfinite(values).all():
            raise ValueError(f"inputs {values}; expected {len(self.inputs)} finite values")
        return self._records.advance(values)


class SteppedFmu(_Recorded):
    """A SteppedFmu goes on from its own start only: a co-simulation FMU, or one with events."""


class RestorableFmu(_Recorded, Linearizable):
    """A RestorableFmu is a model exchange FMU whose continuous states are all its states."""

    @property
    def _steps(self) -> SolverSteps:
        steps = self._records.steps
        assert isinstance(steps, SolverSteps)
        return steps

    def begin(self, held_input: FloatArray) -> None:
        _Recorded.begin(self, held_input)

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
        self._records.forget()

    def get_state(self) -> State:
        return State(self._steps.states(), np.empty(0), self._records.last_input.copy())

    def linearize(self, state: State) -> StateMatrix:
        """Linearize by differences of the derivatives; the current state stays as it is."""
        if not self._records.running:
            self.set_state(state)
        return StateMatrix(self._steps.state_matrix(state.coordinates, state.last_input))


def _is_continuous(file: FmuFile) -> bool:
    """Whether the continuous states are all states of an FMU, as far as its description says."""
    found = file.description
    discrete = any(
        v.variability == "discrete" and v.causality in ("local", "output")
        for v in found.modelVariables
    )
    return (
        file.interface == "model_exchange"
        and found.numberOfContinuousStates > 0
        and found.numberOfEventIndicators == 0
        and not discrete
    )


def _remarks(file: FmuFile) -> list[str]:
    """Say what is assumed about an FMU."""
    kind = file.interface.replace("_", " ")
    remarks = [f"{kind} of FMI {file.description.fmiVersion}"]
    other = other_interface(file)
    if other is not None:
        remarks[0] += f'; {PREFIX}interface = "{other}" would take the other one'
    if file.interface == "model_exchange":
        remarks.append(
            "fmpy's CVode integrates it, with inputs that move linearly from sample to sample"
        )
        remarks.append(
            "it has no events, so its continuous states are all its states"
            if _is_continuous(file)
            else "it has events or discrete states: a motion to lead in makes up for its states"
        )
    elif interpolates(file):
        remarks.append("its inputs move linearly from sample to sample, by input derivatives")
    else:
        remarks.append(
            'its inputs are held over each step; hold = "first_order" lets them move linearly, as '
            f"{file.options.substeps} stairs ({PREFIX}substeps), each a step of the FMU"
        )
    if file.type.needsExecutionTool:
        remarks.append("it needs the tool that made it")
    return remarks
