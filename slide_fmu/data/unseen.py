"""This module draws motions that no training uses, with the outputs of the reference."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.draws import Draw, Stream, drawn_outputs, first_that_runs
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System


@dataclass(frozen=True, eq=False)
class UnseenMotion:
    """An UnseenMotion is a trajectory that no training uses, in units of measure.

    Attributes:
        inputs: inputs at samples 0 .. N - 1, burn-in first, shape (N, n_inputs).
        outputs: outputs of the reference, or measured ones, at samples 0 .. N, shape
            (N + 1, n_outputs).
        burn_in: number of leading samples in which the initial state decays.
        kind: index of its kind in the recipe (``KindRules.motions``).
        parameters: values of the physical parameters, by name.
    """

    inputs: FloatArray
    outputs: FloatArray
    burn_in: int
    kind: int
    parameters: Mapping[str, float] = field(default_factory=dict)

    def first(self, *needed: int) -> int:
        """Return the first sample that is scored: after the burn-in, all inputs behind it set.

        Args:
            needed: samples that the networks look back, each ``Network.memory_length``.
        """
        return max(self.burn_in + 1, *needed)


def unseen_motions(
    recipe: Recipe, system: System, stream: Stream, count: int, advance: Progress
) -> Iterator[UnseenMotion]:
    """Draw motions one by one and simulate the reference system in this process.

    Raises:
        SimulationError: it could not be simulated, nor on other draws.
    """
    advance(0, count)
    for index in range(count):
        yield _motion(recipe, system, stream, index)
        advance(index + 1, count)


@asked_of_sources
def known_or_simulated(
    system: System, recipe: Recipe, simulate: Callable[[], list[UnseenMotion]]
) -> list[UnseenMotion]:
    """Return unseen motions of a recipe, either already measured or simulated now.

    Raises:
        RecipeError: records have too few samples that are not learnt from.
    """
    return simulate()


def _motion(recipe: Recipe, system: System, stream: Stream, index: int) -> UnseenMotion:
    """Draw a motion and simulate it; where the system fails on it, another one."""

    def run(drawn: Draw) -> UnseenMotion:
        outputs = drawn_outputs(system, drawn)
        return UnseenMotion(drawn.inputs, outputs, drawn.burn_in, drawn.kind)

    return first_that_runs(recipe, system, stream, index, run)
