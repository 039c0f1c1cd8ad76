"""Lengths that a recipe leaves open follow from how long the system remembers."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.window import Window
from slide_fmu.memory import lengths, motions
from slide_fmu.memory.decay import DECAY_MARGIN, Decay
from slide_fmu.memory.lengths import find_lengths, tidy
from slide_fmu.memory.sizing import ShortWindowError, Sizing, require_window, size_window
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from tests.memory.plain_systems import Lag
from tests.recipe.test_automatic import KEYS, open_recipe
from tests.recipes import ESTIMATOR
from tests.refusals import refused

LAG = 0.5 * math.log(100)
"""s to 1 %."""


@pytest.fixture(autouse=True)
def few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "MOTIONS", 6)


def of_lag(
    name: str = "Lag", parameters: dict[str, Any] | None = None, **changes: Any
) -> OpenRecipe:
    """A recipe that leaves all lengths open, of a system that can only be simulated."""
    step = {"step": 0.05, **changes.pop("window", {})}
    read = open_recipe(window=step, **changes)
    tables = read.guess.model_dump()
    tables["system"] = {
        "model": f"tests.memory.plain_systems:{name}",
        "parameters": parameters or {},
    }
    for place in read.open_keys:
        table, key = place.split(".")
        del tables[table][key]
    return OpenRecipe.of(tables, "it")


@pytest.mark.parametrize("model", ["plain", "oscillator"])
def test_window_holds_the_decay_time_with_its_margin(model: str) -> None:
    recipe = of_lag() if model == "plain" else open_recipe()
    found = find_lengths(recipe, case_of(recipe.guess).system)
    assert found.sizing is not None
    longest = max(found.sizing.needed, found.sizing.measured.slowest)
    if model == "plain":
        assert longest == pytest.approx(LAG, rel=0.02)
    window = found.recipe.guess.window
    truncated = window.n_in - window.n_out
    assert truncated == tidy(math.ceil(DECAY_MARGIN * longest / window.step))
    assert window.n_out == truncated // 2
    assert found.recipe.guess.data.burn_in == pytest.approx(window.n_in * window.step)
    assert found.recipe.guess.data.duration >= 6 * window.n_in * window.step
    assert found.recipe.open_keys == ()
    assert set(found.values) == {"window", "data"}
    require_window(
        found.recipe.guess, size_window(found.recipe.guess, case_of(recipe.guess).system, seed=99)
    )


def test_same_recipe_gives_the_same_lengths() -> None:
    one, other = (find_lengths(of_lag(), case_of(of_lag().guess).system).values for _ in range(2))
    assert one == other


def test_what_is_given_stays() -> None:
    recipe = of_lag(window={"n_out": 7}, data={"duration": 9.0})
    found = find_lengths(recipe, case_of(recipe.guess).system).recipe.resolved()
    assert (found.window.n_out, found.data.duration) == (7, 9.0)
    assert found.window.n_in - 7 == tidy(math.ceil(DECAY_MARGIN * LAG / 0.05))


def test_given_window_needs_no_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lengths, "size_window", None)
    recipe = of_lag(window={"n_in": 90})
    found = find_lengths(recipe, case_of(recipe.guess).system)
    assert found.values["window"] == {"n_out": 30}
    assert found.sizing is None
    assert found.values["data"]["burn_in"] == 4.5


def test_lags_of_an_estimator_fit_into_the_window() -> None:
    network = {**ESTIMATOR["network"], "time_invariant": True}
    estimator = {**ESTIMATOR, "network": network, "expert": {"lags": [0, 150]}, "span": 4000}
    recipe = of_lag(estimator=estimator, data={"estimator": 2, "estimator_validation": 1})
    found = find_lengths(recipe, case_of(recipe.guess).system).recipe.resolved()
    assert found.window.n_in - found.window.n_out == 150
    assert found.data.duration >= 4000 * 0.05


def test_trajectories_are_long_enough_for_the_spans_of_a_bound() -> None:
    tables = of_lag().guess.model_dump(exclude={"network", "training"})
    for place in KEYS:
        table, key = place.split(".")
        del tables[table][key]
    tables["bound"] = {"estimate_span": 60.0, "expert": {"long_span": 40.0}}
    recipe = OpenRecipe.of(tables, "it")
    found = find_lengths(recipe, case_of(recipe.guess).system).recipe.resolved()
    assert found.bound is not None
    assert found.data.duration == pytest.approx(found.bound.samples(found.window) * 0.05)
    assert found.data.duration > 0.05 * (1024 + found.window.n_in)


def test_given_duration_that_is_too_short_is_named() -> None:
    recipe = of_lag(data={"duration": 1.0})
    with refused(RecipeError, "system needs", "duration = 1 s"):
        find_lengths(recipe, case_of(recipe.guess).system)


@pytest.mark.extended
def test_motions_that_never_meet_are_refused_after_their_records_have_grown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counts: list[int] = []
    measure = motions._measure

    def note(found: motions.Motions, count: int) -> Any:
        counts.append(count)
        return measure(found, count)

    monkeypatch.setattr(motions, "_measure", note)
    recipe = of_lag("Undamped")
    with refused(ShortWindowError, "4 of 4", "the outputs"):
        find_lengths(recipe, case_of(recipe.guess).system)
    assert counts[-1] == motions.GROWTH * counts[0]
    assert all(later == 2 * earlier for earlier, later in itertools.pairwise(counts))


def test_record_grows_until_the_motions_of_a_slow_system_meet() -> None:
    recipe = of_lag(parameters={"time_constant": 20.0})
    first = motions.MEASURED_DECAYS * recipe.guess.window.n_in * 0.05
    decay = 20.0 * math.log(100)
    assert first < decay
    sizing = size_window(recipe.guess, case_of(recipe.guess).system)
    assert sizing.linearized is None
    assert sizing.measured.mean == pytest.approx(decay, rel=0.02)


@pytest.mark.parametrize(
    ("count", "rounded"),
    [(1, 1), (7, 7), (15, 15), (16, 16), (17, 18), (39, 40), (48, 48), (101, 104), (1000, 1024)],
)
def test_tidy_numbers_are_at_most_an_eighth_larger(count: int, rounded: int) -> None:
    assert tidy(count) == rounded
    assert count <= rounded <= 1.125 * count


class Sizings:
    """Gives sizings whose slowest pairs take these times in s, one after another."""

    def __init__(self, *slowest: tuple[float, ...]) -> None:
        self.left = list(slowest)

    def __call__(self, recipe: Recipe, system: Any, **options: Any) -> Sizing:
        window = recipe.window
        times = self.left.pop(0)
        rates = np.array([-math.log(100) / seconds for seconds in (1.0, *times)])
        size = Window(window.step, window.n_in, window.n_out)
        return Sizing(size, window.remaining_amplitude, None, Decay(rates, 0.01))


def test_window_of_a_rare_pair_is_found_anew_without_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sizings = Sizings((5.0,), (5.0, 21.0), (5.0,), (5.0, 21.0))
    monkeypatch.setattr(lengths, "size_window", sizings)
    found = find_lengths(of_lag(), Lag())
    truncated = found.recipe.guess.window.n_in - found.recipe.guess.window.n_out
    assert truncated == tidy(math.ceil(DECAY_MARGIN * 5.0 / 0.05))
    assert found.sizing is not None
    assert found.sizing.remark is not None
    assert "takes 21 s to meet" in found.sizing.remark
    assert sizings.left == []


def test_window_that_was_shortened_grows_again_with_more_motions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sizings = Sizings((21.0,), (5.0,), (9.0, 9.0), (3.0,))
    monkeypatch.setattr(lengths, "size_window", sizings)
    found = find_lengths(of_lag(), Lag())
    truncated = found.recipe.guess.window.n_in - found.recipe.guess.window.n_out
    assert truncated == tidy(math.ceil(DECAY_MARGIN * 9.0 / 0.05))
    assert sizings.left == []


def test_window_that_is_a_little_too_long_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lengths, "size_window", Sizings((9.0,), (5.0,)))
    found = find_lengths(of_lag(), Lag())
    truncated = found.recipe.guess.window.n_in - found.recipe.guess.window.n_out
    assert truncated == tidy(math.ceil(DECAY_MARGIN * 9.0 / 0.05))
