"""What tells the source of a recipe's trajectories from another, or from what it was before."""

from __future__ import annotations

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import probe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.base import Source, System


def identity(recipe: Recipe, source: Source) -> FloatArray:
    """Return numbers that change when a model or a record changes, shape (n, m).

    Of a model they are the outputs of a short motion (``slide_fmu.data.draws.probe``), of records
    a digest of their files; ``slide_fmu.data.fingerprint.same_motion`` compares them.

    Raises:
        SimulationError: the model could not be simulated.
    """
    if isinstance(source, System):
        return probe(recipe, source)
    assert isinstance(source, MeasuredRecords)
    return source.identity
