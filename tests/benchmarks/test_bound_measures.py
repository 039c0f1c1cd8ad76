"""Measures of bounds that studies use, against brute force and numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.bound_measures import (
    DomainFigures,
    Harm,
    domain_figures,
    harm_of,
    output_bound,
    pinball_loss,
)
from tests.validation.handmade import trust_outputs

LEVELS = np.linspace(0.01, 8, 4000)
"""Constants that brute force tries."""


def plain_ranks(values: np.ndarray) -> np.ndarray:
    """Mean ranks, those of equal values shared, counted one by one."""
    less = (values[None] < values[:, None]).sum(axis=1)
    same = (values[None] == values[:, None]).sum(axis=1)
    return np.asarray(less + 0.5 * (same + 1))


def errors_of(seed: int, count: int = 400) -> np.ndarray:
    return np.random.default_rng(seed).lognormal(0, 0.7, count)


def test_pinball_loss_of_constants_is_least_at_the_quantile() -> None:
    errors = errors_of(4, 2000)
    losses = [pinball_loss(errors, np.full(len(errors), level)) for level in LEVELS]
    best = LEVELS[int(np.argmin(losses))]
    assert best == pytest.approx(np.quantile(errors, 0.95), rel=0.02)


def test_pinball_loss_costs_what_is_not_covered_19_times_as_much() -> None:
    bound = np.array([2.0])
    assert pinball_loss(np.array([3.0]), bound) == pytest.approx(0.95)
    assert pinball_loss(np.array([1.0]), bound) == pytest.approx(0.05)


def test_bound_figures_are_those_of_all_samples_and_the_worst_trajectories() -> None:
    """The second of two trajectories has one error of four above its bound."""
    errors = [np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0, 8.0])]
    bounds = [np.array([2.0, 3.0, 4.0, 4.0]), np.array([2.0, 3.0, 4.0, 5.0])]
    found = output_bound("y", errors, bounds)
    both, limits = np.concatenate(errors), np.concatenate(bounds)
    constant = np.quantile(both, 0.95)
    assert found.coverage == 7 / 8  # an error as large as its bound is covered
    assert found.coverage_of_worst_trajectories == 3 / 4
    assert found.width == pytest.approx(27 / 8 / constant)
    spared = 0.05 * 6 / 8 + 0.95 * 3 / 8  # six are 1 below their bound, one meets it
    assert pinball_loss(both, limits) == pytest.approx(spared)
    of_constant = pinball_loss(both, np.full(8, constant))
    assert found.skill == pytest.approx(1 - spared / of_constant)
    ranks = np.corrcoef(plain_ranks(both), plain_ranks(limits))[0, 1]
    assert found.rank_correlation == pytest.approx(ranks)


def test_bound_that_is_the_best_constant_has_width_one_and_no_skill() -> None:
    errors = errors_of(6)
    found = output_bound("y", [errors], [np.full(len(errors), np.quantile(errors, 0.95))])
    assert found.width == pytest.approx(1)
    assert found.skill == pytest.approx(0)
    assert found.rank_correlation is None


def test_bound_that_is_the_error_itself_has_all_skill() -> None:
    errors = errors_of(7)
    found = output_bound("y", [errors], [errors])
    assert (found.coverage, found.skill) == (1, 1)
    assert found.rank_correlation == pytest.approx(1)


def test_bound_figures_of_errors_of_zero_have_neither_width_nor_skill() -> None:
    found = output_bound("y", [np.zeros(4)], [np.array([1.0, 2.0, 3.0, 4.0])])
    assert (found.width, found.skill) == (None, None)
    assert found.coverage == 1


def test_trajectory_counts_as_flagged_above_a_twentieth_of_its_samples() -> None:
    length = 40
    seldom = trust_outputs([[1.0]] * length, [2.0] * 2 + [0.5] * 38)  # a twentieth: not more
    often = trust_outputs([[1.0]] * length, [2.0] * 3 + [0.5] * 37)
    found = domain_figures([seldom, often])
    assert found == DomainFigures(flagged=5 / 80, trajectories_flagged=1 / 2, untrusted=5 / 80)


def test_harm_is_counted_sample_by_sample_whatever_the_output() -> None:
    """Three times the usual errors of 1 and 2 is still harmless: 3 and 6."""
    errors = [np.array([[3.0, 6.0], [3.1, 0.0], [0.0, 6.1]]), np.array([[9.0, 0.0], [1.0, 1.0]])]
    says = [
        trust_outputs([[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]], [2.0, 2.0, 0.5]),
        trust_outputs([[9.0, 9.0], [9.0, 9.0]], [0.5, 0.5]),  # a harmful error that is covered
    ]
    found = harm_of(errors, says, np.array([1.0, 2.0]))
    assert found == Harm(
        harmful=3 / 5, harmful_flagged=1 / 3, harmless_flagged=1 / 2, harmful_unnoticed=1 / 5
    )


def test_harm_without_harmful_errors_has_no_share_of_them() -> None:
    found = harm_of([np.ones((2, 1))], [trust_outputs([[2.0]] * 2, [0.5, 0.5])], np.array([1.0]))
    assert found.harmful == found.harmful_unnoticed == found.harmless_flagged == 0
    assert found.harmful_flagged is None


def test_harm_of_one_output_is_noticed_whatever_another_one_does() -> None:
    """The first output errs much, below its bound; the second one a little, above its own."""
    errors = [np.array([[9.0, 0.5]])]
    found = harm_of(errors, [trust_outputs([[10.0, 0.1]], [0.5])], np.array([1.0, 1.0]))
    assert (found.harmful, found.harmful_unnoticed) == (1.0, 0.0)
