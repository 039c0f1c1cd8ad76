"""FIR, linear state space, GRU and feed-forward network as baselines."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.apps.compare.baselines.base import Budget, Frozen
from slide_fmu.apps.compare.baselines.gradient import (
    MOST_STEPS,
    VALIDATIONS,
    Gru,
    _affordable,
    fit_gru,
    fit_paper_network,
)
from slide_fmu.apps.compare.baselines.impulse_response import fit_fir
from slide_fmu.apps.compare.baselines.linear import fit_linear_state_space
from slide_fmu.network.feed_forward.network import FeedForward
from tests.apps.compare.lessons import WINDOW, cubic, error, lesson, linear, record, silent


def test_fir_has_the_impulse_response_of_a_linear_system() -> None:
    learnt = fit_fir(lesson(linear), Budget(60), silent)
    assert learnt.structure == "41 taps"  # all that the window lets an output depend on
    (inputs,), (outputs,) = record(linear, 1, 5)
    assert error(learnt.baseline.simulate(inputs, outputs[:0]), outputs[1:]) < 1e-2
    assert isinstance(learnt.baseline, Frozen)
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


@pytest.mark.parametrize("fit", [fit_gru, fit_paper_network])
def test_seed_decides_what_a_network_begins_with(
    fit: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    from slide_fmu.apps.compare.baselines import gradient

    monkeypatch.setattr(gradient, "_affordable", lambda *_: (3, 1))  # as on any machine
    assert callable(fit)
    (inputs,), _ = record(cubic, 1, 5)
    first, again, other = (
        fit(dataclasses.replace(lesson(cubic), seed=seed), Budget(60), silent).baseline.simulate(
            inputs, np.zeros((0, 1))
        )
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.allclose(first, other)


def test_paper_network_has_two_layers_of_100_units() -> None:
    learnt = fit_paper_network(lesson(cubic), Budget(1), silent)
    n_in, n_out = WINDOW.n_in, WINDOW.n_out
    weights = (n_in + 1) * 100 + 101 * 100 + 101 * n_out
    assert learnt.baseline.parameters == weights
    assert learnt.cut


def test_steps_and_validations_fit_into_what_is_left() -> None:
    steps, validations = _affordable(100.0, step=0.01, validation=1.0)
    assert (steps, validations) == (8000, VALIDATIONS)
    steps, validations = _affordable(10.0, step=0.01, validation=1.0)
    assert (steps, validations) == (800, 2)
    assert _affordable(1e6, step=0.01, validation=1.0) == (MOST_STEPS, VALIDATIONS)
    assert _affordable(-1.0, step=0.01, validation=1.0) == (1, 1)
