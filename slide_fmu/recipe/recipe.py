"""Typed recipes say what to simulate, learn and release; they are read from a TOML file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from slide_fmu.core.parameters import Parameter
from slide_fmu.excitation.base import PositiveRange
from slide_fmu.excitation.mix import Excitation
from slide_fmu.recipe.automatic import LENGTHS, with_guesses
from slide_fmu.recipe.default_excitation import InputKind, default_excitation
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.learning import (
    METHODS,
    LeastSquaresRecipe,
    NetworkTable,
    PositiveFloat,
    PositiveInt,
    StateSpaceRecipe,
    Table,
    TrainingTable,
)
from slide_fmu.recipe.measured import (
    KIND,
    Part,
    is_measured,
    require_fitting_tables,
    require_no_numbers,
)
from slide_fmu.recipe.parameters import (
    ParameterRecipe,
    require_parameters,
    with_iterations,
)
from slide_fmu.recipe.specimens import with_division
from slide_fmu.recipe.system import SystemRecipe

SPLITS = ("train", "validation", "estimator", "estimator_validation", "beyond")
"""Trajectories that are kept. Test trajectories are drawn anew for every validation."""

NAME = r"^[A-Za-z][A-Za-z0-9_]*$"
"""The name of a recipe is a C identifier, since its FMU has it."""


class RecipeError(ValueError):
    """A recipe cannot be used; the message holds one line per mistake."""


class WindowRecipe(Table):
    """The table ``window`` says what the network sees and gives.

    Attributes:
        step: sample step h in s.
        n_in: number of input samples; found from the decay time if ``"auto"`` or not given.
        n_out: number of output samples; follows ``n_in`` if ``"auto"`` or not given.
        inputs: what an importer of the FMU sets inputs with a first-order hold to before a step,
            unless it sets the parameter ``inputs_at_step_end``: ``"now"``, what they are at its
            begin, so that the FMU forecasts what they do within it; or ``"step_end"``, what they
            reach by its end, which suits set points that are known ahead.
        remaining_amplitude: fraction to which initial effects must have decayed.
        allow_short: whether a window is accepted that is too short for the system.
    """

    step: PositiveFloat
    n_in: PositiveInt
    n_out: PositiveInt
    inputs: Literal["now", "step_end"] = "now"
    remaining_amplitude: float = Field(0.01, gt=0, lt=1)
    allow_short: bool = False

    @model_validator(mode="after")
    def _fits(self) -> WindowRecipe:
        if self.n_out > self.n_in:
            raise ValueError(f"n_out = {self.n_out}; expected at most n_in = {self.n_in}")
        return self


class DataRecipe(Table):
    """The table ``data`` describes the trajectories and their excitation.

    Attributes:
        seed: entropy of every trajectory's own seed.
        duration: length of a trajectory in s, after the burn-in; from the window if ``"auto"`` or
            not given.
        burn_in: time in s that a random initial state is given to decay; not stored; one window
            if ``"auto"`` or not given.
        train, validation: numbers of trajectories; found from a learning curve if ``"auto"`` or
            not given.
        estimator, estimator_validation: those of the error estimator, if there is one; likewise.
        budget_minutes: time for the learning curve and its data; it ends before a doubling that
            would take longer. No limit if not given.
        beyond: number of trajectories beyond the range; a state-space network learns from them
            too, with a low weight, so that it stays sensible there.
        beyond_factor: range of the factor on their excitation.
        most_failures: part of all trajectories that may fail to be simulated; another draw takes
            the place of each. One is always allowed.
        excitation: kinds of excitation with their weights; a mix that follows from the step if
            not given. There are none of records.
        shares: of records, what part of all samples each of ``slide_fmu.recipe.measured.PARTS``
            has; defaults if not given.
        by: of records, whether they are divided by contiguous ``"block"`` in the order of time,
            of all files end to end or of ``"each"`` by itself (the default with physical
            parameters), by whole ``"record"``, or by whole ``"period"`` of inputs that repeat.
    """

    seed: int = Field(default=0, ge=0)
    duration: PositiveFloat
    burn_in: float = Field(ge=0, allow_inf_nan=False)
    train: PositiveInt
    validation: PositiveInt
    estimator: int = Field(0, ge=0)
    estimator_validation: int = Field(0, ge=0)
    budget_minutes: PositiveFloat | None = None
    beyond: int = Field(default=0, ge=0)
    beyond_factor: PositiveRange = (1.0, 3.0)
    most_failures: float = Field(default=0.02, ge=0, le=1)
    excitation: tuple[Excitation, ...] = ()
    shares: dict[Part, Annotated[float, Field(ge=0, le=1)]] = Field(default={})
    by: Literal["block", "each", "record", "period"] = "block"


class ValidationRecipe(Table):
    """The table ``validation`` describes unseen trajectories on which an FMU is measured.

    Attributes:
        trajectories: their number.
        duration: length of each in s, after the burn-in; as in the training data if not given.
    """

    trajectories: PositiveInt = 50
    duration: PositiveFloat | None = None


class StabilityRecipe(Table):
    """The table ``stability`` says what a state-space network must keep to before it is exported.

    Attributes:
        amplitudes: factors on the trained amplitude at which it is tested.
        growth: boundedness: largest deviation of an output from its mean allowed, relative to the
            largest one at the trained amplitude times the factor.
        contraction: fading memory: largest difference allowed between two runs from different
            states, after the inputs of one window, relative to the output's standard deviation.
        contraction_beyond: the same beyond the trained amplitude, for the median run: systems may
            have several lasting responses there.
        allow_unstable: whether a network that fails is exported all the same.
    """

    amplitudes: tuple[PositiveFloat, ...] = Field(default=(1.0, 2.0, 4.0, 10.0), min_length=1)
    growth: PositiveFloat = 10.0
    contraction: PositiveFloat = 0.02
    contraction_beyond: PositiveFloat = 0.5
    allow_unstable: bool = False


class Recipe(Table):
    """A recipe is everything that makes a surrogate.

    Attributes:
        name: C identifier; names the run, the surrogate and the FMU.
        description: one line for people.
        equations: equations of motion and parameters, for the model card.
        parameters: physical parameters that users of the FMU may set, by name.
        automatic: keys that the recipe leaves to be found (``"window.n_in"``); they hold first
            guesses until ``with_resolved``, and nothing is learnt before. No key of a file.
    """

    name: str = Field(pattern=NAME)
    description: str
    equations: str = ""
    system: SystemRecipe
    window: WindowRecipe
    data: DataRecipe
    network: NetworkTable = StateSpaceRecipe()
    training: TrainingTable = LeastSquaresRecipe()
    estimator: EstimatorRecipe | None = None
    stability: StabilityRecipe = StabilityRecipe()
    validation: ValidationRecipe = ValidationRecipe()
    parameters: dict[str, ParameterRecipe] = Field(default={})
    automatic: tuple[str, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _guess_what_is_automatic(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        return with_division(with_iterations(with_guesses(values)))

    @model_validator(mode="after")
    def _parameters_can_be_learnt(self) -> Recipe:
        require_parameters(self)
        return self

    def physical(self) -> tuple[Parameter, ...]:
        """Return the parameters that users of the FMU may set, in their order."""
        return tuple(table.parameter(name) for name, table in self.parameters.items())

    def at(self, values: Mapping[str, float]) -> Recipe:
        """Return the recipe for fixed values of its parameters, which need not be in their ranges.

        Its system has them; it has no parameters any more.
        """
        fixed = {**self.system.parameters, **values}
        system = self.system.model_copy(update={"parameters": fixed})
        return self.model_copy(update={"system": system, "parameters": {}})

    @model_validator(mode="before")
    @classmethod
    def _methods_follow_families(cls, values: Any) -> Any:
        """``network = "state_space"`` is short for its table; each family has its method."""
        if not isinstance(values, dict):
            return values
        network, training = values.get("network", {}), values.get("training", {})
        if isinstance(network, str):
            network = {"family": network}
        if not isinstance(network, dict):  # one mistake, not those of the training too
            return {**values, "training": LeastSquaresRecipe()}
        if not isinstance(training, dict):
            return {**values, "network": {"family": "state_space", **network}}
        network = {"family": "state_space", **network}
        method = METHODS.get(str(network["family"]))
        if method is None:
            return {**values, "network": network, "training": LeastSquaresRecipe()}
        given = training.get("method", method)
        if given != method:
            raise ValueError(
                f"training.method = {given!r}; expected {method!r} for network.family = "
                f"{network['family']!r}"
            )
        return {**values, "network": network, "training": {"method": method, **training}}

    @model_validator(mode="before")
    @classmethod
    def _excitation_follows_the_step(cls, values: Any) -> Any:
        """A recipe without ``data.excitation`` gets what its step and its inputs ask for."""
        if not isinstance(values, dict):
            return values
        data, window = values.get("data", {}), values.get("window", {})
        step = window.get("step") if isinstance(window, dict) else None
        if not isinstance(data, dict) or "excitation" in data or is_measured(values):
            return values
        if not (isinstance(step, int | float) and math.isfinite(step) and step > 0):
            return values  # the mistake in the step is told by its own check
        mix = default_excitation(float(step), _inputs_of(values.get("system")))
        return {**values, "data": {**data, "excitation": mix}}

    @model_validator(mode="before")
    @classmethod
    def _records_have_their_numbers(cls, values: Any) -> Any:
        if isinstance(values, dict) and is_measured(values) and "automatic" not in values:
            require_no_numbers(values)
            return {"data": {}, **values}
        return values

    @model_validator(mode="after")
    def _tables_fit_the_kind(self) -> Recipe:
        require_fitting_tables(self)
        return self

    @model_validator(mode="after")
    def _beyond_is_learnt(self) -> Recipe:
        if self.data.beyond and not self.network.LEARNS_BEYOND:
            raise ValueError(
                f"data.beyond = {self.data.beyond}; expected 0 for network.family = "
                f"{self.network.family!r}: state-space networks alone learn from them"
            )
        return self

    @model_validator(mode="after")
    def _estimator_has_data(self) -> Recipe:
        counts = (self.data.estimator, self.data.estimator_validation)
        if self.estimator is not None and min(counts) < 1:
            raise ValueError(
                f"data.estimator = {counts[0]}, data.estimator_validation = {counts[1]}; "
                "the error estimator needs trajectories of its own, at least one each"
            )
        return self

    def require_resolved(self) -> None:
        """Refuse first guesses where nothing may be made of them.

        Raises:
            RecipeError: a key is left to be found.
        """
        guessed = [key for key in self.automatic if key in LENGTHS]
        if guessed:
            raise RecipeError(
                f"recipe {self.name!r} leaves {', '.join(guessed)} to be found; expected "
                "a whole recipe here: find them first (slide_fmu.memory.lengths.find_lengths), or "
                "give them"
            )

    @model_validator(mode="after")
    def _numbers_can_be_found(self) -> Recipe:
        measured = self.system.kind == KIND
        if "data.train" in self.automatic and not (
            measured or self.network.family == "state_space"
        ):
            raise ValueError(
                f'data.train is left out, or "auto"; expected a number for network.family = '
                f"{self.network.family!r}: the learning curve is that of a state-space network"
            )
        return self

    def count(self, split: str) -> int:
        """Return the number of trajectories of a split; none are for an estimator that is not.

        Raises:
            RecipeError: the number is left to be found, and was not yet.
        """
        if f"data.{split}" in self.automatic:
            raise RecipeError(
                f'recipe {self.name!r}: data.{split} is "auto" and was not found yet; make the '
                "data first (slide-fmu generate RECIPE), or give a number"
            )
        if split.startswith("estimator") and self.estimator is None:
            return 0
        return int(getattr(self.data, split))

    def trainings(self) -> tuple[TrainingTable, ...]:
        """Return all trainings of the recipe: of the surrogate, then of its error estimator."""
        if self.estimator is None:
            return (self.training,)
        first = self.estimator.pretraining
        return (self.training, *([] if first is None else [first]), self.estimator.training)

    def shortest_validation(self) -> float:
        """Return the least duration in s of a trajectory on which an FMU can be measured.

        Scored are samples after the burn-in whose inputs were all set, and error estimates whose
        whole span is scored.
        """
        window, burn_in = self.window, round(self.data.burn_in / self.window.step)
        whole = self.network.sees_whole_window
        seen = window.n_in if whole else window.n_in - window.n_out + 1
        first = max(burn_in + 1, seen)
        scored = 1 if self.estimator is None else self.estimator.span or window.n_out
        return (first + scored - 1 - burn_in) * window.step

    def _is_guessed(self) -> bool:
        """Whether lengths are first guesses, with which nothing that is given need agree."""
        return any(key in LENGTHS for key in self.automatic)

    @model_validator(mode="after")
    def _estimator_stays_in_the_window(self) -> Recipe:
        if self._is_guessed():
            return self
        lags = (self.estimator and self.estimator.lags) or (0,)
        if lags[-1] > self.window.n_in - self.window.n_out:
            raise ValueError(
                f"estimator.lags end with {lags[-1]}; expected at most n_in - n_out = "
                f"{self.window.n_in - self.window.n_out}, the age of the oldest input that the "
                "oldest output of the window has seen"
            )
        return self

    @model_validator(mode="after")
    def _trajectories_are_long_enough(self) -> Recipe:
        if self._is_guessed():
            return self
        window, data = self.window, self.data
        span = 0 if self.estimator is None else self.estimator.span or 0
        longest = max(window.n_in, window.n_in - window.n_out + span)
        validation = self.validation.duration or data.duration
        whole = {
            "data.duration": (data.duration, longest * window.step),
            "validation.duration": (validation, self.shortest_validation()),
        }
        for name, (duration, needed) in whole.items():
            if duration < needed - 0.5 * window.step:
                also = f" and estimator.span = {span}" if span else ""
                raise ValueError(
                    f"{name} = {duration:g} s; expected at least {needed:g} s for a window of "
                    f"n_in = {window.n_in}, n_out = {window.n_out} samples{also}"
                )
        return self


def _inputs_of(system: Any) -> InputKind:
    """Return what the inputs are by the table ``system``, which is not checked yet."""
    if isinstance(system, dict) and system.get("chain") is not None:
        return "set_points"
    inputs = system.get("inputs") if isinstance(system, dict) else None
    tables = inputs.values() if isinstance(inputs, dict) else ()
    known = [table for table in tables if isinstance(table, dict)]
    if [table.get("angle") for table in known] == ["cosine", "sine"]:
        return "angle"
    return "moving" if any(t.get("hold") == "first_order" for t in known) else "held"
