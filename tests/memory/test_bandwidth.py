"""The step that is proposed for a system, and what is said about one that was chosen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.bandwidth import (
    between_samples,
    proposed_step,
    step_remark,
    tidy_step,
)
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from tests.memory.plain_systems import Acceleration, FixedStep, Lag, Through
from tests.memory.test_lengths import of_lag
from tests.memory.test_sizing import DUFFING
from tests.recipes import tiny_recipe


@pytest.mark.parametrize("time_constant", [1e-3, 1.0, 300.0])
def test_lag_is_sampled_some_times_in_its_time_constant(time_constant: float) -> None:
    """The gain 1 / sqrt(1 + w^2 T^2) is a fifth of the largest at w T = sqrt(24)."""
    found = proposed_step(lambda step: Lag(step, time_constant))
    corner = math.sqrt(24) / (2 * math.pi * time_constant)
    assert found.bandwidth is not None
    # a spectrum at a step of more than the lag shows the corner blurred by what folds back
    assert 0.7 < found.bandwidth / corner < 2.0
    assert 0.5 < found.step * 5.0 * found.bandwidth <= 1.0


@pytest.mark.parametrize("first", [1e-4, 0.01, 1.0])
def test_oscillator_is_sampled_some_ten_times_in_its_period(first: float) -> None:
    found = proposed_step(lambda step: LinearOscillator(step=step), first)
    assert found.bandwidth is not None
    assert 40.0 / (2 * math.pi) < found.bandwidth < 20.0
    assert 7.0 < 2 * math.pi / 40.0 / found.step < 16.0


def test_output_that_follows_the_input_at_once_is_sampled_by_its_own_dynamics() -> None:
    found = proposed_step(Acceleration)
    assert found.bandwidth is not None
    assert Acceleration.FREQUENCY / (2 * math.pi) < found.bandwidth < 40.0


def test_system_without_dynamics_keeps_the_first_step() -> None:
    found = proposed_step(Through)
    assert (found.step, found.bandwidth) == (0.01, None)


def test_system_with_a_step_of_its_own_is_looked_at_with_that() -> None:
    found = proposed_step(_fixed)
    assert found.bandwidth is not None


class Broken(Lag):
    def simulate(self, inputs: FloatArray) -> FloatArray:
        raise SimulationError("it never moves")


def _fixed(step: float) -> System:
    try:
        return FixedStep(step)
    except ValueError as error:
        raise LoadError(str(error)) from error


@pytest.mark.parametrize(
    ("step", "tidied"),
    [(0.0101, 0.01), (0.0199, 0.015), (0.99, 0.8), (1.0, 1.0), (3600.0, 3000.0), (0.2, 0.2)],
)
def test_tidy_step_is_rounded_down(step: float, tidied: float) -> None:
    assert tidy_step(step) == tidied


def test_error_between_samples_is_that_of_the_worst_output() -> None:
    time = np.linspace(0.0, 20.0, 401)
    outputs = np.stack([np.sin(time), np.sin(40.0 * time), np.zeros(401)], axis=1)
    assert between_samples(outputs[:, :1], 4) < 1e-4
    assert between_samples(outputs[:, 2:], 4) == 0.0
    assert between_samples(outputs, 4) == between_samples(outputs[:, 1:2], 4) > 0.1


def test_step_of_a_released_recipe_has_no_remark() -> None:
    assert step_remark(load_recipe(DUFFING)) is None


def test_step_that_is_too_coarse_or_wastes_samples_has_a_remark() -> None:
    model = {"model": "mbs_models.oscillators:LinearOscillator", "parameters": {"damping": 8.0}}
    coarse = tiny_recipe(
        system=model,
        window={"step": 0.08},
        data={"duration": 9.0},
    )
    remark = step_remark(coarse)
    assert remark is not None
    assert remark.startswith("window.step = 0.08 s: between its samples outputs differ by")
    slow = {"kind": "harmonic", "weight": 1.0, "angular_frequency": [1.0, 2.0]}
    fine = of_lag(window={"step": 0.01, "n_in": 90}, data={"excitation": [slow]})
    remark = step_remark(fine)
    assert remark is not None
    assert remark.startswith("window.step = 0.01 s: samples that are 4 times rarer still show")


def test_step_of_a_system_that_has_its_own_has_no_remark() -> None:
    assert step_remark(of_lag("FixedStep", window={"step": 0.01, "n_in": 90})) is None


def test_system_that_no_step_simulates_is_refused() -> None:
    with pytest.raises(SimulationError, match="it never moves"):
        proposed_step(Broken)
