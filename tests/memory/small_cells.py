"""Small networks whose memory is known, as surrogates of the tiny recipe."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np

from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import Signal
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.base import Network
from slide_fmu.network.state_space.cell import Cell
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from tests.recipes import TINY, merged, whole_recipe


def recipe_of(**stability: Any) -> Recipe:
    """The tiny recipe with a state-space network and limits of its own."""
    tables = tomllib.loads(TINY)
    del tables["network"], tables["training"]
    return whole_recipe(merged(tables, {"stability": stability}))


RECIPE = recipe_of()
CASE = case_of(RECIPE)
SYSTEM = CASE.system


INPUTS = FeatureMap(Differences(1))
"""Features that are the input."""


def surrogate_of(
    network: Network,
    outputs: tuple[Signal, ...] = SYSTEM.outputs,
    inputs: tuple[Signal, ...] = SYSTEM.inputs,
) -> Surrogate:
    window = Window(*(getattr(RECIPE.window, name) for name in ("step", "n_in", "n_out")))
    return Surrogate(
        "tiny", window, inputs, outputs, range_scaling(inputs), range_scaling(outputs), network
    )


def network_of(cell: Cell | CellPolynomial) -> StateSpace:
    return StateSpace(cell, RECIPE.window.n_in, RECIPE.window.n_out, INPUTS)


def scalar_cell(
    pole: float, gain: float = 1.0, effect: float = 0.0, units: str = "tanh", weight: float = 1.0
) -> Cell:
    """x -> pole x + gain u + effect act(weight x), y = x."""

    def matrix(*values: float) -> np.ndarray:
        return np.array([values], np.float32)

    zero = np.zeros(1, np.float32)
    row = matrix(weight, 0.0, 0.0)
    return Cell(
        matrix(pole), matrix(gain), matrix(effect), row, matrix(1.0), matrix(0.0), zero, units
    )
