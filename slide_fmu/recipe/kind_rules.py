"""What a recipe may say, and how reports name what is in it, follows from the kind of its system.

``ModelRules`` are those of all kinds that are simulated. A kind that is not has a module of its
own, which ``slide_fmu.systems.loading.UNSIMULATED`` names.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import NamedTuple

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.system import SystemRecipe


class Motion(NamedTuple):
    """A Motion is a kind of motion: its name, unlike all others, and what kind it is."""

    name: str
    kind: str


@dataclass(frozen=True, kw_only=True)
class Words:
    """Reports use these words.

    Attributes:
        trained_on: what a surrogate has been trained on.
        stands_for: what it stands in for.
        truth: what it is compared with, in a chart.
        reference: all that is to say of the reference; empty where a model can be named.
        by_kind: heading of the errors by kind of motion.
        get_inputs: which FMUs get their inputs, with the verb.
        parameters: at which values of physical parameters errors were measured.
        lasting_memory: why a network may not forget, behind that it does not; mostly nothing.
    """

    trained_on: str
    stands_for: str
    truth: str
    reference: str
    by_kind: str
    get_inputs: str
    parameters: str
    lasting_memory: str = ""


class KindRules(abc.ABC):
    """KindRules are those of recipes whose systems are of one kind. Interface: never instantiated.

    Attributes:
        words: what reports call what is in such a recipe.
        simulated: whether trajectories are simulated.
        no_bound: why there can be no error bound; None where there can be one.
        lacks_outputs: whether outputs of trajectories may be missing before those that are scored.
    """

    words: Words
    simulated: bool = True
    no_bound: str | None = None
    lacks_outputs: bool = False

    @abc.abstractmethod
    def begun(self, tables: Tables) -> Tables:
        """Return the tables of a recipe with what its kind fills in before anything else.

        Raises:
            ValueError: the tables say what such a recipe cannot say.
        """

    def ended(self, tables: Tables) -> Tables:
        """Return tables, in which everything else is filled in, with what the kind then adds."""
        return tables

    @abc.abstractmethod
    def require_fitting_tables(self, recipe: Recipe) -> None:
        """Refuse with a ValueError what is meant for systems of another kind."""

    @abc.abstractmethod
    def require_parameters(self, recipe: Recipe) -> None:
        """Refuse with a ValueError physical parameters that such a system cannot have."""

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
        """Say of each kind of motion, by name, what the inputs do.

        Args:
            recipe: what was learnt.
            signals: the inputs in channel order.
            step: time between samples in s.
            held_out: whether the kinds are those that were held out.
        """

    @abc.abstractmethod
    def compared(self, recipe: Recipe, count: int, seed: int) -> str:
        """Say what the FMU was compared with: so many trajectories, of a seed."""

    def origin_of_noise(self, recipe: Recipe) -> str:
        """Say from what the noise of the outputs is known; nothing where they have none."""
        return ""

    @abc.abstractmethod
    def changed(self, system: SystemRecipe, known: FloatArray, now: FloatArray) -> str:
        """Say what has changed since data were made of a system, and the remedy.

        Both arrays are its numbers (``slide_fmu.data.fingerprint.identity``), then and now.
        """
