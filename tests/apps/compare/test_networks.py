"""FIR, linear state space, GRU and feed-forward network as baselines."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.apps.compare.baselines.base import Budget, NetworkBaseline
from slide_fmu.apps.compare.baselines.gradient import (
    AdamTraining,
    Gru,
    fit_gru,
    fit_paper_network,
    schedule,
)
from slide_fmu.apps.compare.baselines.impulse_response import fit_fir
from slide_fmu.apps.compare.baselines.linear import fit_linear_state_space
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.network.feed_forward.network import FeedForward
from tests.apps.compare.lessons import WINDOW, cubic, error, lesson, linear, record, silent
from tests.refusals import refused


def test_fir_has_the_impulse_response_of_a_linear_system() -> None:
    learnt = fit_fir(lesson(linear), Budget(60), silent)
    assert learnt.structure == "41 taps"  # all that the window lets an output depend on
    (inputs,), (outputs,) = record(linear, 1, 5)
    assert error(learnt.baseline.simulate(inputs, outputs[:0]), outputs[1:]) < 1e-2
    assert isinstance(learnt.baseline, NetworkBaseline)
    network = learnt.baseline.network
    assert isinstance(network, FeedForward)
    responses = network.layers[0].weights[0, ::-1] / network.features.scaling.scale
    np.testing.assert_allclose(responses[:3], [0.1, 0.2, 0.23], atol=1e-3)
    assert learnt.baseline.parameters == 42


@pytest.mark.extended
def test_linear_state_space_needs_two_states_for_an_oscillation() -> None:
    learnt = fit_linear_state_space(lesson(linear), Budget(60), silent)
    (inputs,), (outputs,) = record(linear, 1, 5)
    assert error(learnt.baseline.simulate(inputs, outputs[:0]), outputs[1:]) < 1e-2
    one = fit_linear_state_space(lesson(linear), Budget(1e-3), silent)
    assert (one.structure, one.cut) == ("order 1", True)


@pytest.mark.extended
def test_gru_step_by_step_gives_what_it_gives_at_once() -> None:
    learnt = fit_gru(lesson(cubic), Budget(3), silent)
    (inputs,), (outputs,) = record(cubic, 1, 5)
    assert isinstance(learnt.baseline, Gru)
    values = learnt.baseline.simulate(inputs, outputs[:0])
    np.testing.assert_allclose(learnt.baseline.step_along(inputs, outputs[:0]), values, atol=1e-5)
    assert error(values, outputs[1:]) < 0.9  # some seconds teach a part of the motion
    assert learnt.cut


class Counted:
    """A budget that counts questions in place of time, so that trainings can be repeated."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self._asked = seconds, 0

    @property
    def spent(self) -> float:
        """One second for each question."""
        self._asked += 1
        return float(self._asked)


@pytest.mark.parametrize("fit", [fit_gru, fit_paper_network])
def test_seed_decides_what_a_network_begins_with(fit: Any) -> None:
    (inputs,), _ = record(cubic, 1, 5)
    first, again, other = (
        fit(dataclasses.replace(lesson(cubic), seed=seed), Counted(20), silent).baseline.simulate(
            inputs, np.zeros((0, 1))
        )
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.allclose(first, other)


@pytest.mark.extended
def test_paper_network_has_two_layers_of_100_units() -> None:
    learnt = fit_paper_network(lesson(cubic), Budget(1), silent)
    n_in, n_out = WINDOW.n_in, WINDOW.n_out
    weights = (n_in + 1) * 100 + 101 * 100 + 101 * n_out
    assert learnt.baseline.parameters == weights
    assert learnt.cut


def quadratic(error: Any = None) -> AdamTraining:
    """The training of one weight towards 3."""
    module = torch.nn.Linear(1, 1, bias=False)

    def loss() -> torch.Tensor:
        return (module.weight - 3.0).square().sum()

    return AdamTraining(module, loss, error or (lambda: float(loss().detach()) ** 0.5), 0.3)


def test_training_ends_with_its_budget() -> None:
    training, budget = quadratic(), Budget(0.3)
    course = training.run(budget, silent)
    assert 0.27 < budget.spent < 0.4
    assert course.cut
    assert course.error_half_way is not None
    assert course.error <= course.error_half_way
    assert course.error == pytest.approx(training.error(), abs=1e-6)


def test_training_without_a_finite_error_is_refused() -> None:
    with refused(TrainingError, "no validation error is finite"):
        quadratic(lambda: float("nan")).run(Budget(0.05), silent)


def test_rate_rises_and_falls_to_nothing() -> None:
    rates = [schedule(part) for part in (0.0, 0.05, 0.5, 1.0)]
    assert rates[0] < 0.2
    assert rates[1] == pytest.approx(1.0)
    assert 0.4 < rates[2] < 0.6
    assert rates[3] == pytest.approx(0.0)
