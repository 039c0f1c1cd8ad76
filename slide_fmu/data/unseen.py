"""Unseen motions: trajectories that no training saw, with what the reference does on them.

Of records they are the blocks of the part "test".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw, Stream, drawn_outputs, first_that_runs
from slide_fmu.data.recorded import unseen_stretches
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.base import System


@dataclass(frozen=True, eq=False)
class UnseenMotion:
    """A motion is an unseen trajectory, in physical units.

    Attributes:
        inputs: inputs at samples 0 .. N - 1, burn-in first, shape (N, n_inputs).
        outputs: outputs of the reference, or measured ones, at samples 0 .. N, shape
            (N + 1, n_outputs).
        burn_in: number of leading samples in which the initial state decays.
        kind: index of its excitation in the recipe's mix, or of the record's file.
    """

    inputs: FloatArray
    outputs: FloatArray
    burn_in: int
    kind: int

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


def measured_motions(recipe: Recipe, source: MeasuredRecords) -> list[UnseenMotion]:
    """Return the blocks of records that nothing was learnt from.

    Raises:
        RecipeError: there is too little of them.
    """
    return [
        UnseenMotion(found.trajectory.inputs, found.trajectory.outputs, found.lead, found.file)
        for found in unseen_stretches(recipe, source)
    ]


def _motion(recipe: Recipe, system: System, stream: Stream, index: int) -> UnseenMotion:
    """Draw a motion and simulate it; where the system fails on it, another one."""

    def run(drawn: Draw) -> UnseenMotion:
        outputs = drawn_outputs(system, drawn)
        return UnseenMotion(drawn.inputs, outputs, drawn.burn_in, drawn.kind)

    return first_that_runs(recipe, system, stream, index, run)
