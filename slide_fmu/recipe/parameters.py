"""The recipe's tables ``parameters.NAME``: physical parameters that users of the FMU may set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from slide_fmu.core.parameters import Parameter, Transform
from slide_fmu.recipe.learning import LeastSquaresRecipe, Table

if TYPE_CHECKING:
    from slide_fmu.recipe.recipe import Recipe

EDGE = 0.05
"""Trajectories to learn from have values so far beyond the range too, as a share of it: errors are
largest at its ends, and larger still where nothing beyond them was learnt."""
ITERATIONS = 150
"""A training takes so many iterations on all data unless the recipe says otherwise. It converges
more slowly than without parameters: the training error of a Duffing oscillator with a mass of 1 to
3 kg falls by a factor of 2.5 from the 50th to the 150th."""


class ParameterRecipe(Table):
    """A table ``parameters.NAME`` declares a parameter of the model, with its range.

    The model has a parameter of this name: a class a keyword argument, a function or an FMU a
    parameter. The error estimator, if there is one, sees the inputs alone: what it estimates is
    the usual error over all values of the parameters.

    Attributes:
        range: lowest and highest value, in ``unit``.
        unit, description, start, transform: as of ``slide_fmu.core.parameters.Parameter``.
    """

    range: tuple[float, float]
    unit: str = "1"
    description: str = ""
    start: float | None = None
    transform: Transform = "linear"

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of a name.

        Raises:
            ValueError: its range, start or transform make no sense.
        """
        return Parameter(
            name, self.unit, *self.range, self.start, self.description, self.transform
        )


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


def _require_learnable(recipe: Recipe) -> None:
    names = list(recipe.parameters)
    if not recipe.network.FOLLOWS_PARAMETERS:
        raise ValueError(
            f"parameters {names} with network.family = {recipe.network.family!r}; expected none: "
            "the weights of state-space networks alone follow them"
        )
    if recipe.system.is_record:
        raise ValueError(
            f"parameters {names} of measured records; expected none: nobody can set them there"
        )
    training = recipe.training
    if isinstance(training, LeastSquaresRecipe) and training.start is not None:
        raise ValueError(
            f"training.start = {training.start!r} with parameters {names}; expected none: a "
            "training that begins with the network of an FMU follows no parameters"
        )
    if "data.train" in recipe.automatic:
        raise ValueError(
            f'data.train is left out, or "auto", with parameters {names}; expected a number: the '
            "learning curve knows no parameters. 100 trajectories suit one parameter, 200 two"
        )
