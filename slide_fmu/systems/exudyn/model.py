"""Reference systems of the kind "exudyn" are built by a function of the user."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Annotated, Any, Literal, cast, final

import numpy as np
from pydantic import Field, ValidationError

from slide_fmu.core.mistakes import mistakes
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.toml_table import Table
from slide_fmu.systems.base import Linearizable, State
from slide_fmu.systems.declared import (
    DeclaredModel,
    DeclaredParameter,
    ModelFile,
    Parameter,
    Parameters,
    SignalTable,
    SignalTables,
    merged_parameters,
    read_declared,
)
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.exudyn.plant import INTEGRATOR_NAMES, Integrator, Plant, raised_in_exudyn
from slide_fmu.systems.exudyn.time_dependence import require_no_time
from slide_fmu.systems.exudyn.wired_system import PlantSolver, WiredPlant, WiredSystem
from slide_fmu.systems.exudyn.wires import InputTable, OutputTable
from slide_fmu.systems.specification import (
    Specification,
    chosen_outputs,
    chosen_signals,
    require_straight_inputs,
    values_text,
)
from slide_fmu.systems.user_code import imported

BUILD = "build"
"""The function that builds the model, where the recipe names no other."""


class ExudynFile(ModelFile):
    """An exudyn file says more about its signals than others, and builds the model.

    Attributes:
        build: function of an exudyn system and the parameters, which fills the system.
    """

    build: Callable[..., Any]
    inputs: Annotated[dict[str, InputTable], Field(min_length=1)]  # type: ignore[assignment]
    outputs: Annotated[dict[str, OutputTable], Field(min_length=1)]  # type: ignore[assignment]


def read_model(model: str) -> ExudynFile:
    """Read ``"file.py"``, ``"file.py:function"``, ``"package.module"`` or the like.

    Raises:
        LoadError: the module cannot be imported, or does not declare what it should.
    """
    label = f"system {model!r}"
    module, function = imported(label, model)
    build = _build_function(label, module, function or BUILD)
    return read_declared(ExudynFile, label, {**vars(module), "build": build})


def _build_function(label: str, module: ModuleType, name: str) -> Callable[..., Any]:
    """Find the function that builds the model."""
    build = getattr(module, name, None)
    remedy = f"expected a function {name}(mbs, p) that fills the exudyn system mbs"
    if not callable(build):
        raise LoadError(f"{label}: {name} = {build!r}; {remedy}: define it, or correct the name")
    signature = inspect.signature(build)
    try:
        signature.bind(None, None)
    except TypeError:
        raise LoadError(f"{label}: {name}{signature}; {remedy}: correct its arguments") from None
    return cast(Callable[..., Any], build)


class SolverTable(Table):
    """Every model has these parameters besides its own; its file may give them other defaults.

    Attributes:
        substeps: integration steps per sample step; as of ``PlantSolver`` if 0.
        integrator: how it is integrated, as of the same.
        start: where motions begin: at the static ``"equilibrium"`` under the first input if there
            is one, or at the ``"initial"`` configuration.
    """

    substeps: int = Field(default=0, ge=0)
    integrator: Literal["auto", Integrator] = "auto"
    start: Literal["equilibrium", "initial"] = "equilibrium"


SOLVER: dict[str, Parameter] = SolverTable().model_dump()
"""The parameters of every model, with the values that they have if nobody gives others."""


class _ExudynSystem(WiredSystem):
    """A system that a function of the user builds. Interface: never instantiated."""

    def __init__(self, specification: Specification) -> None:
        """Build the model and let it answer once, at its initial configuration.

        Raises:
            LoadError: the file or the model lacks something, parameters do not fit, or outputs
                depend on time.
            SimulationError: forces or outputs cannot be computed there.
        """
        file = read_model(specification.model)
        self.specification = specification
        self._parameters, self._table = _values(specification, file)
        inputs = chosen_signals("input", file.inputs, specification.inputs)
        offered = chosen_outputs(file.outputs, specification.outputs)
        outputs = chosen_signals("output", offered, specification.outputs)
        step = specification.step or file.step or specification.sample_step()
        # between samples each part of a step has its part of the integration steps
        substeps = -(-self._table.substeps // specification.part_of)
        solver = PlantSolver(step, substeps, self._table.integrator)
        super().__init__(0, inputs, outputs, solver)
        require_straight_inputs(inputs)
        model = self._built = self._build()
        self._require_integrator(model)
        self._coordinates, self._velocities = model.plant.coordinates(), model.plant.velocities()
        self._last_input = np.array([signal.start_value for signal in inputs])
        self._start = self.get_state()
        self.output()
        if model.wires.unread():  # user functions of first-order coordinates answer in a step
            self.advance(self._last_input)
            self.set_state(self._start)
        model.wires.require_readers()
        require_no_time(model, inputs, outputs)
        self.set_state(self._start)
        self.solved_by = INTEGRATOR_NAMES[model.plant.integrator]
        self.fineness = {"substeps": model.plant.substeps}

    @property
    def plant(self) -> Plant:
        """Give what integrates the model; its ``mbs`` is the exudyn system."""
        return self._model().plant

    @property
    def acts(self) -> dict[str, str]:
        """Give what every input acts on, by its name, as of ``Wires``."""
        return self._model().wires.acts

    def _fill(self, mbs: Any) -> object:
        file = read_model(self.specification.model)
        kept = file.build(mbs, Parameters(**self._parameters))
        if mbs.systemData.NumberOfObjects() == 0:
            raise LoadError(
                f"{_function(file)} added no object to mbs; expected that it fills the system "
                "that it is given: a system that it makes itself is not used"
            )
        if mbs.GetPreStepUserFunction():
            raise LoadError(
                f"{_function(file)} sets a pre-step user function; expected none, since what it "
                "does acts one substep late and no linearization sees it: let the user function "
                "of a load or connector do it"
            )
        return kept

    def _require_integrator(self, model: WiredPlant) -> None:
        """Refuse an explicit integrator that cannot do what the recipe or the file asks of it."""
        data = model.plant.mbs.systemData
        reasons = {
            "the model has constraints": data.AEsize(),
            "the model has data coordinates": data.DataSize(),
            "a parameter moves within a step": model.wires.moves_parameters,
        }
        for reason, applies in reasons.items():
            if applies and self._table.integrator == "explicit":
                raise LoadError(
                    f"integrator = 'explicit', but {reason}; expected another one: set 'auto'"
                )

    def _build(self) -> WiredPlant:
        model = super()._build()
        model.plant.has_kinks = True  # nobody knows what a user's forces look like
        return model

    def _wires(self) -> tuple[Mapping[str, InputTable], Mapping[str, OutputTable]]:
        file = read_model(self.specification.model)
        return file.inputs, {one.name: file.outputs[one.name] for one in self.outputs}

    def output(self) -> FloatArray:
        """Return what the sensors measure, shape (n_outputs,).

        Raises:
            SimulationError: a value is not finite.
        """
        values = super().output()
        for signal, value in zip(self.outputs, values, strict=True):
            if not np.isfinite(value):
                raise SimulationError(
                    f"output {signal.name!r} = {value}; expected a finite number: correct the "
                    "sensor or the model"
                )
        return values

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the static equilibrium under a constant input, shape (n_inputs,).

        It is the initial configuration with ``start = "initial"``, or where exudyn finds none,
        which ``remarks`` then say.

        Raises:
            ValueError: the input is not finite.
        """
        held = self._finite_inputs("held input", held_input)
        if self._table.start == "equilibrium":
            try:
                return super().rest_state(held)
            except SimulationError as error:
                if not self.remarks:
                    self.remarks = (
                        "motions begin at the initial configuration, since under the input "
                        f"{values_text(self.inputs, held)} {error}",
                    )
        return State(self._start.coordinates, self._start.velocities, held)


@final
class ExudynSystem(_ExudynSystem):
    """A system of exudyn with first-order or data coordinates, which is not linearized."""


@final
class LinearizableExudynSystem(_ExudynSystem, Linearizable):
    """A system of exudyn with coordinates of second order alone."""


def _values(
    specification: Specification, file: ExudynFile
) -> tuple[dict[str, Parameter], SolverTable]:
    """Give the parameters that build the model, and those that say how it is integrated."""
    label, own = f"system {specification.model!r}", file.parameters
    values = merged_parameters(label, {**SOLVER, **own}, specification.parameters)
    try:
        table = SolverTable(**{name: values[name] for name in SOLVER})  # type: ignore[arg-type]
    except ValidationError as error:
        raise LoadError(mistakes(error, label)) from error
    return {name: values[name] for name in own}, table


def _function(file: ExudynFile) -> str:
    return f"{file.build.__name__}(mbs, p)"


_ACTS = {
    "load": "is the load of its name",
    "parameter": "sets a parameter of an item",
    "variables": "is read from mbs.variables by user functions",
}
_TRIED_STEP = 0.01
"""Sample step in s with which a model is tried before there is a recipe."""


def make(specification: Specification) -> ExudynSystem | LinearizableExudynSystem:
    """Make a system from the file that builds it, as of ``read_model``.

    The recipe's parameters are those of the file and ``SOLVER``.

    Raises:
        LoadError: the file is not there or lacks something, it raises, parameters do not fit, or
            the model has no load or sensor of a name.
    """
    try:
        system = LinearizableExudynSystem(specification)
        data = system.plant.mbs.systemData
        if data.ODE1Size() + data.DataSize():
            return ExudynSystem(specification)
    except Exception as error:  # a user's model may raise anything
        if isinstance(error, LoadError) and str(error).startswith("system "):
            raise
        own = isinstance(error, LoadError | SimulationError)
        reason = str(error) if own else raised_in_exudyn(error)
        raise LoadError(f"system {specification.model!r}: {reason}") from error
    return system


def recognises(model: str) -> bool:
    """Tell whether a model is a Python file or module that defines a function ``build``.

    Raises:
        LoadError: it cannot be run.
    """
    module, function = imported(f"system {model!r}", model)
    return inspect.isfunction(vars(module).get(function or BUILD))


def describe(model: str) -> DeclaredModel:
    """Build a model and say what it declares."""
    file = read_model(model)
    inputs, outputs = _with_ranges(file.inputs), _with_ranges(file.outputs)
    step = file.step or _TRIED_STEP
    system = make(Specification(model, {}, step, "exudyn", inputs, outputs))
    remarks = [f"input {name} {_ACTS[what]}" for name, what in system.acts.items()]
    system.rest_state(np.array([signal.start_value for signal in system.inputs]))
    values = {**SOLVER, **file.parameters}
    if system.remarks:
        values["start"] = "initial"
        remarks += system.remarks
    parameters = tuple(DeclaredParameter(name, value) for name, value in values.items())
    return DeclaredModel(
        "exudyn", model, parameters, file.inputs, file.outputs, file.step, remarks=tuple(remarks)
    )


def _with_ranges(tables: SignalTables) -> dict[str, SignalTable]:
    """Give signals ranges for a first trial where the file leaves them open."""
    ranged = {}
    for name, table in tables.items():
        start = table.start or 0.0
        ends = table.range or (start - 1.0, start + 1.0)
        ranged[name] = table.model_copy(update={"range": ends})
    return ranged
