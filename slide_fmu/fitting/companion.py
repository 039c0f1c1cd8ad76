"""The companion of a surrogate: the same network again, or a larger one, from other trajectories.

It shows the scale of the surrogate's error only when it is about as accurate: else the difference
of both is its own error. Where it errs less, the difference is the surrogate's error itself. So a
recipe may give it more hidden units and a longer training (``bound.companion``). Sizes that the
recipe leaves open are those that were found for the surrogate. A training may end in a worse
minimum, so there are several attempts (``bound.attempts``). One that goes on from the surrogate's
network cannot, and takes little time; but it lacks what the surrogate lacks, and then the
difference of both does not show it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.fitting.feature_search import STAGE as FEATURES
from slide_fmu.fitting.history import History
from slide_fmu.fitting.network import SURROGATE, Fit, Part, fit_network
from slide_fmu.fitting.preparation import Work
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import companion_recipe
from slide_fmu.surrogate.surrogate import Surrogate

STAGE = "companion"
"""The stage has this name in the progress and in the figures."""

ACCURATE = 1.3
"""A companion is accurate enough if its validation error is at most this factor on the surrogate's.
A less accurate one makes bounds wider, since its own error is most of the disagreement."""


def fit_companion(work: Work, fit: Fit) -> tuple[Surrogate, History]:
    """Fit the companion of a surrogate; return the most accurate of all attempts.

    Raises:
        StoreError: trajectories are missing.
        TrainingError: a training diverged.
    """
    recipe, surrogate = work.recipe, fit.surrogate
    assert recipe.bound is not None
    split = "train" if recipe.data.companion == "train" else "companion"
    accurate = ACCURATE * min(fit.histories[SURROGATE].validation_error)
    # where features were tried, the companion tries them too, and finds its own sizes
    searched = any(name.startswith(FEATURES) for name in fit.histories)
    sized = recipe if searched else fit.recipe
    goes_on = recipe.bound.companion.start == "surrogate"
    found: list[tuple[float, Surrogate, History]] = []
    for attempt in range(recipe.bound.attempts):
        stage = STAGE if attempt == 0 else f"{STAGE}, attempt {attempt + 1}"
        # the surrogate is chosen by the usual trajectories: by them, its network might just stay
        judged_by = split if goes_on else "validation"
        part = Part(stage, split, judged_by, surrogate.output_scaling)
        begun = surrogate if goes_on else work.known
        other = fit_network(
            replace(work, recipe=companion_recipe(sized, attempt), known=begun), part
        )
        if goes_on and _same(other.surrogate, surrogate):
            goes_on = False  # it teaches nothing: the next attempt begins anew
            if attempt + 1 < recipe.bound.attempts:
                continue
        history = other.histories[stage]
        error = min(history.validation_error)
        found.append((error, other.surrogate, history))
        if goes_on or error <= accurate:
            break
    _, companion, history = min(found, key=lambda one: one[0])
    return companion, history


def _same(one: Surrogate, other: Surrogate) -> bool:
    """Tell whether the networks of two surrogates are the same."""
    networks = one.network, other.network
    cells = [network.cell.arrays() for network in networks if isinstance(network, StateSpace)]
    return all(np.array_equal(cells[0][name], cells[1][name]) for name in cells[0])
