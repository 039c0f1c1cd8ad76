"""Small surrogates of records, for tests."""

from __future__ import annotations

from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.surrogate.surrogate import Surrogate
from tests.memory.small_cells import scalar_cell


def scalar_surrogate(
    recipe: Recipe, source: MeasuredRecords, pole: float, effect: float
) -> Surrogate:
    """A surrogate of x -> pole x + 5 u + effect tanh(x)."""
    window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
    cell = scalar_cell(pole, gain=5.0, effect=effect)
    network = StateSpace(cell, window.n_in, window.n_out, FeatureMap(Differences(1)))
    scalings = range_scaling(source.inputs), range_scaling(source.outputs)
    return Surrogate("bench", window, source.inputs, source.outputs, *scalings, network)
