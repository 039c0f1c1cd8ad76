"""What state-space fits see: differences, both signs, motions beyond the range."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.stats import qmc

from slide_fmu.fitting.state_space import fit_data as module
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.cubes import with_room
from slide_fmu.fitting.state_space.fit import freeze
from slide_fmu.fitting.state_space.fit_data import FEWEST, _stride, fit_data
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.network.state_space.cell import Roles
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.cells import numpy_network, random_theta
from tests.fitting.state_space.springs import (
    CUBIC,
    FORGOTTEN,
    NONLINEAR,
    QUICK,
    SMALL,
    Pair,
    answers,
    fit,
    map_of,
    problem_of,
    quick,
    relative_error,
    spring,
)
from tests.marks import essential

ROUNDING = 1e-5
"""Float32 sums of some ten terms of order 1, in a cell that contracts."""
SINGLE = 1e-7
"""Half a unit in the last place of float32, and a little more."""
DIFFERENCES = ("inputs", "changes", "second_changes")
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
    for order in (0, 2):
        names = DIFFERENCES[: order + 1]
        problem = problem_of(tmp_path / str(order), names=names, eigenvalues=None, **records)
        found = fit(problem, {"order": 1, "hidden": 0, "drive": names}).network
        assert (found.roles.drive, found.cell.b.shape) == (tuple(range(order + 1)), (1, order + 1))
        errors.append(relative_error(found, second_difference(3)))
    assert errors[1] < FORGOTTEN < 0.05 < errors[0]


def two_inputs(seed: int = 1) -> Pair:
    """The spring with a smaller input beside the one that moves it."""
    inputs, outputs = spring(seed, 6, 60)
    return torch.cat([inputs, 0.3 * spring(seed + 1, 6, 60)[0]], 2), outputs


def check_frozen(folder: Path, table: StateSpaceRecipe, turned: int = 0) -> StateSpace:
    """The frozen network along whole records is the fitted cell; gives the network."""
    records = two_inputs()
    names = table.feature_names()
    problem = problem_of(folder, names=names, training=records, validation=records)
    data = fit_data(problem, table, QUICK)
    roles = data.roles
    if turned:
        roles = replace(roles, turn=roles.schedule[:2])
    shape = CellShape(4, 5, 1, roles, table.units, table.bias, turned)
    theta = random_theta(shape)
    theta = 0.5 * theta if table.units == "cubic" else theta  # features are larger than inputs
    network = freeze(Candidate(shape, Iterate(theta, theta, 0.0)), data)
    assert (network.roles, network.turned, network.features) == (roles, turned, problem.features)
    expected, _ = simulate(shape, theta, data.features.transpose(0, 1))
    found, _ = network.run(network.features.along(records[0].numpy()))
    assert np.max(np.abs(found - expected.numpy().swapaxes(0, 1))) < ROUNDING
    weights = numpy_network(shape, with_room(shape, theta, data.whole)).cell
    for part in fields(weights):
        assert np.array_equal(getattr(network.cell, part.name), getattr(weights, part.name))
    return network


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize("units", ["tanh", "cubic", "mixed"])
def test_frozen_network_is_the_fitted_cell(
    tmp_path: Path, order: int, bias: bool, units: str
) -> None:
    """Two inputs; features with the scales of the training data, along whole records."""
    table = StateSpaceRecipe(drive=DIFFERENCES[: order + 1], bias=bias, units=units)
    network = check_frozen(tmp_path, table)
    features = network.features.along(two_inputs()[0].numpy())
    spreads = features.astype(np.float64).std((0, 1))
    assert spreads[2:].tolist() == pytest.approx([1.0] * (2 * order), rel=1e-6)
    assert network.features.scaling.scale[:2].tolist() == [1.0, 1.0]
    assert not network.features.scaling.offset.any()


@pytest.mark.parametrize("readout", [(), ("inputs",)])
@pytest.mark.parametrize("turned", [0, 1, 2])
def test_frozen_gated_network_is_the_fitted_cell(
    tmp_path: Path, readout: tuple[str, ...], turned: int
) -> None:
    table = StateSpaceRecipe(
        units="gated",
        drive=("changes",),
        static=("second_changes", "changes"),
        gated=("changes", "inputs"),
        schedule=("inputs",),
        readout=readout,
    )
    cell = check_frozen(tmp_path, table, turned).cell
    assert cell.v is not None
    assert (cell.v.shape, cell.w.shape) == ((5, 4 + 4), (5, 2 + 1))
    assert cell.d.shape == (1 + 2 * len(readout), 4)


def test_frozen_plain_network_with_roles_of_its_own_is_the_fitted_cell(tmp_path: Path) -> None:
    table = StateSpaceRecipe(drive=("changes",), static=("inputs",), readout=("inputs",))
    network = check_frozen(tmp_path, table)
    assert network.roles == Roles((0, 1), (2, 3), readout=(2, 3))


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_differences_are_formed_before_the_precision_is_lost(
    tmp_path: Path, precision: str
) -> None:
    """Slow inputs far from zero: in single precision their differences would be steps."""
    slow = torch.cumsum(spring(1, 6, 160)[0], 1) * 1e-6 + 0.9
    records = slow, spring(1, 6, 160)[1]
    problem = problem_of(tmp_path, names=DIFFERENCES, training=records)
    steps = torch.diff(slow, dim=1)
    exact = torch.cat([steps[:, 1:], torch.diff(steps, dim=1)], 2)
    exact = exact / torch.from_numpy(problem.features.scaling.scale[1:])
    formed = problem.training[0][:, 2:, 1:]
    torch.testing.assert_close(formed, exact, rtol=0, atol=SINGLE * float(exact.abs().max()))
    table = StateSpaceRecipe(drive=DIFFERENCES)
    found, expected = (
        fit_data(problem, table, quick(precision=kind)) for kind in (precision, "float64")
    )
    dtype = getattr(torch, precision)
    assert torch.equal(found.features, problem.training[0].to(dtype))
    for part in ("whole", "part", "validation"):
        segments, double = getattr(found, part), getattr(expected, part)
        assert torch.equal(segments.features, double.features.to(dtype))
        assert torch.equal(segments.targets, double.targets.to(dtype))
    assert found.roles == expected.roles


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
    if math.gcd(part, 2 * pieces) == 1 and count >= FEWEST * part:
        assert stride == part


@pytest.mark.parametrize("part", [1, 2, 3, 4, 6, 8])
@pytest.mark.parametrize("pieces", [1, 2, 3, 4])
def test_part_of_the_trajectories_fills_the_ranges_of_parameters(part: int, pieces: int) -> None:
    """Every second point of their Sobol sequence would lie in one half of the second range."""
    shares = qmc.Sobol(3, seed=np.random.default_rng(3)).random(256)
    chosen = range(0, 256 * pieces, _stride(part, pieces, 256 * pieces))
    seen = shares[[number // pieces for number in chosen]]
    assert (seen.min(axis=0) < 0.15).all()
    assert (seen.max(axis=0) > 0.85).all()


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
    given = StateSpaceRecipe(order=2, hidden=8)
    data = fit_data(problem_of(tmp_path), given, QUICK)
    assert (data.whole.count, QUICK.expert.part, data.part.count) == (24, 2, 8)
    expected = data.whole.every(3)
    assert torch.equal(data.part.features, expected.features)


@pytest.mark.parametrize(("enough", "segments"), [(10**6, 24), (8 * 33, 8), (1, 8)])
def test_sizes_are_judged_on_enough_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, enough: int, segments: int
) -> None:
    """Few data are all taken, of many a part: every third of 24 segments of 33 samples."""
    monkeypatch.setattr(module, "ENOUGH", enough)
    data = fit_data(problem_of(tmp_path), StateSpaceRecipe(), QUICK)
    assert (len(data.whole.targets), data.whole.count) == (33, 24)
    assert data.part.count == segments


def test_very_many_data_are_thinned_to_some_segments_of_every_trajectory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = StateSpaceRecipe(order=2, hidden=4)
    data = fit_data(problem_of(tmp_path), given, quick(segment=8, part=1))
    shape = MultiStart(data, lambda *shown: None).shape(2, 4)
    assert data.for_refinement(shape) is data.whole
    trajectories = len(data.features)
    assert data.whole.count == data.pieces * trajectories
    residuals = data.whole.targets.numel() / shape.n_parameters
    monkeypatch.setattr(module, "PER_PARAMETER", int(residuals / 4.5))
    some = data.for_refinement(shape)
    assert trajectories <= some.count < data.whole.count / 2
    numbers = [
        int(torch.nonzero((data.whole.features == segment[:, None]).all(2).all(0))[0])
        for segment in some.features.unbind(1)
    ]
    assert {number // data.pieces for number in numbers} == set(range(trajectories))
    assert len({number % data.pieces for number in numbers}) > 1  # early and late ones


def test_long_burn_ins_are_shared_by_short_segments_of_more_trajectories(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Starts forget a part of it; the last run forgets as much as the window truncates."""
    problem, given = problem_of(tmp_path), StateSpaceRecipe(order=2, hidden=4)
    burn_in, free = problem.window.n_truncated, quick(segment=None)
    monkeypatch.setattr(module, "SEGMENT", 4)
    usual = fit_data(problem, given, free)
    monkeypatch.setattr(module, "LONG_BURN_IN", burn_in - 1)
    data = fit_data(problem, given, free)
    assert usual.part.burn_in == data.whole.burn_in == burn_in
    assert data.part.burn_in == math.ceil(0.6 * burn_in)
    assert data.part.count > usual.part.count
    shape = MultiStart(data, lambda *shown: None).shape(2, 4)
    monkeypatch.setattr(module, "PER_PARAMETER", 4)
    some = data.for_refinement(shape)
    assert some.burn_in == burn_in
    assert len(some.targets) < len(data.whole.targets)
    assert some.targets.numel() < data.whole.targets.numel() / 2


def test_of_very_many_validation_data_a_part_judges(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, given = problem_of(tmp_path), StateSpaceRecipe(order=2, hidden=4)
    usual = fit_data(problem, given, quick(segment=8)).validation
    most = usual.targets.numel() // 2
    monkeypatch.setattr(module, "MOST_OF_VALIDATION", most)
    assert 0 < fit_data(problem, given, quick(segment=8)).validation.targets.numel() <= most


@pytest.mark.parametrize("units", essential(["tanh", "cubic", "mixed"], "mixed"))
def test_without_bias_the_network_is_odd(tmp_path: Path, units: str) -> None:
    network = {"order": 2, "hidden": 4, "bias": False, "units": units}
    found = fit(problem_of(tmp_path), network)
    assert found.error < SMALL
    inputs = spring(5, 2, 100)[0].numpy()
    assert np.array_equal(found.network.stream(-inputs), -found.network.stream(inputs))


@pytest.mark.parametrize("order", [0, 1])
def test_trajectories_beyond_the_range_are_added_with_their_weight(
    tmp_path: Path, order: int
) -> None:
    """They are scaled as the others, and choose nothing."""
    names = DIFFERENCES[: order + 1]
    table = StateSpaceRecipe(drive=names)
    training = quick(beyond_weight=0.25)
    inputs, outputs = spring(4, 3, 160, CUBIC, BEYOND)
    plain, both = (
        fit_data(problem_of(tmp_path, names=names, beyond=beyond), table, training)
        for beyond in (None, (inputs, outputs))
    )
    assert torch.equal(both.features, plain.features)
    for part in ("features", "targets"):
        assert torch.equal(getattr(both.validation, part), getattr(plain.validation, part))
    count, more = plain.whole.count, both.whole.count - plain.whole.count
    assert more == count // 2  # three trajectories beside six
    assert both.whole.weights.tolist() == [1.0] * count + [0.25] * more
    assert torch.equal(both.whole.targets[:, :count], plain.whole.targets[:, :count])
    beyond = both.whole.chosen(torch.arange(count, count + more))
    pieces = more // 3
    features = map_of(spring(1, 6, 160, CUBIC)[0], names)
    scaled = torch.from_numpy(features.along(inputs.numpy())).double()
    assert torch.equal(
        beyond.features[:, ::pieces].transpose(0, 1), scaled[:, : len(beyond.features)]
    )
    assert set(both.part.weights.tolist()) == {1.0, 0.25}


@pytest.mark.extended
def test_motions_beyond_the_range_are_learnt_with_a_low_weight(tmp_path: Path) -> None:
    """They cost next to nothing in the range."""
    inside, outside = spring(3, 2, 400, CUBIC), spring(5, 2, 400, CUBIC, BEYOND)
    without = fit(problem_of(tmp_path / "without"), NONLINEAR).network
    seen = spring(4, 6, 160, CUBIC, BEYOND)
    network = fit(problem_of(tmp_path / "with", beyond=seen), NONLINEAR).network
    assert relative_error(without, outside) > 10 * SMALL
    assert relative_error(network, outside) < 0.3 * relative_error(without, outside)
    assert relative_error(network, inside) < SMALL


def violent(seed: int) -> Pair:
    """The spring; one record of six is of large forces."""
    inputs, _ = spring(seed, 6, 160)
    sizes = torch.tensor([0.3, 0.3, 2.0, 0.3, 0.3, 0.3], dtype=torch.float64)
    inputs = inputs * sizes[:, None, None]
    return inputs, answers(inputs, CUBIC)


def test_data_are_evened_out_where_the_recipe_says(tmp_path: Path) -> None:
    """Each of training, beyond and validation about its own usual motion."""
    pairs = {
        "training": violent(1),
        "validation": violent(2),
        "beyond": spring(4, 6, 160, CUBIC, 2),
    }
    problem, table = problem_of(tmp_path, **pairs), StateSpaceRecipe(**NONLINEAR)
    plain, even = (
        fit_data(problem, table, quick(even_out=even_out)) for even_out in (False, True)
    )
    own = plain.whole.count // 2
    training, beyond = (plain.whole.chosen(torch.arange(first, first + own)) for first in (0, own))
    once = torch.cat([training.evened_out().weights, beyond.evened_out().weights])
    torch.testing.assert_close(even.whole.weights, once)
    torch.testing.assert_close(even.validation.weights, plain.validation.evened_out().weights)
    stride = _stride(QUICK.expert.part, own // 6, plain.whole.count)
    torch.testing.assert_close(even.part.weights, even.whole.weights[::stride])
    assert torch.equal(even.whole.targets, plain.whole.targets)
    assert set(plain.validation.weights.tolist()) == {1.0}
    # usual motions count more
    assert float(even.validation.weights.max()) > 1.3 > 1.0 > float(even.validation.weights.min())


def test_validation_error_is_a_mean_by_the_weights(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, training=violent(1), validation=violent(2))
    found = fit(problem, NONLINEAR, even_out=True)
    training = quick(even_out=True)
    data = fit_data(problem, StateSpaceRecipe(**NONLINEAR), training).validation
    values, _ = found.network.run(data.features.numpy().swapaxes(0, 1).astype(np.float32))
    squares = (values[:, data.burn_in :] - data.targets.numpy().swapaxes(0, 1)) ** 2
    expected = math.sqrt(np.average(squares.mean((1, 2)), weights=data.weights.numpy() ** 2))
    assert found.error == pytest.approx(expected, rel=1e-3)


@pytest.mark.extended
def test_rare_violent_motions_do_not_rule_an_evened_out_fit(tmp_path: Path) -> None:
    """A linear network cannot follow all: it stands for the stiffness of the many others."""
    usual, errors = spring(5, 4, 160, CUBIC, 0.3), []
    for even_out in (False, True):
        pairs = {"training": violent(1), "validation": violent(2)}
        problem = problem_of(tmp_path / str(even_out), **pairs)
        network = fit(problem, {"order": 2, "hidden": 0}, even_out=even_out).network
        errors.append(relative_error(network, usual))
    assert errors[1] < 0.7 * errors[0]
