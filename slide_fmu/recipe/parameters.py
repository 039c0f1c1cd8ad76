"""The recipe's tables ``parameters.NAME``: physical parameters that users of the FMU may set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pydantic import Field, model_validator

from slide_fmu.core.parameters import Parameter, Transform
from slide_fmu.recipe.learning import LeastSquaresRecipe, Table
from slide_fmu.recipe.specimens import require_specimens

if TYPE_CHECKING:
    from slide_fmu.recipe.recipe import Recipe

ITERATIONS = 150
"""A training takes so many iterations on all data unless the recipe says otherwise. It converges
more slowly than without parameters: the training error of a Duffing oscillator with a mass of 1 to
3 kg falls by a factor of 2.5 from the 50th to the 150th."""


class ParameterRecipe(Table):
    """A table ``parameters.NAME`` declares a parameter of the model, with its range.

    The model has a parameter of this name: a class a keyword argument, a function or an FMU a
    parameter. Of measured records, it has a value in each file. The error estimator, if there is
    one, sees the inputs alone: what it estimates is the usual error over all values of the
    parameters.

    Attributes:
        range: lowest and highest value, in ``unit``; of records those of ``values``.
        values: of records, the value in each file, in ``unit``, in the order of ``system.model``
            and ``system.further``.
        unit: unit of the values, as FMI names it (``"kg"``).
        description: one line for people.
        start: value before anybody sets one; the middle of the range, as ``transform`` divides it,
            if not given.
        transform: what the response follows most evenly: the value (``"linear"``), its logarithm
            (``"log"``), or one over it (``"reciprocal"``), as of a mass that a force moves.
        beyond: trajectories to learn from have values so far beyond both ends too, as a part of
            the range. Errors are largest at its ends, and smaller where something beyond them was
            learnt; but a range is a hard limit of the model unless this says otherwise.
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
            ValueError: its range, start or transform make no sense.
        """
        low, high = self.range or (min(self.values), max(self.values))
        return Parameter(name, self.unit, low, high, self.start, self.description, self.transform)


def with_iterations(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a recipe with as many iterations as parameters need, if not given."""
    training = tables.get("training", {})
    if not tables.get("parameters") or not isinstance(training, Mapping):
        return tables
    method = training.get("method", LeastSquaresRecipe().method)
    if "iterations" in training or method != LeastSquaresRecipe().method:
        return tables
    return {**tables, "training": {**training, "iterations": ITERATIONS}}


def require_parameters(recipe: Recipe) -> None:
    """Refuse parameters that make no sense, or that the recipe gives otherwise too.

    Raises:
        ValueError: the message names the parameter, and the remedy.
    """
    check = require_specimens if recipe.system.is_record else _require_ranges
    check(recipe)
    for name, table in recipe.parameters.items():
        table.parameter(name)
        if name == "step":
            raise ValueError(
                "parameters.step; expected a parameter of the model: the sample step of a "
                "surrogate is window.step, and fixed"
            )
        for other in ("parameters", "reference", "inputs", "outputs"):
            if name in getattr(recipe.system, other):
                raise ValueError(
                    f"parameters.{name} is in system.{other} too; expected it in one of them: "
                    f"remove it from system.{other}"
                )
    if recipe.parameters:
        _require_learnable(recipe)


def _require_ranges(recipe: Recipe) -> None:
    for name, table in recipe.parameters.items():
        if table.values:
            raise ValueError(
                f"parameters.{name}.values = {list(table.values)} with system.kind = "
                f"{recipe.system.kind!r}; expected a range: values are those of measured records"
            )


def _require_learnable(recipe: Recipe) -> None:
    names = list(recipe.parameters)
    if not recipe.network.FOLLOWS_PARAMETERS:
        raise ValueError(
            f"parameters {names} with network.family = {recipe.network.family!r}; expected none: "
            "the weights of state-space networks alone follow them"
        )
