"""This module checks that the tables of a recipe fit each other; the checks are one list."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from slide_fmu.excitation.kinds import moving_by_themselves
from slide_fmu.excitation.one_at_a_time import OneAtATime
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.recipe.automatic import LENGTHS
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe

ROLES = {
    "training.expert": "that are not promised",
    "bound": "that no network learns from",
    "validation": "that nothing is learnt from",
}
"""What the kinds of excitation of a table are for, other than the kinds of ``data``."""

MOST_SAMPLES = 10_000_000
"""Largest number of samples of a motion: this one takes 80 MB of memory for each signal."""


def faults(recipe: Recipe, open_keys: Collection[str]) -> list[str]:
    """Return the faults of a recipe, one sentence for each check that fails.

    Open lengths hold first guesses, so checks of lengths are left out for them.
    """
    guessed = any(key in LENGTHS for key in open_keys)
    sentences = []
    for check in CHECKS if guessed else (*CHECKS, *CHECKS_OF_LENGTHS):
        try:
            check(recipe)
        except ValueError as error:
            sentences.append(str(error))
    return sentences


def remarks_on_sampling(recipe: Recipe) -> list[str]:
    """Say which kinds of excitation have frequencies above the Nyquist frequency.

    There is one sentence for each of them. A sampled sine above the Nyquist frequency, pi over the
    step, looks like a slower one.
    """
    limit = math.pi / recipe.window.step
    return [
        f"{table}.excitation, number {number} ({kind.kind}): angular_frequency up to {highest:g} "
        f"rad/s, but samples that are {recipe.window.step:g} s apart show at most {limit:.4g} "
        "rad/s; faster vibrations become slower ones: lower it, or give a smaller window.step"
        for table, kinds in recipe.tables_of_kinds().items()
        for number, kind in enumerate(kinds, 1)
        for highest in [max(getattr(kind, "angular_frequency", None) or (0.0,))]
        if highest > limit
    ]


def require_parameters(recipe: Recipe) -> None:
    """Refuse invalid parameters, and parameters that the recipe gives in another place too."""
    rules_of(recipe).require_parameters(recipe)
    for name, table in recipe.parameters.items():
        table.parameter(name)
        if name == "step":
            raise ValueError(
                "parameters.step; expected a parameter of the model: the sample step of a "
                "surrogate is window.step, and fixed"
            )
        for other in ("parameters", "reference", "inputs", "outputs"):
            if name in getattr(recipe.system, other):
                raise ValueError(
                    f"parameters.{name} is in system.{other} too; expected it in one of them: "
                    f"remove it from system.{other}"
                )
    if recipe.parameters:
        _require_learnable(recipe)


def _require_learnable(recipe: Recipe) -> None:
    names = list(recipe.parameters)
    if not recipe.network.FOLLOWS_PARAMETERS:
        raise ValueError(
            f"parameters {names} with network.family = {recipe.network.family!r}; expected none: "
            "the weights of state-space networks alone follow them"
        )


def require_fitting_tables(recipe: Recipe) -> None:
    """Refuse keys for systems of another kind."""
    rules_of(recipe).require_fitting_tables(recipe)


def require_bound(recipe: Recipe) -> None:
    """Refuse an error bound where it cannot be learnt."""
    if recipe.bound is None:
        if recipe.validation.adversarial:
            raise ValueError(
                f"validation.adversarial = {recipe.validation.adversarial} without a table "
                "[bound]; expected an error bound, which the search attacks: add [bound], or "
                "remove the key"
            )
        return
    remedy = "remove the table [bound] and those below it"
    if recipe.parameters:
        raise ValueError(
            f"[bound] with parameters {list(recipe.parameters)}; expected none: an error bound of "
            f"a surrogate with physical parameters is not built: {remedy}, or the parameters; a "
            "table [estimator] in their place gives an error estimate"
        )
    if not isinstance(recipe.network, StateSpaceRecipe):
        raise ValueError(
            f"[bound] with network.family = {recipe.network.family!r}; expected 'state_space': "
            f"choose it, or {remedy}"
        )
    start, size = getattr(recipe.training, "start", None), recipe.bound.expert.companion.hidden
    if start is not None and size is not None:
        raise ValueError(
            f"bound.expert.companion.hidden = {size} with training.start = {start!r}; expected "
            "none: the companion goes on with that of this FMU as it is: remove the key"
        )
    _require_further(recipe.bound)
    if recipe.bound.estimate_span is not None and recipe.estimator is not None:
        raise ValueError(
            f"bound.estimate_span = {recipe.bound.estimate_span:g} s together with a table "
            "[estimator]; expected one error estimate: remove the key, or the table"
        )
    expert = recipe.bound.expert
    if expert.short_span > expert.long_span:
        raise ValueError(
            f"bound.expert.short_span = {expert.short_span:g} s, bound.expert.long_span = "
            f"{expert.long_span:g} s; expected the short one to be the shorter one"
        )


def _require_further(bound: BoundRecipe) -> None:
    count = bound.expert.further
    if bound.excitation and count == 1:
        raise ValueError(
            "bound.expert.further = 1 with kinds under [[bound.excitation]]; expected at least 2, "
            "one of them to choose by: raise it, or remove the key"
        )
    if count and not bound.excitation:
        raise ValueError(
            f"bound.expert.further = {count} without kinds under [[bound.excitation]]; expected "
            "some, of which these trajectories are: add them, or remove the key"
        )


def _spans_of(bound: BoundRecipe) -> str:
    """Return the times over which a bound averages, by their keys."""
    named = {"bound.expert.long_span": bound.expert.long_span}
    if bound.estimate_span is not None:
        named["bound.estimate_span"] = bound.estimate_span
    return " and ".join(f"{name} = {value:g} s" for name, value in named.items())


def require_kinds_in_one_table(recipe: Recipe) -> None:
    """Refuse kinds of excitation that are both learnt from and held out, or in two tables."""
    known: list[tuple[str, dict[str, Any]]] = []
    for table, kinds in recipe.tables_of_kinds().items():
        own = moving_by_themselves(kinds)
        every = [(kind.kind, kind.model_dump(exclude={"weight"})) for kind in own]
        for name, settings in every:
            for other, others in known:
                if settings == others:
                    raise ValueError(
                        f"{table}.excitation has a {name!r} that is in {other}.excitation too; "
                        f"expected kinds, or settings of them, {ROLES[table]}: remove it from one "
                        "of them"
                    )
        known += [(table, settings) for _, settings in every]


def require_other_kinds(recipe: Recipe) -> None:
    """Refuse tables in which an input moves alone, but that say nowhere how it moves."""
    for table, kinds in recipe.tables_of_kinds().items():
        if kinds and not moving_by_themselves(kinds):
            raise ValueError(
                f"{table}.excitation has the kind 'one_at_a_time' only; expected another kind "
                "in this table, which says how the input moves: add one, or remove 'one_at_a_time'"
            )
        others = moving_by_themselves(kinds)
        known = sorted({str(getattr(one, "kind", "")) for one in others})
        for kind in kinds:
            if isinstance(kind, OneAtATime) and kind.moves_as not in (None, *known):
                raise ValueError(
                    f"{table}.excitation has the kind 'one_at_a_time' with moves_as = "
                    f"{kind.moves_as!r}; expected one of the other kinds of this table, {known}: "
                    "add such a kind, or leave moves_as out"
                )


def require_beyond_learnt(recipe: Recipe) -> None:
    """Refuse trajectories beyond the ranges that no network learns from."""
    if recipe.data.beyond and not recipe.network.LEARNS_BEYOND:
        raise ValueError(
            f"data.beyond = {recipe.data.beyond}; expected 0 for network.family = "
            f"{recipe.network.family!r}: state-space networks alone learn from them"
        )


def require_data_of_estimator(recipe: Recipe) -> None:
    """Refuse an error estimator without trajectories of its own."""
    counts = (recipe.data.estimator, recipe.data.estimator_validation)
    if recipe.estimator is not None and min(counts) < 1:
        raise ValueError(
            f"data.estimator = {counts[0]}, data.estimator_validation = {counts[1]}; "
            "the error estimator needs trajectories of its own, at least one each"
        )


def require_fitting_into_memory(recipe: Recipe) -> None:
    """Refuse motions that are too long for the memory."""
    durations = {
        "data.duration": recipe.data.duration,
        "data.burn_in": recipe.data.burn_in,
        "validation.duration": recipe.validation.duration or 0.0,
        "window.n_in": recipe.window.n_in * recipe.window.step,
    }
    for name, duration in durations.items():
        if duration > MOST_SAMPLES * recipe.window.step:
            raise ValueError(
                f"{name} asks for {duration / recipe.window.step:.4g} samples; expected at most "
                f"{MOST_SAMPLES:,}: shorten it, or choose a larger window.step"
            )


def require_lags_in_window(recipe: Recipe) -> None:
    """Refuse an error estimator that sees inputs before the window."""
    lags = (recipe.estimator and recipe.estimator.expert.lags) or (0,)
    if lags[-1] > recipe.window.n_in - recipe.window.n_out:
        raise ValueError(
            f"estimator.expert.lags end with {lags[-1]}; expected at most n_in - n_out = "
            f"{recipe.window.n_in - recipe.window.n_out}, the age of the oldest input that the "
            "oldest output of the window has seen"
        )


def require_long_trajectories(recipe: Recipe) -> None:
    """Refuse trajectories that are too short for learning or measuring."""
    window, data = recipe.window, recipe.data
    span = 0 if recipe.estimator is None else recipe.estimator.span or 0
    of_bound = 0 if recipe.bound is None else recipe.bound.samples(window)
    longest = max(window.n_in, window.n_in - window.n_out + span, of_bound)
    whole = {
        "data.duration": (data.duration, longest * window.step),
        "validation.duration": (
            recipe.measured_duration(),
            max(recipe.shortest_validation(), of_bound * window.step),
        ),
    }
    for name, (duration, needed) in whole.items():
        if duration < needed - 0.5 * window.step:
            also = f" and estimator.span = {span}" if span else ""
            if recipe.bound is not None:
                also += f" and {_spans_of(recipe.bound)}"
            raise ValueError(
                f"{name} = {duration:g} s; expected at least {needed:g} s for a window of "
                f"n_in = {window.n_in}, n_out = {window.n_out} samples{also}"
            )


def require_judges_among_data(recipe: Recipe) -> None:
    """Refuse files of which a part judges, but whose kind is not one of the data."""
    for table, kinds in recipe.tables_of_kinds().items():
        for kind in kinds:
            if table != "data" and isinstance(kind, Recorded) and kind.judges:
                raise ValueError(
                    f"{table}.excitation has the file {kind.name!r} with learnt = "
                    f"{kind.learnt:g}; expected 1 there, since only files of data.excitation "
                    "judge an FMU: remove learnt, or move the table"
                )


def require_long_files(recipe: Recipe) -> None:
    """Refuse files whose learnt or judging part is shorter than the input window."""
    window = recipe.window.n_in * recipe.window.step
    for kind in recipe.data.excitation:
        if not (isinstance(kind, Recorded) and kind.judges):
            continue
        lasts, least = kind.duration, window / min(kind.learnt, 1.0 - kind.learnt)
        if lasts < least:
            raise ValueError(
                f"data.excitation: {kind.name!r} lasts {lasts:.4g} s, of which "
                f"{kind.learnt * lasts:.4g} s are learnt and the rest judges; expected at least "
                f"{least:.4g} s, so that each part lasts an input window of {window:.4g} s "
                f"(window.n_in = {recipe.window.n_in}): record for longer, or leave the file out"
            )


CHECKS = (
    require_parameters,
    require_fitting_tables,
    require_bound,
    require_kinds_in_one_table,
    require_other_kinds,
    require_judges_among_data,
    require_beyond_learnt,
    require_data_of_estimator,
    require_fitting_into_memory,
)
"""All checks: each takes a recipe, and raises a ValueError with key, value and remedy."""

CHECKS_OF_LENGTHS = (require_lags_in_window, require_long_trajectories, require_long_files)
"""Checks that need the lengths of window and trajectories."""
