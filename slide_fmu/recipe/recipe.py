"""Typed recipes say what to simulate, learn and release; they are read from a TOML file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from slide_fmu.core.parameters import Parameter
from slide_fmu.excitation.mix import Excitation
from slide_fmu.recipe.automatic import LENGTHS, with_guesses
from slide_fmu.recipe.default_excitation import InputKind, default_excitation
from slide_fmu.recipe.error_bound import (
    BoundRecipe,
    bound_filling,
    bound_samples,
    require_bound,
    span_length,
    spans_of,
)
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.learning import (
    METHODS,
    LeastSquaresRecipe,
    NetworkTable,
    StateSpaceRecipe,
    Table,
    TrainingTable,
)
from slide_fmu.recipe.parameters import (
    ParameterRecipe,
    require_parameters,
    with_iterations,
)
from slide_fmu.recipe.record_rules import (
    is_measured,
    require_fitting_tables,
    require_no_numbers,
)
from slide_fmu.recipe.specimens import with_division
from slide_fmu.recipe.system import SystemRecipe
from slide_fmu.recipe.tables import DataRecipe, StabilityRecipe, ValidationRecipe, WindowRecipe

FURTHER = "further"
"""These trajectories are of the kinds ``bound.excitation``."""

OF_BOUND = ("companion", "bound", "calibration", FURTHER)
"""Trajectories of the error bound alone."""

SPLITS = ("train", "validation", "estimator", "estimator_validation", "beyond", *OF_BOUND)
"""Trajectories that are kept. Test trajectories are drawn anew for every validation."""

NAME = r"^[A-Za-z][A-Za-z0-9_]{0,99}$"
"""The name of a recipe is a C identifier, since its FMU has it, and short enough for a file's."""

MOST_SAMPLES = 10_000_000
"""Longer motions fit into no memory: this one takes 80 MB for each signal."""


class RecipeError(ValueError):
    """A recipe cannot be used; the message holds one line per mistake."""


class Recipe(Table):
    """A recipe is everything that makes a surrogate.

    Attributes:
        name: C identifier; names the run, the surrogate and the FMU.
        description: one line for people.
        equations: equations of motion and parameters, for the model card.
        system: the reference system that the surrogate stands in for.
        window: what the network sees and gives.
        data: trajectories to learn from, and their excitation; found if not given.
        network: the network; a state-space network of sizes that are found if not given. The name
            of its family alone is short for its table.
        training: how the network is trained; by its family's method if not given.
        estimator: the error estimator; none if not given, and one of usual size if the table is
            empty.
        bound: the error bound and the domain; none if not given.
        stability: what a network must keep to before it is exported.
        validation: unseen trajectories on which the FMU is measured.
        parameters: physical parameters that users of the FMU may set, by name.
        apps: tables of apps by the apps' names; each app reads its own.
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
    bound: BoundRecipe | None = None
    stability: StabilityRecipe = StabilityRecipe()
    validation: ValidationRecipe = ValidationRecipe()
    parameters: dict[str, ParameterRecipe] = Field(default={})
    apps: dict[str, dict[str, Any]] = Field(default={})
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
    def _bound_can_be_learnt(self) -> Recipe:
        require_bound(self)
        return self

    @model_validator(mode="after")
    def _kinds_stand_in_one_table(self) -> Recipe:
        learnt, further = (
            [kind.model_dump(exclude={"weight"}) for kind in kinds]
            for kinds in (self.data.excitation, self.further_kinds())
        )
        for kind in self.further_kinds():
            if kind.model_dump(exclude={"weight"}) in learnt:
                raise ValueError(
                    f"bound.excitation has a {kind.kind!r} that is in data.excitation too; "
                    "expected kinds, or settings of them, that no network learns from: remove it "
                    "from one of them"
                )
        for kind in self.validation.excitation:
            settings = kind.model_dump(exclude={"weight"})
            for table, known in (("data", learnt), ("bound", further)):
                if settings in known:
                    raise ValueError(
                        f"validation.excitation has a {kind.kind!r} that is in {table}.excitation "
                        "too; expected kinds, or settings of them, that nothing is learnt from: "
                        "remove it from one of them"
                    )
        return self

    def further_kinds(self) -> tuple[Excitation, ...]:
        """Return the kinds of excitation that the error bound alone learns from."""
        return () if self.bound is None else self.bound.excitation

    def drawn_for(self, split: str) -> Recipe:
        """Return the recipe whose motions are those of a split."""
        return self.with_further_kinds() if split == FURTHER else self

    def with_further_kinds(self) -> Recipe:
        """Return the recipe whose motions are of the kinds that the error bound alone learns from.

        Raises:
            RecipeError: there are none.
        """
        if not self.further_kinds():
            raise RecipeError(
                f"recipe {self.name!r} has no kinds of excitation for its error bound alone; "
                "expected some under [[bound.excitation]]"
            )
        return self.with_kinds(self.further_kinds())

    def with_kinds(self, kinds: tuple[Excitation, ...]) -> Recipe:
        """Return the recipe whose motions are of these kinds of excitation."""
        data = self.data.model_copy(update={"excitation": kinds})
        return self.model_copy(update={"data": data})

    def with_held_out_kinds(self) -> Recipe:
        """Return the recipe whose motions are of the kinds that are held out.

        Raises:
            RecipeError: there are none.
        """
        if not self.validation.excitation:
            raise RecipeError(
                f"recipe {self.name!r} holds out no kinds of excitation; expected some under "
                "[[validation.excitation]]"
            )
        return self.with_kinds(self.validation.excitation)

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
        measured = self.system.is_record
        if "data.train" in self.automatic and not (
            measured or self.network.family == "state_space"
        ):
            raise ValueError(
                f'data.train is left out, or "auto"; expected a number for network.family = '
                f"{self.network.family!r}: the learning curve is that of a state-space network"
            )
        return self

    def count(self, split: str) -> int:
        """Return the number of trajectories of a split; none are for what is not learnt.

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
        if split in OF_BOUND and self.bound is None:
            return 0
        if split == "companion" and self.data.companion in (0, "train"):
            return 0 if self.data.companion == "train" else self.count("train")
        if split == FURTHER:
            return self._further_count()
        return int(getattr(self.data, split))

    def _further_count(self) -> int:
        return (self.data.further or max(2, self.data.bound // 2)) if self.further_kinds() else 0

    def trainings(self) -> tuple[TrainingTable, ...]:
        """Return all trainings of the recipe: of the surrogate, then of its error estimator."""
        if self.estimator is None:
            return (self.training,)
        first = self.estimator.pretraining
        return (self.training, *([] if first is None else [first]), self.estimator.training)

    def shortest_validation(self) -> float:
        """Return the least duration in s of a trajectory on which an FMU can be measured.

        Scored are samples after the burn-in whose inputs were all set, error estimates whose
        whole span is scored, and error bounds that know all inputs behind them.
        """
        window, burn_in = self.window, round(self.data.burn_in / self.window.step)
        whole = self.network.sees_whole_window
        seen = window.n_in if whole else window.n_in - window.n_out + 1
        first = max(burn_in + 1, seen)
        scored = 1 if self.estimator is None else self.estimator.span or window.n_out
        scored = max(scored, span_length(self))
        last = max(first + scored - 1, bound_filling(self))
        return (last - burn_in) * window.step

    def _is_guessed(self) -> bool:
        """Tell whether lengths are first guesses, with which nothing that is given need agree."""
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
        of_bound = bound_samples(self)
        longest = max(window.n_in, window.n_in - window.n_out + span, of_bound)
        validation = self.validation.duration or data.duration
        whole = {
            "data.duration": (data.duration, longest * window.step),
            "validation.duration": (
                validation,
                max(self.shortest_validation(), of_bound * window.step),
            ),
        }
        for name, (duration, needed) in whole.items():
            if duration < needed - 0.5 * window.step:
                also = f" and estimator.span = {span}" if span else ""
                if self.bound is not None:
                    also += f" and {spans_of(self.bound)}"
                raise ValueError(
                    f"{name} = {duration:g} s; expected at least {needed:g} s for a window of "
                    f"n_in = {window.n_in}, n_out = {window.n_out} samples{also}"
                )
        return self

    @model_validator(mode="after")
    def _trajectories_fit_into_memory(self) -> Recipe:
        durations = {
            "data.duration": self.data.duration,
            "data.burn_in": self.data.burn_in,
            "validation.duration": self.validation.duration or 0.0,
            "window.n_in": self.window.n_in * self.window.step,
        }
        for name, duration in durations.items():
            if duration > MOST_SAMPLES * self.window.step:
                raise ValueError(
                    f"{name} asks for {duration / self.window.step:.4g} samples; expected at most "
                    f"{MOST_SAMPLES:,}: shorten it, or choose a larger window.step"
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
