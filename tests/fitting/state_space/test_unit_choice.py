"""Kinds of units, chosen by what networks do beyond the amplitudes that they were learnt from."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from slide_fmu.fitting.state_space import unit_choice
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.multi_start import Candidate
from slide_fmu.fitting.state_space.unit_choice import choose_units
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.cells import plain, random_segments, random_theta
from tests.fitting.state_space.springs import (
    CUBIC,
    QUICK,
    SMALL,
    Pair,
    fit,
    problem_of,
    quick,
    relative_error,
    spring,
)
from tests.progress import silent

SIZES = {"order": 2, "hidden": 8}
AMPLITUDES = (0.2, 0.3, 0.5, 0.7, 0.8, 1.0)


def saturating(seed: int, count: int) -> Pair:
    """Records of a first-order system whose gain saturates as tanh does."""
    rng = np.random.default_rng(seed)
    sizes = 3 * np.resize(AMPLITUDES, count)[:, None, None]
    inputs = torch.from_numpy(sizes * rng.uniform(-1, 1, (count, 160, 1))).float().double()
    outputs = inputs.new_zeros(count, 161, 1)
    for k in range(160):
        outputs[:, k + 1] = 0.5 * outputs[:, k] + torch.tanh(2 * inputs[:, k])
    return inputs, outputs


def hardening(seed: int, copies: int = 1) -> Pair:
    """Records of the spring with a cubic share, each of another amplitude."""
    parts = [spring(seed + k, copies, 160, CUBIC, a) for k, a in enumerate(AMPLITUDES)]
    inputs, outputs = zip(*parts, strict=True)
    return torch.cat(inputs), torch.cat(outputs)


@pytest.mark.extended
def test_spring_that_hardens_gets_mixed_units_and_goes_on_beyond_the_range(tmp_path: Path) -> None:
    records, beyond = hardening(1), spring(50, 4, 160, CUBIC, 1.4)
    found, errors = {}, {}
    for units in ("auto", "tanh"):
        problem = problem_of(tmp_path / units, training=records, validation=hardening(20))
        (tmp_path / units).mkdir()
        found[units] = fit(problem, {**SIZES, "units": units})
        errors[units] = relative_error(found[units].network, beyond)
    assert found["auto"].network.cell.activation == "mixed"
    assert len(found["auto"].network.cell.a) == 2  # without padding
    assert found["auto"].error < SMALL
    assert errors["auto"] < 0.2 * errors["tanh"]
    tried = {trial.units: trial for trial in found["auto"].history.units}
    assert list(tried) == ["tanh", "mixed", "cubic"]
    assert tried["mixed"].error_beyond < 0.5 * tried["tanh"].error_beyond
    assert found["tanh"].history.units == ()


@pytest.mark.extended
def test_system_that_saturates_keeps_tanh_units(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, training=saturating(1, 6), validation=saturating(2, 6))
    found = fit(replace(problem, eigenvalues=None), {**SIZES, "order": 1, "units": "auto"})
    assert found.network.cell.activation == "tanh"
    assert len(found.network.cell.a) == 1 + StateSpaceRecipe().padding
    assert len(found.history.units) == 3


@pytest.mark.extended
def test_network_that_diverges_beyond_is_not_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = unit_choice.sum_of_squares
    monkeypatch.setattr(
        unit_choice,
        "sum_of_squares",
        lambda shape, *rest: real(shape, *rest) if shape.units == "tanh" else math.nan,
    )
    problem = problem_of(tmp_path, training=hardening(1), validation=hardening(20))
    network, training = StateSpaceRecipe(**SIZES, units="auto"), QUICK
    data = fit_data(problem, network, training)
    recipe, tried, _ = choose_units(data, silent)
    assert (recipe.units, recipe.padding) == ("tanh", network.padding)
    assert [trial.error_beyond for trial in tried[1:]] == [math.inf, math.inf]


@pytest.mark.parametrize(("growth", "bounded"), [(0.5, True), (1e-3, False)])
def test_outputs_that_grow_too_fast_far_beyond_are_found_out(
    monkeypatch: pytest.MonkeyPatch, growth: float, bounded: bool
) -> None:
    """A linear cell grows in proportion."""
    monkeypatch.setattr(unit_choice, "FAR_GROWTH", 2 * growth)
    shape = plain(2, 1, 0, 1, bias=False)
    segments = random_segments(shape, 5, 20, 4)
    assert unit_choice._is_bounded(shape, random_theta(shape), segments) == bounded


def test_cubes_that_blow_up_far_beyond_are_found_out() -> None:
    shape = plain(2, 1, 3, 1, "cubic", bias=False)
    segments, theta = random_segments(shape, 5, 20, 4), random_theta(shape)
    assert not unit_choice._is_bounded(shape, 3 * theta, segments)
    assert unit_choice._error(shape, 3 * theta, segments) == math.inf


def test_largest_amplitudes_are_held_out(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, training=hardening(1, 2), validation=hardening(20))
    network, training = StateSpaceRecipe(**SIZES, units="auto"), QUICK
    data = fit_data(problem, network, training)
    small, large = unit_choice._divided(data)
    assert small.whole.count + large.count == data.whole.count
    assert large.count == pytest.approx(unit_choice.HELD_OUT * data.whole.count, abs=1)
    middle = data.whole.targets.mean()
    least = float((large.targets - middle).abs().amax((0, 2)).min())
    for segments in (small.whole, small.part, small.validation):
        assert segments.count > 0
        assert float((segments.targets - middle).abs().max()) < least


@pytest.mark.extended
def test_fewest_cubes_that_do_as_well_are_taken_where_their_number_is_open(
    tmp_path: Path,
) -> None:
    """The spring is a map with one cube, whose samples have one step."""
    problem = problem_of(tmp_path, training=hardening(1, 2), validation=hardening(20))
    network = StateSpaceRecipe(order=2, units="auto", bias=False)
    training = quick(start_iterations=12, kept_iterations=20)
    data = fit_data(problem, network, training)
    recipe, tried, _ = choose_units(data, silent)
    assert [trial.units for trial in tried[:3]] == ["tanh", "mixed", "cubic"]
    few = [trial for trial in tried[3:] if trial.number == recipe.hidden]
    assert (recipe.hidden, recipe.units, recipe.substeps) == (1, "mixed", 1)
    assert (recipe.units, recipe.substeps) == (few[-1].units, few[-1].substeps)
    scores = [trial.validation_error * trial.error_beyond for trial in (*tried[1:3], few[-1])]
    assert scores[-1] <= unit_choice.AS_GOOD * min(scores[:-1])


@pytest.mark.parametrize(
    ("poles", "expected"),
    [((0.98, 0.97), 1), ((0.9, 0.82), 4), ((0.9, 0.01), 8), ((0.9, -0.2), 1)],
)
def test_substeps_are_short_beside_the_fastest_pole(
    poles: tuple[float, float], expected: int
) -> None:
    shape = plain(2, 1, 0, 1)
    cell = replace(shape.split(random_theta(shape)), a=torch.diag(torch.tensor(poles)).double())
    theta = shape.join(cell)
    assert unit_choice.substeps_for(Candidate(shape, Iterate(theta, theta, 0.0))) == expected


def test_single_segment_gets_tanh_units(tmp_path: Path) -> None:
    problem = problem_of(
        tmp_path, training=spring(1, 1, 60, CUBIC), validation=spring(2, 1, 60, CUBIC)
    )
    found = fit(problem, {**SIZES, "units": "auto"})
    assert found.network.cell.activation == "tanh"
    assert found.history.units == ()
