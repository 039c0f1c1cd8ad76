"""Errors beside measured outputs are compared without the noise, where there is some."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from slide_fmu.fitting.state_space import sizes
from slide_fmu.fitting.state_space.fit_data import FitData, fit_data
from slide_fmu.fitting.state_space.multi_start import Candidate, MultiStart
from slide_fmu.fitting.state_space.residual import noise_in, without_noise
from slide_fmu.fitting.state_space.sizes import choose_sizes
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.springs import CUBIC, QUICK, problem_of
from tests.fitting.state_space.test_residual import noisy
from tests.progress import silent


def multi_start(folder: Path, cubic: float, noise: float, units: int | str = 0) -> MultiStart:
    problem = problem_of(folder, cubic)
    network = StateSpaceRecipe(order=2, hidden=units)
    training = QUICK
    data: FitData = noisy(fit_data(problem, network, training), noise)
    return MultiStart(data, silent)


def linear(folder: Path, cubic: float, noise: float) -> tuple[Candidate, FitData]:
    found = multi_start(folder, cubic, noise)
    return found.linear(2), found.data


@pytest.mark.parametrize("noise", [0.01, 0.1])
def test_noise_beside_a_right_model_is_its_whole_error(tmp_path: Path, noise: float) -> None:
    candidate, data = linear(tmp_path, 0.0, noise)
    assert noise_in(candidate, data.validation) == pytest.approx(noise, rel=0.1)


def test_error_of_a_wrong_model_is_no_noise(tmp_path: Path) -> None:
    candidate, data = linear(tmp_path, CUBIC, 1e-4)
    assert noise_in(candidate, data.validation) == 0.0


def test_error_that_is_not_finite_has_no_noise(tmp_path: Path) -> None:
    candidate, data = linear(tmp_path, 0.0, 0.1)
    broken = replace(candidate, state=replace(candidate.state, best_error=math.inf))
    assert noise_in(broken, data.validation) == 0.0


def test_errors_without_noise_are_told_down_to_a_part_of_it() -> None:
    assert without_noise(0.5, 0.0) == 0.5
    assert without_noise(5.0, 3.0) == pytest.approx(4.0)
    assert without_noise(1.0, 1.0) == without_noise(0.9, 1.0) == pytest.approx(0.1)
    assert without_noise(math.inf, 1.0) == math.inf


@pytest.mark.extended
def test_search_beside_noise_finds_units_that_lower_the_whole_error_little(
    tmp_path: Path,
) -> None:
    """The spring's own error falls to a part of itself, but the whole error by less than 20 %."""
    found = multi_start(tmp_path, 0.15, 0.03, "auto")
    chosen = choose_sizes(found)
    errors = {size.units: size.validation_error for size in chosen.tried}
    assert chosen.n_units > 0
    assert errors[0] is not None
    assert errors[chosen.n_units] is not None
    assert 0.8 * errors[0] < errors[chosen.n_units] < errors[0]


@pytest.mark.parametrize(
    ("training_error", "parameters", "enough"),
    [
        (1.0, 100, True),
        (1.2, 100, False),
        (0.9, 1000, True),
        (0.9, 4000, False),
        (0.9, 5000, False),
    ],
)
def test_network_that_leaves_hardly_more_than_noise_is_large_enough(
    training_error: float, parameters: int, enough: bool
) -> None:
    """Errors relative to the noise; parameters hide some of the noise in 5000 samples."""
    noise, shape = 4e-3, SimpleNamespace(n_parameters=parameters)
    network: Any = SimpleNamespace(
        error=1.5 * noise, training_error=training_error * noise, shape=shape
    )
    assert sizes._good(network, noise, 5000) == enough
