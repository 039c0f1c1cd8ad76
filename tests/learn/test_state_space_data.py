"""What state-space fits see: differences, both signs, motions beyond the range."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from cells import numpy_network, random_theta
from springs import (
    CUBIC,
    FORGOTTEN,
    NONLINEAR,
    QUICK,
    SMALL,
    Pair,
    answers,
    fit,
    problem_of,
    relative_error,
    spring,
)

from slide_fmu.learn.cell import CellShape, simulate
from slide_fmu.learn.levenberg_marquardt import Iterate
from slide_fmu.learn.segments import with_differences
from slide_fmu.learn.state_space import FEWEST, _stride, feature_scale, freeze, prepare
from slide_fmu.learn.tournament import Entrant
from slide_fmu.learning_recipe import LeastSquaresRecipe, StateSpaceRecipe

ROUNDING = 1e-5
"""Float32 sums of some ten terms of order 1, in a cell that contracts."""
BEYOND = 2.0
"""Amplitude beyond the range: deflections reach 1.8, in the range 1.0."""


def second_difference(seed: int) -> Pair:
    """y[k+1] = 0.5 y[k] + u[k] - 2 u[k-1] + u[k-2]."""
    inputs, outputs = spring(seed, 4, 160)
    held = torch.cat([inputs[:, :1], inputs[:, :1], inputs], 1)
    second = held[:, 2:] - 2 * held[:, 1:-1] + held[:, :-2]
    outputs = torch.zeros_like(outputs)
    for k in range(160):
        outputs[:, k + 1] = 0.5 * outputs[:, k] + second[:, k]
    return inputs, outputs


def test_differences_show_what_one_state_cannot(tmp_path: Path) -> None:
    records = {"training": second_difference(1), "validation": second_difference(2)}
    errors = []
    for differences in (0, 2):
        problem = problem_of(tmp_path / str(differences), eigenvalues=None, **records)
        network = {"order": 1, "hidden": 0, "differences": differences}
        found = fit(problem, network).network
        assert (found.differences, found.cell.b.shape) == (differences, (1, 1 + differences))
        errors.append(relative_error(found, second_difference(3)))
    assert errors[1] < FORGOTTEN < 0.05 < errors[0]


@pytest.mark.parametrize("differences", [0, 1, 2])
@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize("units", ["tanh", "cubic"])
def test_frozen_network_is_the_fitted_cell(
    tmp_path: Path, differences: int, bias: bool, units: str
) -> None:
    """Two inputs; features with the scales of the training data, along whole records."""
    inputs = torch.cat([spring(1, 6, 60)[0], 0.3 * spring(2, 6, 60)[0]], 2)
    problem = problem_of(tmp_path, training=(inputs, spring(1, 6, 60)[1]))
    table = StateSpaceRecipe(order=3, hidden=5, differences=differences, bias=bias, units=units)
    problem = replace(problem, validation=problem.training)
    data = prepare(problem, table, LeastSquaresRecipe(**QUICK))
    shape = CellShape(3, 2 * (1 + differences), 5, 1, units, bias)
    theta = random_theta(shape)
    theta = 0.5 * theta if units == "cubic" else theta  # differences are larger than the inputs
    network = freeze(Entrant(shape, Iterate(theta, theta, 0.0)), problem, data.feature_scale)
    expected, _ = simulate(shape, theta, data.features.transpose(0, 1))
    found, _ = network.run(network.features(inputs.numpy()))
    assert np.max(np.abs(found - expected.numpy().swapaxes(0, 1))) < ROUNDING
    plain = numpy_network(shape, theta).cell
    assert all(np.array_equal(getattr(network.cell, k), getattr(plain, k)) for k in "abewcd")
    assert np.array_equal(network.cell.d0, plain.d0)
    spreads = data.features.std((0, 1))
    assert spreads[2:].tolist() == pytest.approx([1.0] * (2 * differences), rel=1e-6)
    assert data.feature_scale[:2].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_differences_are_formed_before_the_precision_is_lost(
    tmp_path: Path, precision: str
) -> None:
    """Slow inputs far from zero: in single precision their differences would be steps."""
    slow = torch.cumsum(spring(1, 6, 160)[0], 1) * 1e-6 + 0.9
    problem = problem_of(tmp_path, training=(slow, spring(1, 6, 160)[1]))
    table = StateSpaceRecipe(differences=2)
    found, exact = (
        prepare(problem, table, LeastSquaresRecipe(**QUICK, precision=kind))
        for kind in (precision, "float64")
    )
    dtype = getattr(torch, precision)
    assert torch.equal(found.features, exact.features.to(dtype))
    for part in ("whole", "part", "validation"):
        segments, expected = getattr(found, part), getattr(exact, part)
        assert torch.equal(segments.features, expected.features.to(dtype))
        assert torch.equal(segments.targets, expected.targets.to(dtype))
    assert torch.equal(found.feature_scale, exact.feature_scale)


@pytest.mark.parametrize("differences", [1, 2])
@pytest.mark.parametrize(("still", "rounding"), [(0, 0.0), (1, 0.0), (1, 1e-12)])
def test_differences_of_an_input_that_never_changes_are_refused(
    tmp_path: Path, differences: int, still: int, rounding: float
) -> None:
    """Another value in every trajectory, or constant up to rounding."""
    inputs = torch.cat([spring(seed, 6, 160)[0] for seed in (1, 2)], 2)
    held = 0.1 * torch.arange(6, dtype=torch.float64)[:, None]
    inputs[:, :, still] = held + rounding * inputs[:, :, still]
    problem = problem_of(tmp_path, training=(inputs, spring(1, 6, 160)[1]))
    network = {"order": 2, "hidden": 0}
    message = (
        rf"^network\.differences = {differences}, but input {still} never changes within a "
        r"trajectory; .* set network\.differences = 0, or check data\.excitation$"
    )
    with pytest.raises(ValueError, match=message):
        fit(problem, {**network, "differences": differences})
    prepare(problem, StateSpaceRecipe(**network), LeastSquaresRecipe(**QUICK))


def test_features_are_divided_by_the_spread_of_the_differences() -> None:
    """However small an input is beside the others."""
    inputs = torch.cat([spring(1, 6, 160)[0], 1e-10 * spring(2, 6, 160)[0]], 2)
    features = with_differences(inputs, 2)
    scale = feature_scale(features, 2)
    assert scale[:2].tolist() == [1.0, 1.0]
    spread = features.flatten(0, 1).std(0)[2:]
    assert scale[2:].tolist() == pytest.approx(spread.tolist(), rel=1e-6)
    assert torch.equal(scale, scale.float().double())  # as the network keeps it


@pytest.mark.parametrize("part", [1, 2, 3, 5, 7])
@pytest.mark.parametrize("pieces", [1, 2, 3, 4, 5, 6, 12, 30])
@pytest.mark.parametrize("trajectories", [1, 4, 16, 100])
def test_starts_see_all_pieces_of_trajectories(part: int, pieces: int, trajectories: int) -> None:
    count = pieces * trajectories
    stride = _stride(part, pieces, count)
    assert math.gcd(stride, pieces) == 1
    chosen = range(0, count, stride)
    if len(chosen) >= pieces:  # one after the other, of trajectories all over the data
        assert {number % pieces for number in chosen} == set(range(pieces))
    if math.gcd(part, pieces) == 1 and count >= FEWEST * part:
        assert stride == part


@pytest.mark.parametrize(
    ("part", "pieces", "count"),
    [
        (1, 4, 20), (5, 3, 8), (5, 1, 9), (2, 3, 18), (5, 7, 28),
        (5, 2, 16), (5, 30, 30), (2, 2, 16),
    ],
)  # fmt: skip
def test_starts_have_some_segments_at_least(part: int, pieces: int, count: int) -> None:
    assert len(range(0, count, _stride(part, pieces, count))) >= FEWEST


def test_starts_have_early_and_late_segments(tmp_path: Path) -> None:
    """Four segments of each trajectory, and every second of them would be the same two."""
    data = prepare(problem_of(tmp_path), StateSpaceRecipe(), LeastSquaresRecipe(**QUICK))
    assert (data.whole.count, QUICK["part"], data.part.count) == (24, 2, 8)
    expected = data.whole.every(3)
    assert torch.equal(data.part.features, expected.features)


@pytest.mark.parametrize("units", ["tanh", "cubic"])
def test_without_bias_the_network_is_odd(tmp_path: Path, units: str) -> None:
    network = {"order": 2, "hidden": 4, "bias": False, "units": units}
    found = fit(problem_of(tmp_path), network)
    assert found.error < SMALL
    inputs = spring(5, 2, 100)[0].numpy()
    assert np.array_equal(found.network.stream(-inputs), -found.network.stream(inputs))


def test_flipped_signs_are_added(tmp_path: Path) -> None:
    table = StateSpaceRecipe(differences=1)
    plain, flipped = (
        prepare(problem_of(tmp_path), table, LeastSquaresRecipe(**QUICK, flip_signs=flip))
        for flip in (False, True)
    )
    count = plain.whole.count
    assert flipped.whole.count == 2 * count
    for part in ("features", "targets"):
        there, both = getattr(plain.whole, part), getattr(flipped.whole, part)
        assert torch.equal(both[:, :count], there)
        assert torch.equal(both[:, count:], -there)
    assert torch.equal(flipped.validation.targets, plain.validation.targets)


def one_sided(seed: int) -> Pair:
    """The spring under inputs that only push."""
    inputs = spring(seed, 6, 200)[0].abs()
    return inputs, answers(inputs, CUBIC)


def test_flipped_signs_teach_what_was_never_seen(tmp_path: Path) -> None:
    """Trained on pushes, validated on pulls."""
    inputs, outputs = one_sided(2)
    records = {"training": one_sided(1), "validation": (-inputs, -outputs)}
    errors = [
        fit(problem_of(tmp_path / str(flip), **records), NONLINEAR, flip_signs=flip).error
        for flip in (False, True)
    ]
    assert errors[1] < SMALL
    assert errors[0] > 5 * errors[1]


@pytest.mark.parametrize("differences", [0, 1])
@pytest.mark.parametrize("flip_signs", [False, True])
def test_trajectories_beyond_the_range_are_added_with_their_weight(
    tmp_path: Path, differences: int, flip_signs: bool
) -> None:
    """They are scaled as the others, flipped as the others, and choose nothing."""
    table = StateSpaceRecipe(differences=differences)
    training = LeastSquaresRecipe(**QUICK, flip_signs=flip_signs, beyond_weight=0.25)
    inputs, outputs = spring(4, 3, 160, CUBIC, BEYOND)
    plain, both = (
        prepare(problem_of(tmp_path, beyond=beyond), table, training)
        for beyond in (None, (inputs, outputs))
    )
    assert torch.equal(both.feature_scale, plain.feature_scale)
    assert torch.equal(both.features, plain.features)
    for part in ("features", "targets"):
        assert torch.equal(getattr(both.validation, part), getattr(plain.validation, part))
    signs = 1 + flip_signs
    count, more = (
        plain.whole.count // signs,
        both.whole.count // signs - plain.whole.count // signs,
    )
    assert more == count // 2  # three trajectories beside six
    expected = ([1.0] * count + [0.25] * more) * signs
    assert both.whole.weights.tolist() == expected
    assert torch.equal(both.whole.targets[:, :count], plain.whole.targets[:, :count])
    beyond = both.whole.chosen(torch.arange(count, count + more))
    pieces = more // 3
    scaled = with_differences(inputs, differences) / both.feature_scale
    assert torch.equal(
        beyond.features[:, ::pieces].transpose(0, 1), scaled[:, : len(beyond.features)]
    )
    assert set(both.part.weights.tolist()) == {1.0, 0.25}


def test_motions_beyond_the_range_are_learnt_with_a_low_weight(tmp_path: Path) -> None:
    """They cost next to nothing in the range."""
    inside, outside = spring(3, 2, 400, CUBIC), spring(5, 2, 400, CUBIC, BEYOND)
    without = fit(problem_of(tmp_path / "without"), NONLINEAR).network
    seen = spring(4, 6, 160, CUBIC, BEYOND)
    network = fit(problem_of(tmp_path / "with", beyond=seen), NONLINEAR).network
    assert relative_error(without, outside) > 10 * SMALL
    assert relative_error(network, outside) < 0.3 * relative_error(without, outside)
    assert relative_error(network, inside) < SMALL


def test_weight_of_next_to_nothing_changes_next_to_nothing(tmp_path: Path) -> None:
    outside = spring(5, 2, 400, CUBIC, BEYOND)
    errors = []
    for weight in (1e-6, 1.0):
        beyond = spring(4, 6, 160, CUBIC, BEYOND)
        problem = problem_of(tmp_path / str(weight), beyond=beyond)
        found = fit(problem, NONLINEAR, beyond_weight=weight).network
        errors.append(relative_error(found, outside))
    assert errors[1] < SMALL * 5 < 10 * SMALL < errors[0]
