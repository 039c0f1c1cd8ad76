"""A search goes to dearer candidates while they pay, and says why it ended."""

from __future__ import annotations

import math

import pytest

from slide_fmu.fitting.ladder import (
    Ladder,
    cheapest_as_good,
    fewest_by_halving,
    pays,
    run_while_it_pays,
)

INF = math.inf


def ladder(errors: list[float], ahead: int = 0, good: float = 0.0) -> Ladder[int]:
    """Candidates 0, 1, ... with these errors; a dearer one must be better by a fifth."""
    return Ladder(
        error=lambda place: errors[place],
        dearer=lambda place: [place + 1] if place + 1 < len(errors) else [],
        worth=0.8,
        named=lambda place: f"size {place}",
        enough=lambda place: "it is good" if errors[place] < good else None,
        ahead=lambda place: ahead,
    )


@pytest.mark.parametrize(
    ("errors", "ahead", "chosen"),
    [
        ([1.0], 0, 0),
        ([1.0, 0.7, 0.5], 0, 2),
        ([1.0, 0.9, 0.5], 0, 0),
        ([1.0, 0.9, 0.5], 1, 2),
        ([1.0, 0.9, 0.95, 0.5], 1, 0),
        ([1.0, 0.9, 0.95, 0.5], 3, 3),
        ([INF, INF, 0.9], 1, 2),
        ([INF, 0.9], 0, 1),
        ([0.9, INF], 3, 0),
        ([0.9, math.nan], 0, 0),
        ([0.0, 0.0], 0, 0),
    ],
)
def test_search_ends_where_the_next_candidate_does_not_pay(
    errors: list[float], ahead: int, chosen: int
) -> None:
    assert ladder(errors, ahead).climb(0).chosen == chosen


def test_equals_are_compared_with_each_other_first() -> None:
    errors = {"tanh": 1.0, "mixed": 0.7, "cubic": 0.6}
    kinds = Ladder(
        error=lambda kind: errors[kind],
        dearer=lambda kind: ["mixed", "cubic"] if kind == "tanh" else [],
        worth=0.8,
    )
    assert kinds.climb("tanh").chosen == "cubic"


@pytest.mark.parametrize(
    ("errors", "good", "sentence"),
    [
        ([1.0], 0.0, "size 0: error 1; nothing larger is tried"),
        (
            [1.0, 0.5, 0.45],
            0.0,
            "size 1: error 0.5, 50 % less than size 0, which pays; size 2: 10 % less than size 1, "
            "which does not pay (at least 20 % would)",
        ),
        (
            [1.0, 0.5, 0.45],
            0.6,
            "size 1: error 0.5, 50 % less than size 0, which pays; it is good",
        ),
        (
            [0.5, 0.75],
            0.0,
            "size 0: error 0.5; size 1: 50 % more than size 0, which does not pay (at least 20 % "
            "would)",
        ),
        (
            [0.5, INF],
            0.0,
            "size 0: error 0.5; size 1: error inf instead of 0.5, which does not pay (at least "
            "20 % would)",
        ),
    ],
)
def test_explanation_compares_the_choice_with_its_neighbours(
    errors: list[float], good: float, sentence: str
) -> None:
    assert ladder(errors, good=good).climb(0).explanation == sentence


def test_cheapest_candidate_that_is_as_good_is_taken() -> None:
    errors = [0.5, 0.21, 0.2]
    assert cheapest_as_good(range(3), lambda place: errors[place], 0.22) == 1
    assert cheapest_as_good(range(3), lambda place: errors[place], 0.1) is None


@pytest.mark.parametrize("enough", range(1, 31))
def test_least_number_that_is_as_good_is_found_by_few_trials(enough: int) -> None:
    tried = []

    def error(number: int) -> float:
        tried.append(number)
        return 1.0 if number < enough else 0.1

    assert fewest_by_halving(30, error, 0.2) == enough
    assert len(tried) <= 6
    assert fewest_by_halving(enough, lambda number: 1.0, 0.2) is None


def test_rounds_end_with_the_first_one_that_hardly_helps() -> None:
    rounds = [lambda error: error * 0.5, lambda error: error * 0.9, lambda error: error * 0.1]
    last = run_while_it_pays(1.0, rounds, lambda after, before: pays(after, before, 0.8))
    assert last == pytest.approx(0.45)
