"""Unseen motions and what the reference model of a recipe does on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw, Stream, draw
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import reference_system
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate


@dataclass(frozen=True, eq=False)
class Motion:
    """One unseen motion.

    Attributes:
        drawn: inputs, initial state and kind of excitation.
        reference: outputs of the reference model at samples 0 .. N, shape (N + 1, n_outputs).
    """

    drawn: Draw
    reference: FloatArray

    def first(self, *needed: int) -> int:
        """The first sample that is scored: after the burn-in, all inputs behind it set.

        Args:
            needed: samples that the networks look back, each ``Network.memory_length``.
        """
        return max(self.drawn.burn_in + 1, *needed)


def unseen_motions(
    recipe: Recipe, stream: Stream, count: int, advance: Progress
) -> Iterator[Motion]:
    """Draw motions one by one and simulate the reference model in this process.

    Raises:
        LoadError: the reference model is not installed here.
        SimulationError: it could not be simulated.
    """
    system = reference_system(recipe)
    advance(0, count)
    for index in range(count):
        drawn = draw(recipe, system, stream, index)
        yield Motion(drawn, simulate(system, drawn.inputs, drawn.initial).outputs)
        advance(index + 1, count)


def scored(surrogate: Surrogate, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Error of the newest outputs, as in a co-simulation, and the reference.

    Returns:
        Surrogate minus reference, and reference, from the first scored sample on, shape
        (n_scored, n_outputs) each, in the outputs' units.
    """
    first = motion.first(surrogate.network.memory_length)
    reference = motion.reference[first:]
    newest = surrogate.predict_newest(motion.drawn.inputs)[first - 1 :]
    return newest - reference, reference
