"""The loss of an error bound's head, and the doubt about held inputs between samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from slide_fmu.bounds.error_bound import (
    DOUBT_MARGIN,
    MOST_DOUBT,
    _objective,
    doubt_of,
    scaling_of_statistics,
)
from slide_fmu.bounds.judge import span_factors
from slide_fmu.fmu.export import read_fmu
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.samples import CellShape, Shape, random_surrogate

FMUS = Path(__file__).parents[2] / "fmus"


def test_factor_of_an_estimate_does_not_depend_on_trajectories_without_an_error() -> None:
    rng = np.random.default_rng(0)
    scales = np.exp(rng.normal(0, 1, (200, 1, 1))) * np.ones((1, 60, 1))
    errors = 0.5 * scales * np.exp(rng.normal(0, 0.1, (200, 1, 1)))
    (factor,) = span_factors(errors, scales, 3)
    assert factor == pytest.approx(0.5, rel=0.05)
    errors[:20] = 0.0
    (other,) = span_factors(errors, scales, 3)
    assert other == pytest.approx(factor, rel=0.05)


def test_loss_is_least_at_the_quantile_however_large_errors_are() -> None:
    rng = np.random.default_rng(3)
    objective = _objective(torch.zeros(1))
    exponents = torch.linspace(-12, 12, 4801)
    for size in (0.01, 1.0, 30.0):
        errors = size * np.exp(rng.normal(0, 1, 4001))
        targets = torch.as_tensor(errors, dtype=torch.float32)[:, None]
        losses = [float(objective.loss(one.expand(len(errors), 1), targets)) for one in exponents]
        best = 2.0 ** float(exponents[int(np.argmin(losses))])
        assert best == pytest.approx(np.quantile(errors, 0.95), rel=0.02)


@pytest.mark.parametrize("usual", [0.0, -3.0])
def test_loss_of_expected_errors_is_least_at_their_root_mean_square(usual: float) -> None:
    rng = np.random.default_rng(3)
    objective = _objective(torch.full((1,), usual))
    exponents = torch.linspace(-12, 12, 1201)
    for size in (0.01, 1.0, 30.0):
        relative = size * rng.normal(0, 1, 4001)
        targets = torch.as_tensor(np.abs(relative), dtype=torch.float32)[:, None]
        scale = torch.zeros(1)
        losses = [
            float(objective.loss(torch.stack([scale, one[None]], dim=1).expand(4001, 2), targets))
            for one in exponents
        ]
        best = 2.0 ** float(exponents[int(np.argmin(losses))] - usual)
        assert best == pytest.approx(np.sqrt(np.mean(relative**2)), rel=0.02)


def test_rare_huge_errors_do_not_decide_what_is_expected() -> None:
    """One of a thousand samples that is a million times as large counts by its logarithm."""
    targets = torch.ones(1000, 1)
    targets[0] = 1e6
    exponent = torch.zeros(1000, 2, requires_grad=True)
    _objective(torch.zeros(1)).loss(exponent, targets).backward()
    assert exponent.grad is not None
    slopes = exponent.grad[:, 1].abs()
    assert float(slopes[0]) > 100 * float(slopes[1:].max())
    assert float(slopes[0]) < 1000.0 * 0.1 / 1000  # the plain likelihood: 1e12 * 0.1 / 1000


def test_large_errors_do_not_decide_alone() -> None:
    """Where errors are a thousand times as large, a step of the exponent is worth as much.

    Where they are a thousandth of the usual one, it is worth little.
    """
    objective = _objective(torch.zeros(1))

    def slope(size: float) -> float:
        exponent = torch.tensor([[np.log2(size)]], dtype=torch.float32, requires_grad=True)
        objective.loss(exponent, torch.tensor([[1.5 * size]])).backward()
        assert exponent.grad is not None
        return abs(float(exponent.grad))

    assert slope(1000.0) == pytest.approx(slope(2.0), rel=0.03)
    assert slope(0.1) > 0.5 * slope(1.0)
    assert slope(0.001) < 0.03 * slope(1.0)


def test_statistics_that_are_roundings_are_not_scaled_up() -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(size=100)
    columns = [rng.normal(3, 2, 100), 1e-13 * noise, 1 + 1e-8 * noise, 100 + 0.01 * noise]
    statistics = np.stack(columns, axis=1)
    scaling = scaling_of_statistics(statistics)
    assert scaling.scale == pytest.approx([columns[0].std(), 1.0, 1.0, columns[3].std()])


def network_of(name: str) -> StateSpace:
    network = read_fmu(FMUS / name / f"{name}.fmu")[0].network
    assert isinstance(network, StateSpace)
    return network


@pytest.mark.parametrize(("name", "step"), [("linear", 1 / 64), ("linear_10ms", 0.01)])
def test_doubt_of_one_oscillation_follows_from_how_far_it_turns_in_a_sample(
    name: str, step: float
) -> None:
    """m = 1 kg, d = 8 N s/m, k = 1600 N/m: each difference of it has a factor of z - 1."""
    pole = np.exp(complex(-4.0, np.sqrt(1600.0 - 16.0)) * step)
    ratio = abs(pole - 1)
    assert doubt_of(network_of(name)) == pytest.approx(
        DOUBT_MARGIN * ratio / (1 - ratio), rel=0.15
    )


def test_released_bounds_have_the_doubt_of_their_companions() -> None:
    for name, most in (("duffing", True), ("duffing_10ms", False)):
        bound = read_fmu(FMUS / name / f"{name}.fmu")[0].bound
        assert bound is not None
        assert bound.doubt == pytest.approx(doubt_of(bound.companion), rel=0.01)
        assert (bound.doubt == MOST_DOUBT) == most


def test_doubt_has_a_most_and_is_zero_without_a_response() -> None:
    shape = Shape(n_inputs=2, n_outputs=2, cell=CellShape())
    network = random_surrogate(shape).network
    assert isinstance(network, StateSpace)
    assert 0 < doubt_of(network) <= MOST_DOUBT
    arrays = {name: np.zeros_like(part) for name, part in network.cell.arrays().items()}
    silent = StateSpace(
        network.cell.with_arrays(arrays),
        network.n_samples,
        network.n_out,
        network.features,
        network.roles,
        network.turned,
    )
    assert doubt_of(silent) == 0
