"""A Recipe holds all settings of a surrogate as typed tables, read from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from slide_fmu.core.measures import FEWEST
from slide_fmu.core.parameters import Parameter, Transform
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.learning import (
    LeastSquaresRecipe,
    NetworkTable,
    StateSpaceRecipe,
    Table,
    TrainingTable,
)
from slide_fmu.recipe.system import SystemRecipe
from slide_fmu.recipe.tables import DataRecipe, StabilityRecipe, ValidationRecipe, WindowRecipe


class ParameterRecipe(Table):
    """A table ``parameters.NAME`` declares a parameter of the model, with its range.

    The model has a parameter of this name: a class a keyword argument, a function or an FMU a
    parameter. Of measured records, it has a value in each file. An error estimator sees the inputs
    alone: it gives the usual error over all values of the parameters.

    Attributes:
        range: lowest and highest value, in ``unit``; for records, of ``values``.
        values: for records, the value in each file, in ``unit``, in the order of ``system.model``
            and ``system.further``.
        unit: unit of the values, as FMI names it (``"kg"``).
        description: one line for people.
        start: value before anybody sets one; the middle of the range, as ``transform`` divides it,
            if not given.
        transform: the quantity on which the response depends most evenly: the value
            (``"linear"``), its logarithm (``"log"``), or one over it (``"reciprocal"``), for
            example for a mass that is moved by a force.
        beyond: part of the range by which values of training trajectories leave it at both ends,
            where errors are largest otherwise. Without this key the range is a hard limit of the
            model.
    """

    range: tuple[float, float] | None = None
    values: tuple[float, ...] = ()
    unit: str = "1"
    description: str = ""
    start: float | None = None
    transform: Transform = "linear"
    beyond: float = Field(default=0.0, ge=0.0, le=1.0)

    @model_validator(mode="after")
    def _has_a_range_or_values(self) -> ParameterRecipe:
        if (self.range is None) == (not self.values):
            raise ValueError(
                f"range = {self.range}, values = {list(self.values)}; expected the range of a "
                "parameter that the model has, or the values in the files of measured records"
            )
        if self.values and self.beyond:
            raise ValueError(
                f"beyond = {self.beyond:g} with values = {list(self.values)}; expected 0: nothing "
                "is known of what lies beyond measured records, so remove beyond"
            )
        return self

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of a name.

        Raises:
            ValueError: its range, start or transform is invalid.
        """
        low, high = self.range or (min(self.values), max(self.values))
        return Parameter(name, self.unit, low, high, self.start, self.description, self.transform)


FURTHER = "further"
"""These trajectories are of the kinds ``bound.excitation``."""

OF_BOUND = ("companion", "bound", "calibration", FURTHER)
"""Trajectories of the error bound alone."""

LEARNT = ("train", "companion", "bound")
"""These trajectories are also of the kinds ``training.expert.excitation``."""

SPLITS = ("train", "validation", "estimator", "estimator_validation", "beyond", *OF_BOUND)
"""Names of the splits. Test trajectories are drawn anew for every validation."""

MEASURING = 60.0
"""Unseen trajectories whose number a recipe does not give take about this CPU time in s at most,
but there is one of each kind."""

MEASURED, LEAST_SCORED, LEAST_MEASURED = 1.5, 0.5, 1000
"""Length of the motions that an FMU is measured on, in windows, the least part that is scored, and
the least number of samples: more motions tell more than longer ones, which the system has
forgotten."""

NOT_TRAINED = ("description", "equations", "validation", "apps")
"""Tables of a recipe on which no training depends."""

NOT_TRAINED_KEYS = {"system": ("reference", "picture"), "stability": ("allow_unstable",)}
"""Keys on which no training depends, of tables on which it does. The tests of stability are
training: they decide where the cubes of a network are clipped."""

NAME = r"^[A-Za-z][A-Za-z0-9_]{0,99}$"
"""The name of a recipe is a C identifier, since its FMU has it, and short enough for a file's."""


class RecipeError(ValueError):
    """A recipe cannot be used; the message holds one line per mistake."""


def tables_of_training(tables: Tables) -> Tables:
    """Return the part of a recipe's tables, as a recipe dumps them, that decides its training."""
    decisive = {name: table for name, table in tables.items() if name not in NOT_TRAINED}
    for name, left_out in NOT_TRAINED_KEYS.items():
        decisive[name] = {k: v for k, v in tables[name].items() if k not in left_out}
    return decisive


class Recipe(Table):
    """A Recipe holds all settings of a surrogate; no key in it is open.

    A file with defaults and ``"auto"`` is read as an ``OpenRecipe`` first.

    Attributes:
        name: C identifier; names the run, the surrogate and the FMU.
        description: one line for people.
        equations: equations of motion and parameters, for the model card.
        system: the reference system that the surrogate stands in for.
        window: inputs that the network sees, and outputs that it gives.
        data: trajectories to learn from, and their excitation; found if not given.
        network: the network; a state-space network of sizes that are found if not given. The name
            of its family can replace its table.
        training: how the network is trained; by its family's method if not given.
        estimator: the error estimator; without the table there is no estimator, and an empty table
            gives one of usual size.
        bound: the error bound and the domain; without the table there is no bound.
        stability: tests that a network must pass before it is exported.
        validation: unseen trajectories on which the FMU is measured.
        parameters: physical parameters that users of the FMU may set, by name.
        loop: loops in which an output decides an input; motions in them are drawn next to the
            kinds of ``data.excitation``.
        apps: tables of apps by the apps' names; each app reads its own.
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
    loop: tuple[LoopRecipe, ...] = ()
    apps: dict[str, dict[str, Any]] = Field(default={})

    def physical(self) -> tuple[Parameter, ...]:
        """Return the parameters that users of the FMU may set, in their order."""
        return tuple(table.parameter(name) for name, table in self.parameters.items())

    def at(self, values: Mapping[str, float]) -> Recipe:
        """Return the recipe for fixed values of its parameters, which need not be in their ranges.

        Its system gets the values; the new recipe has no parameters.
        """
        fixed = {**self.system.parameters, **values}
        system = self.system.model_copy(update={"parameters": fixed})
        return self.model_copy(update={"system": system, "parameters": {}})

    def mix(self) -> tuple[Excitation | LoopRecipe, ...]:
        """Return the kinds of motion that are drawn: those of the excitation, then the loops."""
        return (*self.data.excitation, *self.loop)

    def without_loops(self) -> Recipe:
        """Return the recipe whose motions are of the kinds ``data.excitation`` alone."""
        return self.model_copy(update={"loop": ()})

    def further_kinds(self) -> tuple[Excitation, ...]:
        """Return the kinds of excitation that the error bound alone learns from."""
        return () if self.bound is None else self.bound.excitation

    def kinds_of_training(self) -> tuple[Excitation, ...]:
        """Return the kinds of excitation that are learnt from, but not promised."""
        return getattr(self.training.expert, "excitation", ())

    def tables_of_kinds(self) -> dict[str, tuple[Excitation, ...]]:
        """Return the kinds of excitation of all tables, by the place of a table."""
        return {
            "data": self.data.excitation,
            "training.expert": self.kinds_of_training(),
            "bound": self.further_kinds(),
            "validation": self.validation.excitation,
        }

    def drawn_for(self, split: str) -> Recipe:
        """Return the recipe whose motions are the motions of a split."""
        if split == FURTHER:
            return self.with_further_kinds()
        if split in LEARNT and self.kinds_of_training():
            drawn = self.with_kinds((*self.data.excitation, *self.kinds_of_training()))
            return drawn.model_copy(update={"loop": self.loop})
        return self

    def with_further_kinds(self) -> Recipe:
        """Return the recipe whose motions are of the kinds that the error bound alone learns from.

        Raises:
            RecipeError: the recipe has no such kinds.
        """
        if not self.further_kinds():
            raise RecipeError(
                f"recipe {self.name!r} has no kinds of excitation for its error bound alone; "
                "expected some under [[bound.excitation]]"
            )
        return self.with_kinds(self.further_kinds())

    def with_kinds(self, kinds: tuple[Excitation, ...]) -> Recipe:
        """Return the recipe whose motions are of these kinds of excitation, in no loop."""
        data = self.data.model_copy(update={"excitation": kinds})
        return self.model_copy(update={"data": data, "loop": ()})

    def with_held_out_kinds(self) -> Recipe:
        """Return the recipe whose motions are of the kinds that are held out.

        Raises:
            RecipeError: the recipe has no such kinds.
        """
        if not self.validation.excitation:
            raise RecipeError(
                f"recipe {self.name!r} holds out no kinds of excitation; expected some under "
                "[[validation.excitation]]"
            )
        return self.with_kinds(self.validation.excitation)

    def count(self, split: str) -> int:
        """Return the number of trajectories of a split; 0 for a part that is not learnt."""
        if split.startswith("estimator") and self.estimator is None:
            return 0
        if split in OF_BOUND and self.bound is None:
            return 0
        if split == "companion" and self.data.companion in (0, "train"):
            return 0 if self.data.companion == "train" else self.count("train")
        if split == FURTHER:
            return self._further_count()
        return int(getattr(self.data, split))

    @property
    def total_count(self) -> int:
        """The number of trajectories of all splits."""
        return sum(self.count(split) for split in SPLITS)

    def _further_count(self) -> int:
        if self.bound is None or not self.bound.excitation:
            return 0
        return self.bound.expert.further or max(2, self.data.bound // 2)

    def may_begin_at_states(self) -> bool:
        """Tell whether the network is fitted from states, where the system shows them.

        The order of the network is open then, and follows.
        """
        network = self.network
        if not isinstance(network, StateSpaceRecipe):
            return False
        training = self.training
        if not isinstance(training, LeastSquaresRecipe) or training.expert.even_out:
            return False
        anew = training.start is None
        free = network.order == "auto" and network.may_have_states_of_the_system
        return free and anew and not self.parameters and not self.data.beyond

    def trainings(self) -> tuple[TrainingTable, ...]:
        """Return all trainings of the recipe: of the surrogate, then of its error estimator."""
        if self.estimator is None:
            return (self.training,)
        first = self.estimator.expert.pretraining
        return (self.training, *([] if first is None else [first]), self.estimator.training)

    def unseen_of_kind(self, trajectories: int | None, seconds: float = 0.0) -> int:
        """Return the number of unseen trajectories of each kind that an FMU is measured on.

        Args:
            trajectories: number of all of them; that of the recipe, or what takes ``MEASURING`` s,
                if None.
            seconds: CPU time in s that one of them takes; 0 if it does not matter.
        """
        kinds = self._kinds_in_turn()
        wanted = trajectories or self.validation.trajectories
        if wanted is not None:
            return max(1, wanted // kinds)
        affordable = int(MEASURING / (kinds * seconds)) if seconds else FEWEST
        return max(1, min(FEWEST, affordable))

    def unseen(self, trajectories: int | None, seconds: float = 0.0) -> int:
        """Return the number of all unseen trajectories; arguments are as of ``unseen_of_kind``."""
        wanted = trajectories or self.validation.trajectories
        return wanted or self._kinds_in_turn() * self.unseen_of_kind(trajectories, seconds)

    def _kinds_in_turn(self) -> int:
        """Return the number of kinds that take turns; 1 of records, which have none."""
        return max(1, len(self.mix()))

    def measured_duration(self) -> float:
        """Return the length in s of the motions that an FMU is measured on, after the burn-in."""
        given, window = self.validation.duration, self.window
        if given is not None:
            return given
        filled = self.shortest_validation() / window.step
        if self.bound is not None:
            filled = max(filled, self.bound.samples(window))
        samples = max(MEASURED * window.n_in, filled + LEAST_SCORED * window.n_in, LEAST_MEASURED)
        return min(self.data.duration, samples * window.step)

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
        last = first + scored - 1
        if self.bound is not None:
            last = max(last, first + self.bound.span_length(window.step) - 1)
            last = max(last, self.bound.filling(window))
        return (last - burn_in) * window.step

    def of_companion(self, attempt: int) -> Recipe:
        """Return the recipe by which an attempt, counted from 0, fits the bound's companion."""
        assert self.bound is not None
        assert isinstance(self.training, LeastSquaresRecipe)  # a bound is of a state-space network
        expert = self.bound.expert
        own = expert.companion
        training = own.of_training(self.training, self.training.seed + expert.seed + 1 + attempt)
        size = {} if own.hidden is None else {"hidden": own.hidden}
        network = self.network.model_copy(update=size)
        return self.model_copy(update={"network": network, "training": training})
