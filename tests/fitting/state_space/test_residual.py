"""What a cell leaves over can be predicted where there is more to learn, and only there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from slide_fmu.fitting.state_space.fit_data import FitData, fit_data
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.fitting.state_space.residual import learnable_share
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.springs import CUBIC, NONLINEAR, QUICK, problem_of, spring
from tests.progress import silent

NOTHING = 0.02
"""A share that chance explains: some hundred regressors, several hundred samples."""


def share_of(folder: Path, cubic: float, order: int, noise: float = 0.0) -> float:
    """The share of what a linear model of the spring leaves over."""
    problem = problem_of(folder, cubic)
    network, training = StateSpaceRecipe(**NONLINEAR), QUICK
    data = noisy(fit_data(problem, network, training), noise)
    linear = MultiStart(data, silent).linear(order)
    return learnable_share(linear.shape, linear.state.best, (data.part, data.validation))


def noisy(data: FitData, deviation: float) -> FitData:
    """The same data with white noise on the outputs."""
    generator = torch.Generator().manual_seed(5)

    def more(segments: Any) -> Any:
        noise = torch.randn(segments.targets.shape, generator=generator, dtype=torch.float64)
        return replace(segments, targets=segments.targets + deviation * noise)

    return replace(
        data, whole=more(data.whole), part=more(data.part), validation=more(data.validation)
    )


def test_residual_of_a_linear_model_of_a_nonlinear_system_is_predictable(tmp_path: Path) -> None:
    assert share_of(tmp_path, CUBIC, 2) > 0.5


def test_residual_of_too_few_states_is_predictable(tmp_path: Path) -> None:
    assert share_of(tmp_path, 0.0, 1) > 0.5


@pytest.mark.parametrize("noise", [1e-3, 0.1])
def test_noise_is_not_predictable(tmp_path: Path, noise: float) -> None:
    assert share_of(tmp_path, 0.0, 2, noise) < NOTHING


@pytest.mark.parametrize("samples", [60, 70])
def test_single_segment_is_enough_to_ask(tmp_path: Path, samples: int) -> None:
    """A record may be that short: its stretches are left out in turn."""
    training, validation = (spring(seed, 1, samples, CUBIC) for seed in (1, 2))
    problem = problem_of(tmp_path, training=training, validation=validation)
    network, recipe = StateSpaceRecipe(order=2, hidden=0), QUICK
    multi_start = MultiStart(fit_data(problem, network, recipe), silent)
    linear = multi_start.linear(2)
    data = multi_start.data
    assert data.part.count == data.validation.count == 1
    assert 0 <= learnable_share(linear.shape, linear.state.best, (data.part, data.validation)) < 1
