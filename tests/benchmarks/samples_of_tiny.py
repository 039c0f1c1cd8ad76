"""A surrogate with random weights for the tiny recipe, as if an FMU held it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from slide_fmu.core.window import Window
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import Shape, random_surrogate
from tests.recipes import TINY

SECOND_KIND = """
[[data.excitation]]
kind = "harmonic"
weight = 1.0
angular_frequency = [5.0, 60.0]
"""
ESTIMATOR = """
[estimator]
expert.resolution = 1e-3
beyond = true
expert.amplitude_factor = [1.0, 2.0]
network = { family = "feed_forward", hidden = [8], time_invariant = true }
training = { steps = 20, batch = 16, learning_rate = 1e-3 }
"""
RECIPE = TINY.replace("[network]", f"{SECOND_KIND}\n[network]", 1).replace(
    "validation = 2", "validation = 2\nestimator = 2\nestimator_validation = 1"
)


def held_by_an_fmu(positions: int = 8) -> tuple[Surrogate, dict[str, Any]]:
    """What ``read_fmu`` gives: the surrogate and its provenance.

    Args:
        positions: evaluations of the error estimator.
    """
    text = RECIPE + ESTIMATOR
    recipe = parse_recipe(text, "tiny")
    system = case_of(recipe).system
    shape = Shape(n_in=48, n_out=8, block=False, positions=positions, name="tiny")
    window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
    surrogate = replace(
        random_surrogate(shape), window=window, inputs=system.inputs, outputs=system.outputs
    )
    return surrogate, {"recipe": text}
