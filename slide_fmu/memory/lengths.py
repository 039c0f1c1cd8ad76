"""Lengths that a recipe leaves open are found: window, trajectories, and their burn-in.

The window follows from the memory of the system, the rest from the window. The same recipe and the
same system always give the same lengths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.memory.decay import DECAY_MARGIN
from slide_fmu.memory.motions import LEAST_MEASURED
from slide_fmu.memory.sizing import AnySizing, NotForgettingError, Sizing, size_window
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.recipe.automatic import LENGTHS, FoundValues, nested
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System

OUTPUTS = 0.5
"""Output samples of a window, relative to its truncated samples: a third of the window."""
WINDOWS = 2
"""Length of a trajectory in windows. Of longer ones, the burn-in would be a smaller part of the
work; but a system forgets, so that as many samples in more trajectories teach more."""
LEAST_SAMPLES = 1024
"""Smallest number of scored samples in a trajectory: some segments of a training."""
ROUNDS = 4
"""Largest number of rounds to size the window: motions as long as the window found may need more
than the motions of a first guess."""
TOO_LONG = 2.0
"""A window is much too long if it truncates this multiple of what its own motions need."""


@dataclass(frozen=True)
class Lengths:
    """Lengths are those found for a recipe.

    Attributes:
        recipe: the recipe with them; numbers of trajectories may still be open.
        values: the lengths by table and key, such as ``{"window": {"n_in": 96}}``.
        sizing: how the window was sized; None if the recipe gives it.
    """

    recipe: OpenRecipe
    values: FoundValues
    sizing: AnySizing | None


def find_lengths(
    recipe: OpenRecipe, system: System, patience: TimeBudget | None = None
) -> Lengths:
    """Find the lengths that a recipe leaves open; if the time is over, from what is known so far.

    If one rare pair among few motions made the window much too long, it is sized once more, and
    then need not cover the slowest pair of its own motions.

    Raises:
        NotForgettingError: no window can cover the system's memory, since it does not forget.
        RecipeError: values of the recipe do not fit the window that its system needs.
        UnstableModeError, SimulationError, ValueError: as for ``size_window``.
    """
    patience = patience or TimeBudget()
    if "window.n_in" not in recipe.open_keys:
        return with_window(recipe, recipe.guess.window.n_in, None)
    # a first estimate, which is cheap
    sizing = size_window(recipe.guess, system, most=LEAST_MEASURED, patience=patience)
    truncated, shortened = _truncated(recipe.guess, sizing), False
    for _ in range(ROUNDS):
        lengths = with_window(recipe, *both_lengths(recipe, truncated))
        if patience.gone("more motions, as long as the window asks for"):
            known = lengths.recipe.guess.window.as_window
            sizing = replace(sizing, window=known, left_out=patience.remark)
            break
        sizing = size_window(lengths.recipe.guess, system, patience=patience)
        asked = _truncated(recipe.guess, sizing, shortened)
        if asked * TOO_LONG <= truncated and not shortened:
            truncated, shortened = asked, True
        elif _time_to_hold(sizing, shortened) <= sizing.window.truncation_time:
            break
        else:
            truncated = max(truncated, asked)
    return Lengths(lengths.recipe, lengths.values, sizing)


def both_lengths(recipe: OpenRecipe, truncated: int) -> tuple[int, int]:
    """Return n_in and n_out of a window that truncates this number of samples."""
    n_out = recipe.guess.window.n_out
    if "window.n_out" in recipe.open_keys:
        n_out = max(1, int(OUTPUTS * truncated))
    return truncated + n_out, n_out


def tidy(count: int) -> int:
    """Round a number of samples up to one of eight numbers between two powers of two."""
    unit = 1 << max(0, count.bit_length() - 4)
    return -(-count // unit) * unit


def _time_to_hold(sizing: Sizing, but_one: bool) -> float:
    """Return the longest decay time in s, by eigenvalues or of a pair of motions that meets.

    With ``but_one`` the slowest pair is left out if there are others: it is known to be rare.
    """
    times = np.sort(sizing.measured.times)
    met = times[np.isfinite(times)]
    slowest = met[-2] if but_one and len(met) > 1 else met[-1]
    return max(sizing.needed, float(slowest))


def _truncated(recipe: Recipe, sizing: Sizing, but_one: bool = False) -> int:
    """Return the number of samples that the window of a recipe must truncate."""
    if not sizing.forgets:
        raise NotForgettingError(f"recipe {recipe.name!r}: {sizing.problem}")
    lags = (recipe.estimator and recipe.estimator.expert.lags) or (0,)
    needed = math.ceil(
        DECAY_MARGIN * _time_to_hold(sizing, but_one) / recipe.window.step * (1.0 - 1e-12)
    )
    return max(1, tidy(needed), lags[-1])


def with_window(recipe: OpenRecipe, n_in: int, n_out: int | None) -> Lengths:
    """Return a recipe with a window, and with the lengths that follow from it."""
    if n_out is None:
        given = "window.n_out" not in recipe.open_keys
        n_out = (
            recipe.guess.window.n_out if given else max(1, round(n_in * OUTPUTS / (1 + OUTPUTS)))
        )
    estimator, bound = recipe.guess.estimator, recipe.guess.bound
    span = (estimator and estimator.span) or 0
    window = recipe.guess.window.model_copy(update={"n_in": n_in, "n_out": n_out})
    of_bound = 0 if bound is None else bound.samples(window)
    scored = max(WINDOWS * n_in, LEAST_SAMPLES + n_in, span + n_in, of_bound)
    step = window.step
    all_values = (n_in, n_out, round(scored * step, 9), round(n_in * step, 9))
    values_of_keys = {
        key: value
        for key, value in zip(LENGTHS, all_values, strict=True)
        if key in recipe.open_keys
    }
    source = f"recipe {recipe.guess.name!r} with the lengths that its system needs"
    values = nested(values_of_keys)
    return Lengths(recipe.with_found(values, source), values, None)
