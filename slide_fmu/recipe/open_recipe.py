"""An OpenRecipe is a recipe as it was read; its open keys hold first guesses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from slide_fmu.recipe.automatic import FoundValues, Tables, with_guesses
from slide_fmu.recipe.checks import faults
from slide_fmu.recipe.learning import METHODS, LeastSquaresRecipe
from slide_fmu.recipe.mistake_lines import mistake_lines
from slide_fmu.recipe.model_rules import rules_of, rules_of_tables
from slide_fmu.recipe.recipe import Recipe, RecipeError

ITERATIONS = 150
"""Default number of iterations on all data with physical parameters. The training then converges
more slowly than without: the training error of a Duffing oscillator with a mass of 1 to
3 kg falls by a factor of 2.5 from the 50th to the 150th."""


@dataclass(frozen=True)
class OpenRecipe:
    """An OpenRecipe is a recipe with keys that are still to be found.

    Attributes:
        guess: the recipe with first guesses at these keys: its systems can be made and its motions
            be drawn, but nothing is learnt from it.
        open_keys: these keys (``"window.n_in"``), in the order of ``AUTOMATIC``.
    """

    guess: Recipe
    open_keys: tuple[str, ...]

    @staticmethod
    def of(tables: Mapping[str, Any], source: str, text: str = "") -> OpenRecipe:
        """Make a recipe of tables, in which ``"auto"`` or no value leaves a key to be found.

        Args:
            tables: the tables as they were read.
            source: name of the recipe in messages.
            text: content of its file, for lines of mistakes; empty without a file.

        Raises:
            RecipeError: they are not a valid recipe; there is one line per mistake.
        """
        try:
            whole, open_keys = _with_defaults(dict(tables))
        except ValueError as error:
            raise RecipeError(f"{source}: {error}") from error
        return _checked(whole, open_keys, source, text)

    def with_found(self, values: FoundValues, source: str) -> OpenRecipe:
        """Return the recipe with values that were found in the place of first guesses.

        Args:
            values: a table of tables, as ``{"window": {"n_in": 96}}``; other keys stay open.
            source: name of the recipe in messages.

        Raises:
            RecipeError: the values do not fit what the recipe gives, or are not open in it.
        """
        tables = self.guess.model_dump()
        places = [f"{table}.{key}" for table, inner in values.items() for key in inner]
        unasked = [place for place in places if place not in self.open_keys]
        if unasked:
            raise RecipeError(
                f"{source}: values were found for {unasked}; expected some of {self.open_keys}, "
                'which are "auto": find them again for this recipe'
            )
        for table, inner in values.items():
            tables[table].update(inner)
        still_open = tuple(key for key in self.open_keys if key not in places)
        return _checked(tables, still_open, source)

    def resolved(self) -> Recipe:
        """Return the recipe, in which nothing is open any more.

        Raises:
            RecipeError: a key is still to be found.
        """
        if not self.open_keys:
            return self.guess
        raise self.refusal()

    def refusal(self) -> RecipeError:
        """Return the error of what needs a recipe without open keys."""
        return RecipeError(
            f"recipe {self.guess.name!r} leaves {', '.join(self.open_keys)} to be found "
            '("auto", or not given); expected values here: slide-fmu run RECIPE finds them, or '
            "give them"
        )


def _checked(
    tables: Mapping[str, Any], open_keys: tuple[str, ...], source: str, text: str = ""
) -> OpenRecipe:
    """Make a recipe of whole tables, whose values are checked."""
    try:
        recipe = Recipe.model_validate(tables)
    except ValidationError as error:
        raise RecipeError(mistake_lines(error, source, file=Recipe, text=text)) from error
    every = [*_unfindable(recipe, open_keys), *faults(recipe, open_keys)]
    if every:
        raise RecipeError("\n".join(f"{source}: {fault}" for fault in every))
    return OpenRecipe(recipe, open_keys)


def _unfindable(recipe: Recipe, open_keys: tuple[str, ...]) -> list[str]:
    """Return a fault if a number of trajectories is open, and no learning curve can find it."""
    drawn = rules_of(recipe).simulated  # with records, the samples decide
    if not drawn or "data.train" not in open_keys or recipe.network.family == "state_space":
        return []
    return [
        f'data.train is left out, or "auto"; expected a number for network.family = '
        f"{recipe.network.family!r}: the learning curve is that of a state-space network"
    ]


def _with_defaults(tables: Tables) -> tuple[Tables, tuple[str, ...]]:
    """Return tables with defaults, and the keys that are left to be found, with first guesses."""
    rules = rules_of_tables(tables)
    guessed, open_keys = with_guesses(_with_methods(rules.with_first_defaults(tables)))
    return rules.with_last_defaults(_with_iterations(guessed)), open_keys


def _with_methods(values: Tables) -> Tables:
    """Fill in the family of the network, whose name is short for its table, and its training."""
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


def _with_iterations(tables: Tables) -> Tables:
    """Return the tables of a recipe with as many iterations as parameters need, if not given."""
    training = tables.get("training", {})
    if not tables.get("parameters") or not isinstance(training, Mapping):
        return tables
    method = training.get("method", LeastSquaresRecipe().method)
    if "iterations" in training or method != LeastSquaresRecipe().method:
        return tables
    return {**tables, "training": {**training, "iterations": ITERATIONS}}
