"""This module makes reference systems of the kind "fmu" from FMUs of FMI 2.0 and 3.0.

Both interfaces work: co-simulation, and model exchange with fmpy's solvers. Inputs, outputs,
units, ranges and parameters are those of the model description.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

import numpy as np

from slide_fmu.core.signals import FloatArray, Hold, hold_of
from slide_fmu.importer.description import (
    experiment,
    is_multiple,
    named_step,
    offered_interfaces,
    start_time,
)
from slide_fmu.systems.base import (
    BegunLater,
    Jumping,
    Linearizable,
    State,
    StateMatrix,
    System,
    finite_vector,
)
from slide_fmu.systems.declared import DeclaredModel
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.fmu.file import (
    PREFIX,
    FmuFile,
    FmuOptions,
    read_fmu_file,
    split_options,
)
from slide_fmu.systems.fmu.repeated_runs import FAILURES, LEAD_IN, Runs
from slide_fmu.systems.fmu.solver import TOLERANCE, SolverSteps
from slide_fmu.systems.fmu.steps import CoSimulationSteps, FmuSteps, Plan
from slide_fmu.systems.fmu.variables import (
    limits_of,
    parameters_of,
    remarks_on_variables,
    require_parameters,
    signals_of,
    tables_of,
)
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
    label = f"FMU {specification.model!r}"
    options, parameters = split_options(label, specification.parameters)
    # between samples each part of a step has its part of the stairs
    substeps = -(-options.substeps // specification.part_of)
    options = options.model_copy(update={"substeps": substeps})
    file = read_fmu_file(specification.model, options)
    require_parameters(file, parameters)
    hold = _default_hold(file)
    inputs = signals_of(file, "input", specification.inputs, hold)
    outputs = signals_of(file, "output", specification.outputs, None)
    plan = Plan(file, specification.sample_step(), inputs, outputs, parameters)
    _require_whole_steps(label, plan)
    return RestorableFmu(plan) if file.is_continuous else SteppedFmu(plan)


def _require_whole_steps(label: str, plan: Plan) -> None:
    """Refuse steps of an importer that do not fill a sample step, or that nobody takes."""
    file, told = plan.file, plan.file.options.step
    if told is not None and file.interface != "co_simulation":
        raise LoadError(
            f"{label}: fmu-step = {told:g} with model exchange; expected co-simulation, whose "
            "inputs are held over steps: remove fmu-step"
        )
    own = file.importer_step
    if own is None and not file.takes_any_step:
        raise LoadError(
            f"{label} takes steps of one length alone (canHandleVariableCommunicationStepSize), "
            "and does not name it; expected this step in s: give fmu-step = SECONDS in "
            "system.parameters (init --fmu-step SECONDS)"
        )
    declared = None if file.takes_any_step else named_step(file.description)
    if told is not None and declared is not None and not is_multiple(told, declared):
        raise LoadError(
            f"{label}: fmu-step = {told:g} s; expected a multiple of {declared:g} s, since it "
            "takes no other steps (canHandleVariableCommunicationStepSize)"
        )
    if own is not None and not is_multiple(plan.step, own):
        key = "the FMU's only step" if told is None else "fmu-step"
        raise LoadError(
            f"{label}: {key} = {own:g} s, of which {plan.step / own:.6g} fill {plan.step:g} s; "
            "expected a whole number in window.step, and in the part of it that data.substeps "
            "makes: change one of the three"
        )


def recognises(model: str) -> bool:
    """Tell whether a model is an FMU, by its name."""
    return model.endswith(".fmu")


def describe(model: str) -> DeclaredModel:
    """Return the declarations of an FMU.

    Raises:
        LoadError: there is no such FMU, or it does not run here.
    """
    file = read_fmu_file(model, FmuOptions())
    inputs = tables_of(file, "input")
    hold = _proposed_hold(file, inputs)
    return DeclaredModel(
        "fmu",
        model,
        parameters_of(file),
        {name: table.model_copy(update={"hold": hold}) for name, table in inputs.items()},
        tables_of(file, "output"),
        file.own_step,
        file.held_step if hold == "first_order" else None,
        file.takes_any_step,
        _remarks_on(file),
        inputs_may_be_left_out=True,
        limits=limits_of(file),
    )


def _solver_of(plan: Plan) -> tuple[str, dict[str, float]]:
    """Name what integrates an FMU, and the options that say how finely it does."""
    options, file = plan.file.options, plan.file
    tolerance, substeps = f"{PREFIX}tolerance", f"{PREFIX}substeps"
    if file.interface == "model_exchange":
        if options.solver == "Euler":
            return "Euler's method", {substeps: options.substeps}
        return options.solver, {tolerance: options.tolerance or TOLERANCE}
    fineness: dict[str, float] = {}
    experiment = getattr(file.description.defaultExperiment, "tolerance", None)
    if own := options.tolerance or float(experiment or 0.0):
        fineness[tolerance] = own
    if plan.ramped and not file.interpolates and file.importer_step is None:
        fineness[substeps] = options.substeps
    return "the FMU's own solver", fineness


class FmuSystem(Jumping, BegunLater):
    """An FmuSystem is an FMU that begins at its own start, and goes step by step.

    Interface: never instantiated.

    Attributes:
        plan: how the FMU is simulated.
    """

    may_crash = True

    def __init__(self, plan: Plan) -> None:
        self.step, self.inputs, self.outputs = plan.step, plan.inputs, plan.outputs
        self.input_remark = _remark_on_inputs(plan.file, hold_of(plan.inputs))
        self.remarks = (*_remarks_on(plan.file), self.input_remark)
        self.own_step = plan.file.held_step
        self.holds_inputs_over_own_step = (
            plan.file.interface == "co_simulation" and not plan.file.interpolates
        )
        self.plan = plan
        self.solved_by, self.fineness = _solver_of(plan)
        self._runs = Runs(self._make_steps)

    def begun_later(self, samples: int) -> System:
        return type(self)(replace(self.plan, later=samples))

    def _make_steps(self) -> FmuSteps:
        exchanged = self.plan.file.interface == "model_exchange"
        return SolverSteps(self.plan) if exchanged else CoSimulationSteps(self.plan)

    def begin(self, held_input: FloatArray) -> None:
        """Go to the FMU's own start, initialized under an input that has always acted."""
        self._runs.begin(np.asarray(held_input, dtype=np.float64))

    def output(self) -> FloatArray:
        return self._runs.output()

    def advance(self, inputs: FloatArray) -> FloatArray:
        return self._runs.advance(finite_vector("inputs", inputs, len(self.inputs)))

    def jump(self, inputs: FloatArray) -> None:
        self._runs.jump(finite_vector("inputs", inputs, len(self.inputs)))


class SteppedFmu(FmuSystem):
    """A SteppedFmu goes on from its own start only: a co-simulation FMU, or one with events."""


class RestorableFmu(FmuSystem, Linearizable):
    """A RestorableFmu is a model exchange FMU whose continuous states are all its states."""

    @property
    def _steps(self) -> SolverSteps:
        steps = self._runs.steps
        assert isinstance(steps, SolverSteps)
        return steps

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
                f"FMU {self.plan.file.path.name!r} cannot be linearized: {error}; expected "
                "derivatives as its description says: ask who made it, or take its co-simulation "
                "interface if it has one (fmu-interface)"
            ) from error
        return StateMatrix(matrix)


def _default_hold(file: FmuFile) -> Hold:
    """Give the hold of an FMU's inputs where a recipe names none: what costs no substeps."""
    if file.interface == "model_exchange" or file.interpolates:
        return "first_order"
    return "zero_order"


def _proposed_hold(file: FmuFile, inputs: Container[str]) -> Hold:
    """Give the hold that a first recipe names: inputs move, unless one of these is discrete.

    An FMU steps more finely than its surrogate, and smooth inputs that are held over the longer
    steps would be late by half of one.
    """
    variables = file.description.modelVariables
    discrete = any(v.name in inputs and v.variability == "discrete" for v in variables)
    return "zero_order" if discrete else "first_order"


def _remarks_on(file: FmuFile) -> tuple[str, ...]:
    """Say how an FMU is simulated, one sentence each; of its inputs ``_remark_on_inputs`` does."""
    version = file.description.fmiVersion
    kind = "co-simulation" if file.interface == "co_simulation" else "model exchange"
    other = next((i for i in offered_interfaces(file.description) if i != file.interface), None)
    other_one = f'; {PREFIX}interface = "{other}" takes the other one' if other else ""
    remarks = [f"the FMU is used for {kind}, FMI {version}{other_one}"]
    if file.interface == "model_exchange":
        solver = f"fmpy's {file.options.solver} integrates it, anew from each sample on"
        states = (
            "its continuous states are all its states"
            if file.is_continuous
            else "it has events or discrete states, so a motion leads in instead of initial states"
        )
        remarks += [solver, states]
    else:
        remarks.append("its states are not known: a motion leads in instead of initial states")
    start, stop = start_time(file.description), experiment(file.description, "stopTime")
    if start != 0.0:
        remarks.append(f"each motion begins at {start:g} s, its own startTime")
    if stop is not None:
        remarks.append(
            f"its default experiment ends at {stop:g} s (stopTime): if it goes no further, longer "
            f"motions are joined of several, each of which leads in over {LEAD_IN:.0%} of this"
        )
    if file.offer.needsExecutionTool:
        remarks.append("it needs the tool that made it where it is simulated")
    return (*remarks, *remarks_on_variables(file))


def _remark_on_inputs(file: FmuFile, hold: Hold) -> str:
    """Say how inputs of a hold act between samples, and what that takes."""
    own, told = file.importer_step, file.options.step is not None
    if hold == "zero_order":
        hint = 'hold = "first_order" in system.inputs lets them move linearly'
        by = "" if own is None else f", in which the FMU does steps of {own:g} s"
        return f"its inputs are held over each sample step{by}; {hint}"
    way = "its inputs move linearly from sample to sample"
    if file.interface == "model_exchange":
        return way
    if told:
        return (
            f"its inputs are held over each of its steps of {own:g} s, as they are when it begins "
            f"({PREFIX}step)"
        )
    if file.interpolates:
        return f"{way}, by their derivatives"
    stairs = f"as {file.options.substeps} stairs, each a step of the FMU ({PREFIX}substeps)"
    if own is not None:
        stairs = f"as stairs, each a step of the FMU of {own:g} s, which takes no other ones"
    return (
        f"{way}, {stairs}; "
        "outputs that it computes from its inputs in its steps see the middle of the last stair. "
        "Where it is run by steps over which its inputs are held, it is late by half a step: "
        f"{PREFIX}step = SECONDS (init --fmu-step) makes a surrogate of that"
    )
