"""The companion of a surrogate: the same network again, or a larger one, from other trajectories.

It shows the scale of the surrogate's error only when it is about as accurate: else the difference
of both is its own error. Where it errs less, the difference is the surrogate's error itself. So a
recipe may give it more units and a longer training (``bound.companion``). Sizes that the recipe
leaves open are those that were found for the surrogate. A training may end in a worse minimum, so
there are several attempts (``bound.attempts``). One that goes on from the surrogate's network
cannot, and takes little time; but it lacks what the surrogate lacks, and then the difference of
both does not show it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch

from slide_fmu.core.progress import Stages
from slide_fmu.features.base import Offered
from slide_fmu.fitting.feature_search import choices
from slide_fmu.fitting.history import History
from slide_fmu.fitting.network import Part, fit_network
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import companion_recipe
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source

STAGE = "companion"
"""The stage has this name in the progress and in the figures."""

ACCURATE = 1.3
"""A companion whose validation error is at most so many times the surrogate's is accurate enough.
A less accurate one makes bounds wider, since its own error is most of the disagreement."""


def fit_companion(
    recipe: Recipe,
    surrogate: Surrogate,
    error: float,
    machine: tuple[Source, Offered, Surrogate | None],
    places: tuple[Path, Path],
    device: torch.device,
    progress: Stages,
) -> tuple[Surrogate, History]:
    """Fit the companion of a surrogate with a validation error; the most accurate of all attempts.

    Machine and places are as of ``slide_fmu.fitting.network.fit_network``.

    Raises:
        StoreError: trajectories are missing.
        TrainingError: a training diverged.
    """
    assert recipe.bound is not None
    split = "train" if recipe.data.companion == "train" else "companion"
    assert isinstance(surrogate.network, StateSpace)
    table, offered = recipe.network, machine[1]
    assert isinstance(table, StateSpaceRecipe)
    searched = len(choices(table, offered, len(surrogate.outputs))) > 1
    sized = recipe if searched else with_sizes_of(recipe, surrogate.network)
    goes_on = recipe.bound.companion.start == "surrogate"
    found: list[tuple[float, Surrogate, History]] = []
    for attempt in range(recipe.bound.attempts):
        stage = STAGE if attempt == 0 else f"{STAGE}, attempt {attempt + 1}"
        # the surrogate is chosen by the usual trajectories: by them, its network might just stay
        part = Part(stage, split, surrogate.output_scaling, split if goes_on else "validation")
        begun = (*machine[:2], surrogate) if goes_on else machine
        other = companion_recipe(sized, attempt)
        fitted, histories = fit_network(other, begun, places, device, progress, part)
        if goes_on and _same(fitted, surrogate):
            goes_on = False  # it teaches nothing: the next attempt begins anew
            if attempt + 1 < recipe.bound.attempts:
                continue
        history = histories[stage]
        found.append((min(history.validation_error), fitted, history))
        if goes_on or found[-1][0] <= ACCURATE * error:
            break
    _, companion, history = min(found, key=lambda one: one[0])
    return companion, history


def with_sizes_of(recipe: Recipe, network: StateSpace) -> Recipe:
    """Return a recipe whose keys ``"auto"`` of the table ``network`` are as a network has them.

    Its features are those that the recipe names, or the only ones that there are.
    """
    table, cell = recipe.network, network.cell
    assert isinstance(table, StateSpaceRecipe)
    n_units, padding = len(cell.w), table.padding
    if table.units == "auto" and cell.activation != StateSpaceRecipe.model_fields["units"].default:
        padding = 0  # as the trials that found these units left it
    order = len(cell.a) - (padding if n_units else 0)
    found: dict[str, Any] = {"order": order, "hidden": n_units, "units": cell.activation}
    sizes = {key: value for key, value in found.items() if getattr(table, key) == "auto"}
    if "units" in sizes:
        sizes |= {"substeps": cell.substeps, "padding": padding}  # they were found together
    return recipe.model_copy(update={"network": table.model_copy(update=sizes)})


def _same(one: Surrogate, other: Surrogate) -> bool:
    """Tell whether the networks of two surrogates are the same."""
    networks = one.network, other.network
    cells = [network.cell.arrays() for network in networks if isinstance(network, StateSpace)]
    return all(np.array_equal(cells[0][name], cells[1][name]) for name in cells[0])
