"""Tones, offsets, holds and moves are tried on a surrogate, and the worst ones are found."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.figures import plain, read_figures
from slide_fmu.core.readable import ratio_text
from slide_fmu.core.signals import FloatArray
from slide_fmu.recipe.case import Case
from slide_fmu.report.trust_sections import search_sections
from slide_fmu.report.trust_sentences import search_sentence, tries_sentences
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.adversarial import search_figures
from slide_fmu.validation.tries import TriedInputs, try_inputs
from slide_fmu.validation.trust_figures import SearchFigures
from slide_fmu.validation.user_inputs import Point
from tests.bounded import with_tolerances
from tests.progress import silent
from tests.recipes import tiny_state_space_recipe
from tests.validation.test_adversarial import surrogate_of
from tests.validation.test_user_inputs import repeated

RECIPE = tiny_state_space_recipe(
    bound={}, data={"duration": 8.0, "burn_in": 1.0}, validation={"adversarial": 2}
)
SURROGATE = surrogate_of(RECIPE, 1e9)
WRONG_AT, DAMPING = 0.9, 0.97
"""Angular frequency in rad per sample, and damping per sample, of what the surrogate misses."""
TRIES = 40


class Wrong(System):
    """The surrogate, and a narrow resonance that it has never learnt."""

    def __init__(self, like: Surrogate) -> None:
        self.step, self.inputs, self.outputs = like.window.step, like.inputs, like.outputs
        self._like = like

    def simulate(self, inputs: FloatArray) -> FloatArray:
        from scipy.signal import lfilter

        poles = [1.0, -2 * DAMPING * np.cos(WRONG_AT), DAMPING**2]
        missed = lfilter([1.0], poles, inputs[:, 0] / self.inputs[0].high)
        right = self._like.predict_newest(inputs)
        scale = 0.3 * np.median(self._like.error_bounds(inputs), axis=0)
        found = right + scale * missed[:, None]
        return np.concatenate([found[:1], found])


class Refusing(Wrong):
    """It fails on every second trajectory."""

    calls = 0

    def simulate(self, inputs: FloatArray) -> FloatArray:
        self.calls += 1
        if self.calls % 2:
            raise SimulationError("the solver did not converge")
        return super().simulate(inputs)


class OneSystem:
    """The systems of a case whose reference is given."""

    def __init__(self, reference: System) -> None:
        self.reference = reference


def case_with(system: System) -> Case:
    return Case(RECIPE, OneSystem(system))  # type: ignore[arg-type]


def usual_of(surrogate: Surrogate) -> FloatArray:
    return np.full(len(surrogate.outputs), 1e-3)


def tried_with(system: System, seed: int = 1, count: int = TRIES) -> TriedInputs:
    return try_inputs(SURROGATE, case_with(system), usual_of(SURROGATE), seed, count, silent)


@pytest.fixture(scope="module")
def tried() -> TriedInputs:
    return tried_with(Wrong(SURROGATE))


def test_frequency_at_which_a_surrogate_is_wrong_is_found(tried: TriedInputs) -> None:
    worst = tried.worst_first[0].figures
    tones = [float(w) for w in re.findall(r"sin\(([\d.]+) t", worst.inputs)]
    wrong = WRONG_AT / RECIPE.window.step
    assert min(abs(w - wrong) for w in tones) < 0.1 * wrong
    assert worst.over_bound > 2.0
    noise = np.random.default_rng(0).uniform(-1, 1, (2000, 1)) * SURROGATE.inputs[0].high
    errors = np.abs(Wrong(SURROGATE).simulate(noise)[1:] - SURROGATE.predict_newest(noise))
    assert np.max(errors / SURROGATE.error_bounds(noise)) < worst.over_bound / 1.5


def test_worst_is_repeated_by_its_words(tried: TriedInputs) -> None:
    worst = tried.worst_first[0]
    name, words = worst.figures.inputs.split(" ", 1)
    (signal,) = SURROGATE.inputs
    assert name == signal.name
    step = RECIPE.window.step
    time = step * np.arange(round((1.0 + 8.0) / step))
    inputs = repeated(words, signal.unit, time)[:, None]
    errors = np.abs(Wrong(SURROGATE).simulate(inputs)[1:] - SURROGATE.predict_newest(inputs))
    ratios = (errors / SURROGATE.error_bounds(inputs))[worst.found.first :]
    assert ratios.max() == pytest.approx(worst.figures.over_bound, rel=1e-3)
    assert errors[worst.found.first :].max() == pytest.approx(worst.figures.largest_error)


def test_same_seed_tries_the_same(tried: TriedInputs) -> None:
    one, other = (tried_with(Wrong(SURROGATE), seed, 6) for seed in (1, 2))
    again = tried_with(Wrong(SURROGATE), 1, 6)
    assert plain(again.tries[-1].figures) == plain(one.tries[-1].figures)
    assert again.tries[0].figures.inputs != other.tries[0].figures.inputs
    assert len(tried.tries) == TRIES


def test_second_half_lies_near_the_worst_before(tried: TriedInputs) -> None:
    for index in range(TRIES // 2, TRIES):
        point: Point = tried.tries[index].point
        before = [
            one.point
            for one in TriedInputs(tried.tries[:index]).worst_first
            if one.point.kind == point.kind
        ]
        assert np.median(np.abs(point.place - before[0].place)) < 0.3


def test_reference_that_fails_costs_a_try() -> None:
    found = tried_with(Refusing(SURROGATE), 1, 6)
    assert (len(found.tries), found.failed) == (3, 3)
    assert search_figures([], SURROGATE, found).failed_tries == 3


def test_errors_that_are_flagged_do_not_count() -> None:
    strict = with_tolerances(SURROGATE, 1e-18)
    found = try_inputs(strict, case_with(Wrong(strict)), usual_of(strict), 1, 3, silent)
    assert [(one.figures.over_bound, one.figures.flagged) for one in found.tries] == [(0, 1)] * 3
    assert [one.figures.unnoticed for one in found.tries] == [0] * 3


def figures_of(tried: TriedInputs) -> SearchFigures:
    return SearchFigures(
        starts=1,
        changes_tried=100,
        confidences=(0.95, 0.99),
        before=(1.0,),
        after=(1.5,),
        after_highest=(1.2,),
        broken=0,
        broken_at_highest=0,
        tries=tuple(one.figures for one in tried.worst_first),
        failed_tries=1,
    )


def test_words_have_the_number_that_broke_the_bound_and_the_worst(tried: TriedInputs) -> None:
    figures = figures_of(tried)
    broken = sum(one.figures.over_bound > 2 for one in tried.tries)
    sentence = search_sentence(figures)
    worst = figures.tries[0]
    assert f"On {broken} of {TRIES} an error was more than 2 times its bound of 95 %" in sentence
    assert "while trusted is true" in sentence
    assert "On 1 more the reference failed." in sentence
    assert f"by its error and its bound together, was {worst.kind}: {worst.inputs}." in sentence
    assert f"{ratio_text(worst.over_bound)} times its bound" in sentence
    sections = search_sections(figures, [], tried, SURROGATE)
    assert [len(section.charts) for section in sections] == [0, 1]
    table = sections[1].table
    assert table is not None
    assert (table.rows[0][0], table.rows[0][2]) == (worst.kind, worst.inputs)


def test_figures_of_a_search_without_tries_are_read_and_say_nothing_of_them(
    tried: TriedInputs,
) -> None:
    figures = figures_of(tried)
    assert read_figures(SearchFigures, plain(figures)) == figures
    alone = plain(replace(figures, tries=(), failed_tries=0))
    assert alone.keys().isdisjoint({"tries", "failed_tries"})
    read = read_figures(SearchFigures, alone)
    assert tries_sentences(read) == []
    assert "an error at trusted steps of 1.5 times its bound" in search_sentence(read)
