"""The search for sizes does not give up on the quarter car with friction.

A few units gain little over its best linear model, unless they see enough of the data.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.draws import draw, simulate_draw, split_stream
from slide_fmu.fitting.preparation import eigenvalues_at_rest
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space import sizes
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe
from tests.fitting.state_space.springs import Pair, map_of
from tests.friction_car import FrictionCar, friction_recipe
from tests.progress import silent

TRAVEL = 1
"""Index of the suspension travel among the outputs."""
LINEAR, FOUND = 0.09, 0.05
"""The best linear model misses more than the first of the travel, a network less than the second
after some seconds."""
QUICK = LeastSquaresRecipe(
    starts=3,
    iterations=15,
    expert=LeastSquaresExpert(start_iterations=10, kept=1, kept_iterations=15),
)


def problem_of(folder: Path, car: FrictionCar) -> Problem:
    """Learn the suspension travel from the road, on as few trajectories as an impatient user."""
    recipe = friction_recipe(data={"train": 12, "validation": 3, "burn_in": 3.0})

    def record(split: str) -> tuple[FloatArray, FloatArray]:
        motions = [
            simulate_draw(car, draw(recipe, car, split_stream(recipe, split, index), index))
            for index in range(recipe.count(split))
        ]
        inputs = range_scaling(car.inputs).apply(np.stack([m.inputs for m in motions]))
        return inputs, np.stack([m.outputs[:, [TRAVEL]] for m in motions])

    records = record("train"), record("validation")
    scale = Affine(np.zeros(1), records[0][1].reshape(-1, 1).std(axis=0))

    def scaled(inputs: FloatArray, outputs: FloatArray) -> Pair:
        return torch.from_numpy(inputs), torch.from_numpy(scale.apply(outputs))

    pairs = [scaled(*found) for found in records]
    features, window = map_of(pairs[0][0], ("inputs",)), Window(car.step, 200, 40)
    return Problem(window, features, *pairs, folder / "c.pt", eigenvalues_at_rest(car))


@pytest.mark.extended
def test_network_of_the_car_with_friction_is_not_linear(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sizes, "MOST_UNITS", 16)
    problem = problem_of(tmp_path, FrictionCar(slip=0.005, road=0.1))
    found = fit_state_space(problem, StateSpaceRecipe(order=5), QUICK, silent)
    network, history = found.network, found.history
    assert isinstance(network, StateSpace)
    linear, larger = history.sizes
    assert (linear.units, larger.units, len(network.cell.w)) == (0, 16, 16)
    assert linear.validation_error is not None
    assert linear.validation_error > LINEAR
    assert linear.learnable_error is not None
    assert linear.learnable_error > 0.5 * LINEAR
    assert min(history.validation_error) < FOUND


@pytest.mark.extended
def test_network_of_the_car_without_friction_is_linear(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, FrictionCar(friction=0.0))
    found = fit_state_space(problem, StateSpaceRecipe(), QUICK, silent)
    network, history = found.network, found.history
    assert network.is_affine
    assert history.remark is None


@pytest.mark.extended
def test_linear_network_of_the_car_with_friction_is_told_to_be_poor(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, FrictionCar())
    found = fit_state_space(problem, StateSpaceRecipe(order=4, hidden=0), QUICK, silent)
    history = found.history
    assert history.sizes == ()
    assert history.remark is not None
    assert "could still be learnt from the inputs: give more trajectories" in history.remark
