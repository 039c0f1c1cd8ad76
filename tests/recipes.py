"""A small recipe that simulates and learns in seconds, and changes of it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.learning import TrainingTable
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System

LINEAR_NETWORK = """[[data.excitation]]
kind = "held_random"
weight = 1.0

[network]
family = "feed_forward"
hidden = []
bias = false
"""
"""One kind of excitation and a network without hidden layers, which a linear system needs."""

TINY = (
    """
name = "tiny"
description = "strongly damped oscillator"

[system]
model = "mbs_models.oscillators:LinearOscillator"
parameters = { damping = 40.0, substeps = 6 }

[window]
step = 0.015625
n_in = 48
n_out = 8

[data]
seed = 7
duration = 2.0
burn_in = 0.25
train = 4
validation = 2

"""
    + LINEAR_NETWORK
    + """
[training]
steps = 40
batch = 32
learning_rate = 3e-3
expert.validate_every = 10
"""
)

ESTIMATOR: dict[str, Any] = {
    "expert": {"resolution": 1e-6},
    "network": {"family": "feed_forward", "hidden": [8], "activation": "tanh"},
    "training": {
        "steps": 20,
        "batch": 16,
        "learning_rate": 1e-3,
        "expert": {"validate_every": 10},
    },
}


FMU_RECIPE = """
name = "car"
description = "quarter car"

[system]
kind = "fmu"
model = "MODEL"

[system.inputs.road]
range = [-0.05, 0.05]

[system.outputs.suspension_travel]
range = [-0.1, 0.1]

[window]
step = 0.005
n_in = 16
n_out = 8

[data]
duration = 0.5
burn_in = 0.1
train = 2
validation = 1

[[data.excitation]]
kind = "held_random"
weight = 1.0
"""


def whole_recipe(tables: dict[str, Any]) -> Recipe:
    """The recipe of tables that leave nothing to be found."""
    return OpenRecipe.of(tables, "it").resolved()


def tiny_recipe(**changes: Any) -> Recipe:
    """The tiny recipe; tables given as keyword arguments are merged into it."""
    return whole_recipe(merged(tomllib.loads(TINY), changes))


def case_of_object(system: System) -> Case:
    """The tiny recipe of a system that a session gives, with that system."""
    tables = tomllib.loads(TINY)
    tables["system"] = {"model": "given", "kind": "object"}
    step = {"window": {"step": system.step}, "data": {"duration": 128 * system.step}}
    return case_of(whole_recipe(merged(tables, step)), system)


def recipe_of_model(model: Path, **changes: Any) -> Recipe:
    """The tiny recipe of another model: a function in a file."""
    tables = tomllib.loads(TINY)
    tables["system"] = {"model": str(model), "kind": "function"}
    return whole_recipe(merged(tables, changes))


def tiny_state_space_recipe(**changes: Any) -> Recipe:
    """The tiny recipe with the network and the training that a recipe has by default."""
    tables = tomllib.loads(TINY)
    del tables["network"], tables["training"]
    return whole_recipe(merged(tables, changes))


def merged(table: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """A table with nested changes."""
    result = dict(table)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = merged(result[key], value) if both else value
    return result


def with_expert(training: TrainingTable, /, **changes: Any) -> TrainingTable:
    """Return a training with other keys, also those of its table ``expert``."""
    own = {key: value for key, value in changes.items() if key in type(training).model_fields}
    tuned = {key: value for key, value in changes.items() if key not in own}
    expert = training.expert.model_copy(update=tuned)
    return training.model_copy(update={"expert": expert, **own})
