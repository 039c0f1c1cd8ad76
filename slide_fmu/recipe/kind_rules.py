"""The kind of system decides which keys a recipe may have, and which words reports use.

``ModelRules`` are the rules of all simulated kinds. Another kind has a module of its own, which
``slide_fmu.systems.loading.UNSIMULATED`` names.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import NamedTuple

from slide_fmu.core.signals import Signal
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.recipe import Recipe


class Motion(NamedTuple):
    """A Motion is a kind of motion with its unique name and its kind of excitation.

    Attributes:
        name: unique name, as in the tables of the recipe.
        kind: kind of its excitation.
        full_name: its name in rows, where it may say more; empty for ``name``.
    """

    name: str
    kind: str
    full_name: str = ""


@dataclass(frozen=True, kw_only=True)
class Words:
    """Words are texts for reports.

    Attributes:
        trained_on: the data that a surrogate was trained on.
        stands_for: the system that it replaces.
        truth: name of the reference in a chart.
        reference: a sentence on the reference; empty where a model can be named.
        inputs_seen: a sentence before the list of inputs that a surrogate was trained on.
        parameters: the values of physical parameters at which errors were measured.
        calibrated_by: what error bounds are calibrated by, behind its number.
        more_data: what to give where there are too few data.
        where_flat: a further remedy for networks that predict a constant; mostly empty.
        lasting_memory: a further reason for a network that does not forget; mostly empty.
    """

    trained_on: str
    stands_for: str
    truth: str
    reference: str
    inputs_seen: str
    parameters: str
    calibrated_by: str = "trajectories of the same mix"
    more_data: str = "more or other data (data.train, data.excitation)"
    where_flat: str = ""
    lasting_memory: str = ""


class KindRules(abc.ABC):
    """KindRules are the rules of recipes with one kind of system. Interface: never instantiated.

    Attributes:
        words: texts for reports.
        simulated: whether trajectories are simulated.
    """

    words: Words
    simulated: bool = True

    @abc.abstractmethod
    def with_first_defaults(self, tables: Tables) -> Tables:
        """Return the tables of a recipe after the first defaults of its kind are filled in.

        Raises:
            ValueError: the tables have keys that such a recipe cannot have.
        """

    def with_last_defaults(self, tables: Tables) -> Tables:
        """Return otherwise complete tables after the last defaults of its kind are filled in."""
        return tables

    @abc.abstractmethod
    def require_fitting_tables(self, recipe: Recipe) -> None:
        """Refuse with a ValueError keys for systems of another kind."""

    @abc.abstractmethod
    def require_parameters(self, recipe: Recipe) -> None:
        """Refuse with a ValueError physical parameters that such a system cannot have."""

    def decisive_for_data(self, recipe: Recipe) -> Tables:
        """Return further values on which trajectories depend, beside the tables of the data."""
        return {}

    def starts(self, recipe: Recipe) -> dict[str, float]:
        """Return the start values by which the system gets its physical parameters, by name."""
        return {parameter.name: parameter.start_value for parameter in recipe.physical()}

    def draws_beyond(self, estimator: EstimatorRecipe, index: int) -> bool:
        """Tell whether trajectory ``index`` of an error estimator leaves the range."""
        return estimator.draws_beyond(index)

    @abc.abstractmethod
    def motions(self, recipe: Recipe) -> list[Motion]:
        """Return the kinds of motion, in the order in which trajectories have their numbers."""

    @abc.abstractmethod
    def described(
        self, recipe: Recipe, signals: tuple[Signal, ...], step: float, held_out: bool
    ) -> dict[str, str]:
        """Describe the inputs of each kind of motion, by name.

        Args:
            recipe: the recipe.
            signals: the inputs in channel order.
            step: time between samples in s.
            held_out: whether the kinds are those that were held out.
        """

    @abc.abstractmethod
    def compared(self, recipe: Recipe, count: int, seed: int) -> str:
        """Describe the trajectories that the FMU was compared with, by number and seed."""
