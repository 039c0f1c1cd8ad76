"""The search for a structure: what it takes, and where it ends."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from slide_fmu.apps.compare.baselines.base import Baseline, Budget
from slide_fmu.apps.compare.baselines.free_run import diverged, judged
from slide_fmu.apps.compare.baselines.search import PATIENCE, search
from slide_fmu.core.signals import FloatArray
from tests.apps.compare.lessons import lesson, linear, silent

LESSON = lesson(linear)
TRUE = LESSON.validation[1]


class Off(Baseline):
    """A model that knows the truth but for an offset; from some trajectory on it runs away."""

    def __init__(self, offset: float, bounded: int = 3) -> None:
        self.offset, self.bounded = offset, bounded
        self.parameters, self.start_length = 1, 1

    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        number = int(np.flatnonzero((LESSON.validation[0] == inputs).all(axis=(1, 2)))[0])
        values = TRUE[number, 1:] + self.offset
        return values if number < self.bounded else np.full_like(values, np.inf)


def structure(*models: Baseline, seconds: float = 0.0) -> Callable[[], list[tuple[str, Baseline]]]:
    """A structure with some variants, which takes CPU time."""

    def fit() -> list[tuple[str, Baseline]]:
        end = time.process_time() + seconds
        while time.process_time() < end:
            pass
        return [(f"off by {model.offset}", model) for model in models if isinstance(model, Off)]

    return fit


def test_best_variant_of_all_structures_is_taken() -> None:
    structures = [structure(Off(3), Off(2)), structure(Off(1), Off(4)), structure(Off(5))]
    learnt = search(structures, LESSON, Budget(60), silent)
    assert (learnt.structure, learnt.cut) == ("off by 1", False)


def test_model_that_diverges_is_taken_only_where_all_do() -> None:
    lost, worse = Off(0.01, bounded=2), Off(0.5)
    assert search([structure(lost, worse)], LESSON, Budget(60), silent).baseline is worse
    learnt = search([structure(Off(0.1, bounded=0), lost)], LESSON, Budget(60), silent)
    assert learnt.baseline is lost


def test_search_ends_with_its_budget_and_says_so() -> None:
    structures = [structure(Off(2), seconds=0.05), structure(Off(1), seconds=5)]
    budget = Budget(0.1)
    learnt = search(structures, LESSON, budget, silent)
    assert (learnt.structure, learnt.cut) == ("off by 2", True)
    assert budget.spent < 1


def test_first_structure_is_fitted_whatever_the_budget_says() -> None:
    learnt = search([structure(Off(2))], LESSON, Budget(1e-9), silent)
    assert (learnt.structure, learnt.cut) == ("off by 2", False)


def test_search_ends_where_larger_structures_bring_nothing() -> None:
    later: list[Callable[[], list[tuple[str, Baseline]]]] = [structure(Off(2))] * PATIENCE

    def never() -> list[tuple[str, Baseline]]:
        raise AssertionError

    assert search([structure(Off(1)), *later, never], LESSON, Budget(60), silent).cut is False


def test_judgement_counts_what_diverges_and_takes_the_error_of_the_rest() -> None:
    lost, error = judged(Off(0.5, bounded=2), LESSON.validation, 41)
    assert lost == 1
    assert error == pytest.approx(0.5)
    assert judged(Off(0.5, bounded=0), LESSON.validation, 41) == (3, float("inf"))


@pytest.mark.parametrize(
    ("value", "gone"), [(3.0, False), (9.0, False), (12.0, True), (np.nan, True), (-np.inf, True)]
)
def test_simulation_diverges_beyond_ten_times_the_true_outputs(value: float, gone: bool) -> None:
    truth = np.array([[-1.0], [1.0], [0.0]])
    assert diverged(np.array([[0.0], [value]]), truth) is gone
