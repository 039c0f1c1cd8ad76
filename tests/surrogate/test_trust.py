"""What a bound knows of the error at each sample, compared with plain loops."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from slide_fmu.core.block_means import N_BLOCKS, block_lengths, block_means
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import logarithms
from slide_fmu.surrogate.error_bound import (
    MOST_EXPONENT,
    local_scales,
)
from tests.bounded import bounded_surrogate
from tests.fmu.samples import random_surrogate
from tests.surrogate.plain_trust import SEEING, SHAPE, plain_mean, plain_trust, record


@pytest.mark.parametrize("sees_estimates", [False, True])
@pytest.mark.parametrize("blocks", [(1, 1), (1, 4), (3, 7)])
def test_trust_is_that_of_plain_loops(blocks: tuple[int, int], sees_estimates: bool) -> None:
    shape = SEEING if sees_estimates else SHAPE
    surrogate = bounded_surrogate(shape, blocks)
    inputs = record(surrogate)
    found, expected = surrogate.trust(inputs).local, plain_trust(surrogate, inputs)
    np.testing.assert_allclose(found.scales, expected.scales, rtol=2e-4)
    np.testing.assert_allclose(found.disagreement, expected.disagreement, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(found.novelty, expected.novelty, rtol=1e-4)
    assert found.novelty.min() < found.novelty.max()


def test_head_gets_no_logarithm_below_the_quietest() -> None:
    surrogate = bounded_surrogate(SHAPE)
    bound, inputs = surrogate.bound, record(surrogate)
    assert bound is not None
    scaled = surrogate.input_scaling.apply(inputs)[None]
    predicted = surrogate.output_scaling.apply(surrogate.predict_newest(inputs))[None]
    (statistics,) = bound.statistics(scaled, predicted)[0]
    signed = statistics.shape[1] - bound.n_logarithms
    assert 0 < (statistics[:, signed:] < bound.quietest).mean() < 1
    limited = statistics.copy()
    for row in limited:
        for i, least in enumerate(bound.quietest):
            row[signed + i] = max(row[signed + i], least)
    exponents = bound.head.evaluate(limited[:, None])
    expected = local_scales(exponents.astype(float))
    np.testing.assert_allclose(surrogate.trust(inputs).local.scales, expected, rtol=1e-6)


def test_memory_is_that_of_the_means_or_of_a_longer_estimator() -> None:
    bound = bounded_surrogate(SEEING, (2, 5)).bound
    assert bound is not None
    assert bound.estimator is not None
    own = 2 * bound.companion.n_samples + (N_BLOCKS + 1) * 5
    assert bound.memory_length == max(own, bound.estimator.memory_length)
    alone = replace(bound, blocks=(2, 50))
    assert alone.memory_length == 2 * bound.companion.n_samples + (N_BLOCKS + 1) * 50
    assert alone.memory_length > bound.estimator.memory_length
    shortest = replace(bound, blocks=(1, 1))
    object.__setattr__(shortest, "estimator", _Longer(1000))
    assert shortest.memory_length == 1000


@dataclass(frozen=True)
class _Longer:
    """It stands for an estimator with a longer memory than the means have."""

    memory_length: int


def test_what_is_not_finite_is_as_bad_as_can_be() -> None:
    surrogate = bounded_surrogate(SHAPE)
    bound = surrogate.bound
    assert bound is not None
    scaled = np.full((5, 2), 1e30)
    (trust,) = bound.along(scaled[None], np.full((1, 5, 2), np.inf))
    assert np.all(trust.novelty == 1e9)
    assert np.all(bound.bounds(trust, 0.95) >= bound.shares * 2.0**MOST_EXPONENT)


def test_logarithms_are_about_those_to_base_two() -> None:
    values = np.geomspace(1e-29, 1e30, 4001)
    deviation = logarithms(values) - np.log2(values)
    assert -0.0862 < deviation.min() <= deviation.max() < 1e-5
    assert logarithms(np.zeros(1)) == logarithms(np.full(1, 1e-31))


def test_means_are_those_of_whole_blocks_and_the_begun_one() -> None:
    values = np.arange(40.0)[None, :, None]
    found = block_means(values, 3)[0, :, 0]
    assert [found[k] for k in (0, 1, 39)] == [
        pytest.approx(plain_mean(values[0, :, 0].tolist(), k, 3)) for k in (0, 1, 39)
    ]
    assert found[0] == 0
    assert block_lengths(0.03) == (1, 5)
    assert block_lengths(10.0) == (1, 1)


def test_states_of_the_ping_pong_are_those_behind_its_values() -> None:
    network = random_surrogate(SHAPE).network
    assert isinstance(network, StateSpace)
    scaled = np.random.default_rng(1).uniform(-1, 1, (3, 50, 2))
    values, states = network.ping_pong_states(network.features.along(scaled))
    assert np.array_equal(values, network.stream(scaled))
    assert states.shape == (3, 50, len(network.cell.a))
    handed_over = 9 * np.arange(1, 5)  # then the younger state's weight is 1, and it is the older
    younger = network.evaluate(np.stack([scaled[0, k - 8 : k + 1] for k in handed_over]))
    np.testing.assert_allclose(values[0, handed_over], younger, atol=0.2)
